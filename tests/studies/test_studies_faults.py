"""Faults of a study: a lag whose faulty answers are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from rows import each_row

from nlctl.analysis.pages.study.report import study_report
from nlctl.analysis.robustness import Requirement
from nlctl.analysis.robustness.stl.spec import violation_time
from nlctl.analysis.robustness.stl.text import parse_formula
from nlctl.analysis.studies import StudyError, load_result, plan, read_study, run
from nlctl.analysis.studies.replay import replay

LOOP = '''
import nlctl


@nlctl.record
class One:
    """s = 1."""

    inputs, outputs, states, feedthrough = (), ("s",), (), False

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (1.0,)


@nlctl.record
class Lag:
    """y' = rate (s - y) from y(0) = 1."""

    rate: float = nlctl.param(1.0, unit="1/s", meaning="decay", above=0)
    inputs, outputs, states, initial = ("s",), ("y",), ("y",), {"y": 1.0}
    feedthrough = False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (p.rate * (u[0] - x[0]),)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def loop():
    return nlctl.interconnect({"one": One(), "lag": Lag()}, outputs=["y"])
'''
STUDY = """
loop = "loop.py:loop"

[study]
title = "A lag that fails"
seed = 3

[space]
"lag.rate" = { uniform = [0.5, 1.5] }

[faults]
"one.s" = { bias = 0.4, stuck = true, disconnection = true, dropout = 0.1 }
"lag.s" = { gain = 1.2, bias = 1.0 }

[spec]
near = "always 0.5 <= y <= 1.5"
late = "eventually in [0, 10] s y >= 0.9"

[time]
end = 10.0
step = 0.01

[[analysis]]
kind = "faults"
onset = 5.0
tolerates = ["one.s bias", "one.s dropout"]
"""


def written(folder, text=STUDY):
    (folder / "loop.py").write_text(LOOP, encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The study, run."""
    place = tmp_path_factory.mktemp("faults")
    file = read_study(written(place))
    assert plan(file).runs == {"faults": 1 + 6 + 15}
    run(file, place / "run")
    return place / "run"


@pytest.fixture(scope="module")
def finding(folder):
    (found,) = load_result(folder).findings
    return found


def effect(finding, first, second=""):
    table = finding.tables["effects"]
    row = table[(table["first"] == first) & (table["second"] == second)]
    return row.iloc[0]


@each_row(
    "first, second, after, least",
    [
        ("", "", np.inf, 0.5),
        ("one.s bias", "", np.inf, 1.5 - 1 - 0.4 * (1 - np.exp(-5))),
        ("one.s stuck", "", np.inf, 0.5),
        ("one.s disconnection", "", np.log(2), np.exp(-5) - 0.5),
        ("one.s dropout", "", np.inf, np.exp(-0.1) - 0.5),
        ("lag.s bias", "", np.log(2), 0.5 - (1 - np.exp(-5))),
        ("one.s bias", "lag.s gain", np.log(0.68 / 0.18), 0.5 - 0.68 * (1 - np.exp(-5))),
        ("one.s bias", "lag.s bias", np.log(1.4 / 0.9), 0.5 - 1.4 * (1 - np.exp(-5))),
    ],
)
def test_margins_and_times_to_a_violation(finding, first, second, after, least):
    """y = 1 + c (1 - exp(-(t - 5))): it leaves the band where that is 1.5 or 0.5."""
    row = effect(finding, first, second)
    if np.isfinite(after):
        assert row["near violated at"] == pytest.approx(5 + after, abs=1e-4)
        assert row["margin"] == pytest.approx(least / 1.5, abs=1e-5)
    else:
        assert row["near violated at"] == np.inf
        assert row["margin"] > 0
    assert row["late violated at"] == np.inf


def test_what_two_faults_do_that_neither_does_alone(finding):
    """A bias of 0.4 and a gain of 1.2 pass by themselves; their product does not."""
    table, only = finding.tables["effects"], finding.numbers["only_together"]
    pairs = {(table["first"][i], table["second"][i]) for i in only}
    assert pairs == {("one.s bias", "lag.s gain")}
    assert finding.numbers["singles_violating"] == 2
    assert "1 of them although neither fault does alone" in finding.sentence


def test_the_claim_is_shown_and_refuted(finding, tmp_path):
    """A fault that is tolerated, and one that is not."""
    assert finding.answer == "shown"
    text = STUDY.replace('"one.s dropout"]', '"lag.s bias"]\npairs = false')
    other = run(read_study(written(tmp_path, text)), tmp_path / "run").findings[0]
    assert other.answer == "refuted"
    assert len(other.tables["effects"]) == 7


def test_what_tells_of_a_fault_is_told_beside_the_spec(tmp_path):
    """An alarm at y = 1.3: 1 + c (1 - exp(-(t - 5))) is there after ln(c / (c - 0.3))."""
    text = STUDY + 'pairs = false\ndetects = { alarm = "always y <= 1.3" }\n'
    file = read_study(written(tmp_path, text))
    result = run(file, tmp_path / "run")
    (finding,) = result.findings
    for name, c in (("one.s bias", 0.4), ("lag.s bias", 1.0)):
        told = effect(finding, name)["alarm violated at"]
        assert told == pytest.approx(5 + np.log(c / (c - 0.3)), abs=1e-4)
    assert effect(finding, "lag.s gain")["alarm violated at"] == np.inf
    assert effect(finding, "")["alarm violated at"] == np.inf
    assert "2 of 6 single faults are detected" in finding.sentence
    assert "of those that violate the spec 1 of 2 before they do" in finding.sentence
    told = str([vars(i) for section in study_report(result).sections for i in section.items])
    assert "detected by alarm after (s)" in told


@each_row(
    "detects, message",
    [
        ('{ alarm = "always z <= 1.3" }', "unknown signal 'z' of 'alarm'"),
        ('{ near = "always y <= 1.3" }', "another name for 'near' of detects: the spec has it"),
        ('{ alarm = "y is large" }', "y"),
    ],
)
def test_a_mistaken_detector_is_refused(tmp_path, detects, message):
    """By its name, before anything runs."""
    with pytest.raises(StudyError, match=message):
        read_study(written(tmp_path, STUDY + f"detects = {detects}\n"))


def test_each_row_is_replayed_to_the_bit(folder, finding):
    """By the number that the table prints."""
    number = int(effect(finding, "one.s bias", "lag.s gain").name)
    again = replay(folder, number, "faults")
    assert again.differences == ()
    assert again.signals["y"][-1] == pytest.approx(1.68 - 0.68 * np.exp(-5), abs=1e-5)


def test_the_page_has_both_figures_and_the_commands(folder):
    """Sorted by severity, with the row of each fault."""
    result = load_result(folder)
    items = list(study_report(result).sections)
    told = str([vars(item) for section in items for item in section.items])
    assert "faults-margins" in told
    assert "faults-pairs-1" in told
    assert f"--part {result.findings[0].key}" in told


def test_a_study_without_a_claim_tells_what_it_found(folder):
    """Its findings are the verdict."""
    result = load_result(folder)
    (finding,) = result.findings
    calm = replace(result, findings=(replace(finding, claim="", answer=""),))
    assert study_report(calm).verdict == finding.sentence


@each_row(
    "old, new, message",
    [
        ('"one.s" =', '"one.z" =', "unknown signal 'one.z'; nearest: 'one.s'"),
        ("bias = 0.4", "bios = 0.4", "bios"),
        ("bias = 0.4", 'bias = "much"', "number"),
        ("dropout = 0.1", "dropout = 0.0", "greater than 0|> 0"),
        ("onset = 5.0", "onset = 10.0", "onset < 10 s, the end, got 10"),
        ("onset = 5.0", "onset = -1.0", "onset"),
        ('"one.s dropout"', '"one.s dropuot"', "unknown fault 'one.s dropuot'; nearest: 'one.s d"),
        ('"lag.s" = { gain = 1.2, bias = 1.0 }', '"lag.s" = {}', "at least one kind of: stuck"),
    ],
)
def test_mistakes_are_told_before_anything_runs(tmp_path, old, new, message):
    """With their line."""
    with pytest.raises(StudyError, match=message):
        read_study(written(tmp_path, STUDY.replace(old, new)))


def test_an_analysis_without_faults_is_a_mistake(tmp_path):
    """It has nothing to try."""
    text = STUDY[: STUDY.index("[faults]")] + STUDY[STUDY.index("[spec]") :]
    with pytest.raises(StudyError, match=r"needs signals and kinds of faults under \[faults\]"):
        read_study(written(tmp_path, text))


TIMES = np.linspace(0, 10, 1001)


@each_row(
    "formula, wanted",
    [
        ("always |y| <= 0.5", np.pi / 6),
        ("always from 1 s on |y| <= 0.5", 1.0),
        ("always in [3, 8] s y >= -0.5", np.pi + np.pi / 6),
        ("always |y| <= 1.5", np.inf),
        ("eventually y >= 2", 10.0),
        ("eventually y >= 0.9", np.inf),
        ("(always y <= 0.9 and always y >= -0.5)", np.arcsin(0.9)),
    ],
)
def test_the_time_of_a_violation_of_a_sine(formula, wanted):
    """The first time at which sin t leaves its band; whole formulas count at their end."""
    asked = Requirement(key="k", formula=parse_formula(formula), until=10.0)
    found = violation_time(asked, TIMES, {"y": np.sin(TIMES)})
    assert found == pytest.approx(wanted, abs=1e-4)


def test_a_run_that_ended_is_violated_at_its_last_good_time():
    """Unless a requirement was violated before."""
    y = np.where(TIMES < 4.005, np.sin(TIMES), np.nan)
    for formula, wanted in (("always |y| <= 2", 4.0), ("always |y| <= 0.5", np.pi / 6)):
        asked = Requirement(key="k", formula=parse_formula(formula), until=10.0)
        assert violation_time(asked, TIMES, {"y": y}) == pytest.approx(wanted, abs=1e-4)


@pytest.mark.slow
def test_a_sliding_relay_and_a_delay_in_a_study(tmp_path):
    """x' = 1/2 - v with an ideal relay is at rest; with less than half of it, x = c (t - 5).

    The relay and the delay of what is shown are blocks that the study file names.
    """
    (tmp_path / "loop.py").write_text(SLIDING, encoding="utf-8")
    path = tmp_path / "study.toml"
    path.write_text(STUDY_OF_SLIDING, encoding="utf-8")
    (finding,) = run(read_study(path), tmp_path / "run").findings
    assert effect(finding, "")["held violated at"] == np.inf
    assert effect(finding, "relay.v bias")["held violated at"] == np.inf
    # x = 0.1 when it is delayed by 1/4: (1/2 - 0.3) (t - 5 - 1/4) = 0.1
    late = effect(finding, "relay.v gain")["held violated at"]
    assert late == pytest.approx(5 + 0.25 + 0.1 / (0.5 - 0.3), abs=1e-3)
    both = effect(finding, "relay.v bias", "relay.v gain")["held violated at"]  # 0.3 (v + 0.1)
    assert both == pytest.approx(5 + 0.25 + 0.1 / (0.5 - 0.33), abs=1e-3)


SLIDING = """
import control as ct
import nlctl


def loop(relay, line):
    plant = ct.nlsys(
        lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0], states=1, inputs=["v"],
        outputs=["u"], name="plant",
    )
    return nlctl.interconnect({"relay": relay, "plant": plant, "line": line}, outputs=["y"])
"""
STUDY_OF_SLIDING = """
loop = "loop.py:loop"

[study]
title = "A relay that fails"
seed = 4

[options]
relay = { block = "IdealRelay", height = 1.0 }
line = { block = "TransportDelay", delay = 0.25 }

[space]
"relay.height" = { uniform = [0.8, 1.2] }

[faults]
"relay.v" = { gain = 0.3, bias = 0.1 }

[spec]
held = "always |y| <= 0.1"

[time]
end = 10.0
step = 0.001

[[analysis]]
kind = "faults"
onset = 5.0
"""
