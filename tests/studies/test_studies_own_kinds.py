"""An analysis and an actuator from outside of the package: a study names them, all finds them."""

import os
import subprocess
import sys

import numpy as np
import pytest
from command_line import nlctl_here
from places import ROOT
from rows import each_row

from nlctl import DeadZone
from nlctl.analysis.cli.study_report import report_study
from nlctl.analysis.cli.written_page import PageOptions
from nlctl.analysis.pages.study.report import study_part, study_report
from nlctl.analysis.report.document import Figure, Paragraph, Table
from nlctl.analysis.studies import Asked, Kind, StudyError, load_result, plan, read_study, run
from nlctl.analysis.studies.folder import remove_run
from nlctl.errors import UsageError

LOOP = '''
import nlctl


@nlctl.record
class Clip:
    """Saturation: v = y within the limit, and the limit beyond."""

    limit: float = nlctl.param(2.0, unit="1", meaning="largest magnitude", above=0)
    inputs, outputs, states = ("y",), ("v",), ()
    feedthrough = True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (min(max(u[0], -p.limit), p.limit),)


@nlctl.record
class Lag:
    """x' = v - rate x."""

    rate: float = nlctl.param(2.0, unit="1/s", meaning="decay", above=0)
    inputs, outputs, states, initial = ("v",), ("y",), ("x",), {"x": 1.0}
    feedthrough = False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (u[0] - p.rate * x[0],)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def loop(actuator=nlctl.DeadZone()):
    return nlctl.interconnect({"lag": Lag(), "actuator": actuator}, outputs=["y", "v"])
'''
KIND = '''
import numpy as np
from pydantic import Field

from nlctl.analysis.figures import margins_figure
from nlctl.analysis.report.document import Figure
from nlctl.analysis.studies import Asked, Kind, finding_of


class Spread(Asked):
    """The standard deviation of a column of the main table."""

    of: str = Field("spec", description="Column of the main table.")
    limit: float | None = Field(None, gt=0, description="Claim: it is at most this.")

    @property
    def claim(self):
        return "" if self.limit is None else f"the spread is at most {self.limit:g}"


def run(asked, ground):
    values = ground.rows.columns(asked.of)[asked.of].to_numpy()
    spread = float(np.std(values))
    answer = ""
    if asked.limit is not None:
        answer = "shown" if spread <= asked.limit else "refuted"
    return finding_of(
        asked,
        f"'{asked.of}' has the standard deviation {spread:.4g} in {values.size} runs.",
        runs=values.size,
        numbers={"spread": spread},
        tables={"values": ground.rows.columns(asked.of)},
        answer=answer,
    )


def measured(finding, asked):
    return {"measured": f"{finding.numbers['spread']:.4g}", "limit": f"at most {asked.limit:g}"}


def items(finding, result, asked, key):
    values = finding.tables["values"][asked.of].to_numpy()
    words = f"{asked.of} of the runs."
    figure = margins_figure(values)
    yield Figure(key=f"{key}-values", caption=words, description=words, figure=figure)


spread = Kind(
    name="spread",
    schema=Spread,
    run=run,
    title="Spread of a column",
    answers="the standard deviation of a column",
    claims="it is at most `limit`",
    method="The spread is the root of the mean square deviation (Gauss 1809).",
    sources=("C. F. Gauss: Theoria motus corporum coelestium. Perthes (1809).",),
    needs_rows=True,
    columns=("of",),
    measured=measured,
    items=items,
)
not_a_kind = 3
'''
STUDY = """
loop = "plant.py:loop"
options.actuator = { function = "plant.py:Clip", limit = 1.5 }
[study]
title = "A lag behind a saturation"
seed = 5
[space]
"lag.rate" = { uniform = [1.5, 2.5] }
"actuator.limit" = { uniform = [1.2, 1.8] }
[spec]
decays = "always from 1 s on |y| <= 0.7"
[time]
end = 2.0
step = 0.02
[runs]
size = 64
"""
SPREAD = """
[[analysis]]
kind = "probability"
[[analysis]]
kind = "spread.py:spread"
limit = 0.5
"""


@pytest.fixture
def forgotten():
    """Modules of study folders are read anew, as in another process."""
    yield
    forget()


def forget():
    for name in [name for name in sys.modules if name.startswith(("spread_", "plant_"))]:
        del sys.modules[name]


