"""The comparison of the paper's controller with its rivals: what is tuned, and on what."""

import functools
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from places import ROOT
from rival_gains import search_bounds
from rival_runs import rival_rows, rivals_text
from tuning import evolved_gains

import nlctl
from nlctl.analysis.metrics import Metric, absolute_integral, peak
from nlctl.analysis.paper.page.closing import rivals_section
from nlctl.analysis.paper.rivals import (
    KNOWLEDGE,
    RIVAL_ACTUATORS,
    RIVAL_GAINS,
    RIVALS_RECORD,
    beaten_by,
    behind,
    checked_rivals,
    rival_actuators,
    rival_controllers,
    rival_loop,
    rivals_study,
)
from nlctl.analysis.report.document import Table
from nlctl.analysis.studies import read_study, run, shipped

EXAMPLES = sorted(nlctl.paper.EXAMPLES)


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_controller_has_gains_from_its_search_and_says_what_it_knows(example):
    """None is compared with gains from elsewhere."""
    labels = list(rival_controllers(example))
    assert labels == list(KNOWLEDGE)
    assert set(search_bounds(example)) == set(RIVAL_GAINS[example])
    for label, bounds in search_bounds(example).items():
        gains = RIVAL_GAINS[example][label]
        assert set(gains) == set(bounds)
        assert all(low <= gains[key] <= high for key, (low, high) in bounds.items())
    for label, row in _knowledge_of_the_page().items():
        assert KNOWLEDGE[label] == row


def _knowledge_of_the_page():
    """Return the table of the page by controller."""
    page = (ROOT / "docs/explanation/rivals.md").read_text(encoding="utf-8")
    part = page.partition("## What each has to know")[2].partition("## ")[0]
    rows = [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("|")]
    table = dict(rows[2:])
    assert set(table) == set(KNOWLEDGE)
    return table


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_gains_reach_the_loop(example):
    """The override that was searched is the parameter of the controller that is compared."""
    for label, gains in RIVAL_GAINS[example].items():
        known = nlctl.parameters(rival_loop(example, f"{label} / ideal"))["value"]
        for key, value in gains.items():
            base, _, index = key.partition("[")
            (own,) = [v for name, v in known.items() if name == base or name.endswith(f".{base}")]
            assert (own[int(index[:-1])] if index else own) == value


@pytest.mark.weekly
def test_each_actuator_has_the_same_controllers_on_the_same_samples():
    """The study files differ in the pairs alone."""
    for number, example in zip("12", EXAMPLES, strict=True):
        study = read_study(shipped(f"rivals-{number}")).study
        asked = [analysis.options for analysis in study.analysis]
        assert [options["actuator"] for options in asked] == list(rival_actuators(example))
        assert {options["example"] for options in asked} == {example}
        assert len({analysis.runs for analysis in study.analysis}) == 1
    assert behind("example_1", "backlash")["PID"] == "PID / backlash"


@pytest.mark.parametrize(
    ("pair", "told"),
    [("PDI / ideal", "PID"), ("PID / deadzone", "dead zone"), ("PID", "actuator")],
)
def test_an_unknown_pair_is_refused(pair, told):
    """With the nearest name."""
    with pytest.raises(nlctl.errors.UnknownNameError, match=told):
        rival_loop("example_1", pair)


@pytest.mark.weekly
def test_of_several_samples_the_mean_cost_and_the_worst_limit_count():
    """x' = u = -k x from x_0: IAE = |x_0| / k, max |u| = k |x_0|; so k = limit / max |x_0|."""

    @nlctl.equation
    def f(x, v):
        return v

    @nlctl.record
    class Proportional:
        """A proportional law.

        u = -k e,   e = x1 - yd
        """

        k: float = nlctl.param(1.0, unit="1", meaning="gain", above=0)
        inputs, outputs, states, feedthrough = ("x1", "yd"), ("e", "u"), (), True

        @staticmethod
        @nlctl.equation
        def output(t, x, u, p):
            return u[0] - u[1], -p.k * (u[0] - u[1])

    still = nlctl.SumOfSines(order=1, amplitudes=0.0, frequencies=1.0, phases=0.0)
    blocks = {"r": still, "plant": nlctl.PureFeedback(order=1, f=f), "p": Proportional()}
    loop = nlctl.interconnect(blocks | {"actuator": nlctl.Gain()}, outputs=["e", "u"])
    starts = np.array([0.5, -2.0, 1.0])
    found = evolved_gains(
        nlctl.compile(loop),
        {"p.k": (0.1, 100.0)},
        np.linspace(0, 10, 501),
        Metric(key="iae", signal="e", unit="s", meaning="", function=absolute_integral),
        limited=Metric(key="peak", signal="u", unit="1", meaning="", function=peak),
        limit=6.0,
        samples={"plant.x1(0)": starts, "actuator.k": np.ones(3)},
    )
    assert found.gains["p.k"] == pytest.approx(3.0, rel=1e-3)
    assert found.cost == pytest.approx(np.abs(starts).mean() / 3.0, rel=1e-3)
    assert found.limited <= 6.0
    assert found.runs % 3 == 0


