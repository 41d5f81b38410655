"""How many modules one study file passes, from its text to its results and to its page."""

import sys

from places import ROOT

from nlctl.analysis.pages.study.report import study_report
from nlctl.analysis.studies import read_study, run

LAG = """
loop = "nlctl:block"
options = { spec = { block = "Lag" }, name = "lag" }
study = { title = "A lag", seed = 1 }
space."lag.T" = { uniform = [0.05, 0.4] }
inputs.u = 1.0
spec.rises = "always from 1 s on v >= 0.9"
time = { end = 1.2, step = 0.1 }
runs.size = 20
analysis = [{ kind = "probability", limit = 0.3 }]
"""


def passed(function, *arguments):
    """Return what a function returns, and the modules of the analysis that it enters."""
    entered = set()

    def note(frame, event, argument):
        if event == "call" and frame.f_code.co_name != "<module>":
            entered.add(frame.f_code.co_filename)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        value = function(*arguments)
    finally:
        sys.setprofile(before)
    return value, {name for name in entered if name.startswith(str(ROOT / "analysis"))}


def test_who_follows_a_study_reads_few_modules(tmp_path):
    """Reading, running and keeping it take at most 35, its page 14 more."""
    path = tmp_path / "lag.toml"
    path.write_text(LAG, encoding="utf-8")
    file, reading = passed(read_study, path)
    result, running = passed(run, file, tmp_path / "run")
    page, composing = passed(study_report, result)
    assert result.verdict == "The claim is shown."
    assert page.title == "A lag"
    assert len(reading | running) <= 35, sorted(reading | running)
    assert len(composing - reading - running) <= 14, sorted(composing - reading - running)