def written(folder, analyses=SPREAD, kind=KIND):
    (folder / "plant.py").write_text(LOOP, encoding="utf-8")
    (folder / "spread.py").write_text(kind, encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(STUDY + analyses, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    here = tmp_path_factory.mktemp("own")
    written(here)
    return here


@pytest.fixture(scope="module")
def result(folder):
    return run(read_study(folder / "study.toml"), folder / "run")


def test_a_study_with_both_is_valid_and_planned(folder):
    """The analysis and the parameter of the actuator are known by their names."""
    file = read_study(folder / "study.toml")
    assert "actuator.limit" in file.experiment.space.names
    assert [asked.kind for asked in file.study.analysis] == ["probability", "spread.py:spread"]
    assert plan(file).runs == {"rows": 64}
    told = nlctl_here("validate", "study.toml", cwd=folder)
    assert told.stdout.startswith("study.toml is a valid study.\n  rows: 64 runs\n")


def test_it_finds_what_the_closed_form_says(result):
    """Within the limit y = exp((1 - rate) t), so the margin is 1 - exp(1 - rate) / 0.7."""
    table = result.rows.table
    assert table["spec"].to_numpy() == pytest.approx(
        1 - np.exp(1 - table["lag.rate"].to_numpy()) / 0.7, abs=1e-5
    )
    found = result["spread"]
    assert found.numbers["spread"] == pytest.approx(table["spec"].std(ddof=0), rel=1e-12)
    assert (found.kind, found.answer, found.title) == ("spread.py:spread", "shown", "Spread")


def test_the_list_shows_both(folder):
    """Their keys and parameters, as those of nlctl's own."""
    told = nlctl_here("list", "spread.py:spread", cwd=folder).stdout
    assert "the standard deviation of a column; claim: it is at most limit" in told
    assert "Column of the main table." in told
    assert "largest magnitude" in nlctl_here("list", "plant.py:Clip", cwd=folder).stdout
    told = nlctl_here("list", "spread.py:not_a_kind", cwd=folder)
    assert "a block's record or a kind of analysis, 'spread.py:not_a_kind' is a int" in told.stderr


@pytest.mark.slow
def test_the_report_has_its_section_claim_method_and_source(folder, result):
    """Everything that the kind brings stands on the page, from a run that is read back."""
    made = study_report(load_result(folder / "run"))
    (section,) = (s for s in made.sections if s.key == "spread")
    told, figure = section.items
    assert (section.title, type(told), type(figure)) == ("Spread of a column", Paragraph, Figure)
    assert told.text == result["spread"].sentence
    (claim,) = (c for c in made.claims if c.evidence == "spread")
    assert (claim.measured, claim.limit) == (
        f"{result['spread'].numbers['spread']:.4g}",
        "at most 0.5",
    )
    assert any("Gauss 1809" in words for words in made.methods)
    assert any("Theoria motus" in source for source in made.references)
    asked = next(s for s in made.sections if s.key == "study_asked")
    assert "plant.py:Clip" in asked.items[0].text
    (found,) = (item for item in study_part([(result, None)])[1].items if isinstance(item, Table))
    assert ("Spread of a column", result["spread"].sentence) in found.rows
    page, _ = report_study(folder / "run", PageOptions())
    assert result["spread"].sentence.replace("'", "&#39;") in page.read_text(encoding="utf-8")


MISTAKES = [  # the analysis, the place that is named, and words
    ('kind = "spread.py:spred"', ("analysis", 0, "kind"), "nearest: 'spread'"),
    ('kind = "gone.py:spread"', ("analysis", 0, "kind"), "there is no file"),
    ('kind = "spread.py:not_a_kind"', ("analysis", 0, "kind"), "is a int"),
    ('kind = "spred"', ("analysis", 0, "kind"), "a kind of your own is 'path/to/file.py:name'"),
    ('kind = "subprocess:run"', ("analysis", 0, "kind"), "standard library"),
    ('kind = "spread.py:spread"\nof = "spac"', ("analysis", 0, "of"), "nearest: 'spec'"),
    ('kind = "spread.py:spread"\nlimit = -1.0', ("analysis", 0, "limit"), "greater than 0"),
    ('kind = "spread.py:spread"\nlimits = 1.0', ("analysis", 0, "limits"), "nearest: 'limit'"),
]


@each_row("asked, place, words", MISTAKES)
def test_mistakes_in_its_table_are_told_with_their_place(tmp_path, asked, place, words):
    """As those of nlctl's own kinds, beside a mistake elsewhere."""
    path = written(tmp_path, f"[[analysis]]\n{asked}\n[[analysis]]\nkind = 'sobol'\nsize = 5\n")
    with pytest.raises(StudyError) as told:
        read_study(path)
    first, second = sorted(told.value.problems, key=lambda problem: problem.place)
    assert first.place == place
    assert words in first.message
    assert second.place[:2] == ("analysis", 1)


def test_a_kind_needs_the_main_table_where_it_says_so(tmp_path):
    """A study without [runs] is told so before anything runs."""
    path = written(tmp_path, '[[analysis]]\nkind = "spread.py:spread"\n')
    path.write_text(path.read_text().replace("[runs]\nsize = 64\n", ""))
    with pytest.raises(StudyError, match=r"'spread.py:spread' needs the main table: add \[runs\]"):
        read_study(path)


def test_what_a_kind_refuses_costs_its_analysis_alone(tmp_path):
    """The others keep their answers."""
    kind = KIND.replace("    values = ", "    raise UsageError('no way')\n    values = ", 1)
    path = written(tmp_path, kind=f"from nlctl.errors import UsageError\n{kind}")
    found = run(read_study(path), tmp_path / "run")
    assert found["spread"].sentence == "Not answered: no way."
    assert found["probability"].is_answered


def test_a_run_can_be_read_whose_kind_has_gone(tmp_path, forgotten):
    """Sentence and claim stay, a note says what is missing, and the folder can be removed."""
    path = written(tmp_path)
    before = run(read_study(path), tmp_path / "run")
    (tmp_path / "spread.py").unlink()
    after = load_result(tmp_path / "run")
    assert after["spread"].plain() == before["spread"].plain()
    assert any("there is no file" in note for note in after.notes)
    (section,) = (s for s in study_report(after).sections if s.key == "spread")
    assert [type(item) for item in section.items] == [Paragraph]
    with pytest.raises(StudyError, match="there is no file"):
        read_study(path)
    remove_run(tmp_path / "run")


@pytest.mark.slow
def test_a_kind_from_elsewhere_is_imported_for_who_trusts_it(tmp_path):
    """It is recorded; what was edited since is read all the same, without its figures."""
    home = tmp_path / "study"
    home.mkdir()
    path = written(home, SPREAD.replace("spread.py", "../spread.py"))
    (home / "spread.py").rename(tmp_path / "spread.py")
    with pytest.raises(StudyError, match=r"analysis\[1\]\.kind: .* Trust it with --trust"):
        read_study(path)
    found = run(read_study(path, trust=True), home / "run")
    for edited, trust in ((False, False), (True, False), (True, True), (True, False)):
        if edited:
            (tmp_path / "spread.py").write_text(f"# {trust}\n{KIND}", encoding="utf-8")
        again = load_result(home / "run", trust=trust)
        assert again["spread"].plain() == found["spread"].plain()
        told = any("Trust it with --trust" in note for note in again.notes)
        assert told is (edited and not trust)


def test_a_run_is_not_continued_with_another_kind(tmp_path, forgotten):
    """What a finding was computed by belongs to what results are held against; comments do not."""
    path = written(tmp_path)
    run(read_study(path), tmp_path / "run")
    for kind, refused in ((f"# spread\n{KIND}", False), (KIND.replace("np.std", "np.ptp"), True)):
        forget()
        (tmp_path / "spread.py").write_text(kind, encoding="utf-8")
        file = read_study(path)
        if refused:
            with pytest.raises(UsageError, match=r"kinds\.spread\.py:spread was"):
                run(file, tmp_path / "run", resume=True)
        else:
            assert run(file, tmp_path / "run", resume=True).complete


def function(asked, ground):
    return None


@each_row("fields, words", [
    ({"name": "Spread"}, "a name of lower-case words and digits, got 'Spread'"),
    ({"name": ""}, "a name of lower-case words and digits, got ''"),
    ({"schema": DeadZone}, "a schema that is a subclass of Asked"),
    ({"columns": ("of",)}, "that are keys of its schema, got 'of' (kind 'spread')"),
])  # fmt: skip
def test_a_kind_that_cannot_be_one_is_refused_where_it_is_made(fields, words):
    """By name, rule and value."""
    whole = {"name": "spread", "schema": Asked, "run": function, "title": "Spread"} | fields
    with pytest.raises(UsageError) as told:
        Kind(**whole)
    assert words in str(told.value)


REACHED = '''
import numpy as np
import pandas as pd
from nlctl.analysis.loop_record import short_key
from nlctl.analysis.studies import Asked, Kind


class Mean(Asked):
    """The mean of a column."""


def run(asked, ground):
    return np.mean(ground), pd.DataFrame(ground).mean()


mean = Kind(name="mean", schema=Mean, run=run, title="Mean", answers="a mean")
print(short_key(run), short_key(mean))
'''


@pytest.mark.weekly
def test_the_code_of_a_kind_has_one_key_in_every_process():
    """Also where its run mentions a name that the kind has: a schema is built from sets."""
    told = [
        subprocess.run(
            [sys.executable, "-c", REACHED], capture_output=True, text=True, check=True,
            env={**os.environ, "PYTHONHASHSEED": seed}, cwd=ROOT,
        ).stdout.split()
        for seed in ("1", "2")
    ]  # fmt: skip
    assert told[0] == told[1]
    assert len(set(told[0])) == 2