PAGE = ROOT / "docs/explanation/rivals.md"


@functools.cache
def checked():
    """The record, found to be of today."""
    return checked_rivals()


@pytest.mark.weekly
@pytest.mark.parametrize("example", EXAMPLES)
def test_the_record_is_of_the_study(example):
    """All controllers behind all actuators on the samples that the file asks for; the page too."""
    record = checked()
    own = record[record["example"] == example]
    pairs = [(a, c) for a in rival_actuators(example) for c in rival_controllers(example)]
    assert list(zip(own["actuator"], own["controller"], strict=True)) == pairs
    assert list(RIVAL_ACTUATORS) == list(rival_actuators(example))
    assert set(own["samples"]) == {a.runs for a in read_study(rivals_study(example)).study.analysis}
    assert rivals_text(record, example) in PAGE.read_text(encoding="utf-8")


@pytest.mark.parted
@pytest.mark.parametrize(
    "column",
    ["study", *(pytest.param(one, marks=pytest.mark.ci) for one in ("parameters", "rates"))],
)
def test_a_record_of_another_study_or_loop_is_refused(tmp_path, column):
    """With the command that makes it again; of the last line, what it says of the loop is false."""
    record = pd.read_csv(RIVALS_RECORD)
    kind = "study" if column == "study" else "loop of 'funnel' behind 'saturation'"
    other = 1.0001 * record["rates"].iloc[-1] if column == "rates" else "another"
    record.loc[record.index[-1], column] = other
    record.to_csv(tmp_path / "record.csv", index=False)
    with pytest.raises(
        ValueError,
        match=rf"example_2' is of another {kind}.*python campaign/rival_runs\.py",
    ):
        checked_rivals(tmp_path / "record.csv")


@pytest.mark.weekly
@pytest.mark.parametrize("example", ["example_1", "example_2"])
def test_lines_of_the_record_are_runs_of_today(example, tmp_path):
    """Two controllers behind the actuator of their training, on all samples."""
    file = read_study(rivals_study(example))
    actuator = {"example_1": "dead-zone", "example_2": "backlash"}[example]
    (asked,) = [a for a in file.study.analysis if a.key == actuator]
    fewer = asked.model_copy(update={"only": ("paper", "funnel")})
    study = file.study.model_copy(update={"analysis": (fewer,)})
    today = rival_rows(run(replace(file, study=study), tmp_path / "run"), example)
    record = checked()
    columns = ["example", "actuator", "controller"]
    kept = today[columns].merge(record, on=columns, how="left")
    assert today["parameters"].tolist() == kept["parameters"].tolist()
    for column in today.columns.difference([*columns, "study", "parameters"]):
        np.testing.assert_allclose(today[column], kept[column], rtol=1e-3, atol=1e-9)


def test_who_beats_whom_is_a_matter_of_violations_and_an_interval():
    """Fewer violations do not excuse a larger error, nor a smaller error more violations."""
    lines = {
        "paper": (5, 0.0, 0.0),
        "better": (5, 0.1, 0.2),
        "less sure": (5, -0.1, 0.2),
        "violates more": (6, 0.1, 0.2),
        "worse": (5, -0.2, -0.1),
        "violates less": (4, -0.2, -0.1),
    }
    record = pd.DataFrame.from_dict(
        lines, orient="index", columns=["violations", "less_low", "less_high"]
    )
    record = record.rename_axis("controller").reset_index().assign(example="e", actuator="a")
    found = beaten_by(record, "e")
    assert found == {"a": {"beaten by": ("better",), "beats": ("worse",)}}


@pytest.mark.slow
def test_the_papers_page_says_who_beats_it():
    """Every line of the record, and what each controller has to know."""
    record = checked_rivals()
    section = rivals_section(record)
    winners, *lines, knowledge = [item for item in section.items if isinstance(item, Table)]
    assert sum(len(table.rows) for table in lines) == len(record)
    assert dict(knowledge.rows) == KNOWLEDGE
    found = beaten_by(record, "example_2")["backlash"]
    (row,) = [r for r in winners.rows if r[:2] == ("Example 2", "backlash")]
    assert "funnel" in found["beaten by"]
    assert row[2].replace("itself tuned", "paper, tuned") == ", ".join(found["beaten by"])
    assert row[3] == ", ".join(found["beats"])
    assert "super-twisting, funnel, and better than no single" in section.items[1].text
