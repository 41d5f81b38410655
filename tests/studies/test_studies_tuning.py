"""Tuning and the tornado in studies, on a lag that is known in closed form."""

import numpy as np
import pytest
from command_line import nlctl_here
from rows import each_row
from studies_example import write

from nlctl.analysis.pages.study.report import study_report
from nlctl.analysis.robustness import violation_probability
from nlctl.analysis.robustness.uncertainty.design import independent
from nlctl.analysis.studies import StudyError, load_result, plan, read_study, replay, run

HEAD = """
loop = "loop.py:loop"

[study]
title = "A lag, tuned"
seed = 5

[space]
"lag.x(0)" = { uniform = [0.8, 1.2] }

[spec]
decays = "always from 1 s on y <= 0.5"
visible = "always z >= 0.1"

[time]
end = 2.0
step = 0.02

[metrics]
error = "y"
control = "z"
band = 0.1
actuated = ""
weights = ""
gain = ""
"""
TUNED = """
[[analysis]]
kind = "tuning"
gains = { "lag.rate" = [0.1, 4.0] }
budget = 100
samples = 3
runs = 60
limit = 0.1
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("tuning")


@pytest.fixture(scope="module")
def result(folder):
    return run(read_study(write(folder, HEAD, TUNED)), folder / "run", threads=1)


def margins(rate, x0):
    """1 - 2 x(1) and 20 x(2) - 1 of x = x(0) exp(-rate t): the smaller one."""
    return np.minimum(1 - 2 * x0 * np.exp(-rate), 20 * x0 * np.exp(-2 * rate) - 1)


@pytest.mark.weekly
def test_largest_least_margin(result):
    """Over three draws: that of the grid of all rates, in closed form, to 2e-3."""
    found = result["tuning"]
    rate = found.numbers["gains"]["lag.rate"]
    other = int(np.random.SeedSequence(5, spawn_key=(1,)).generate_state(1)[0])
    x0 = independent(read_study(result.folder / "study.toml", folder=result.folder.parent)
                     .experiment.space, 3, other).table["lag.x(0)"].to_numpy()  # fmt: skip
    grid = np.linspace(0.1, 4.0, 100_001)[:, None]
    best = margins(grid, x0).min(axis=1).max()
    assert abs(found.numbers["after"] - best) < 2e-3 * (1 + abs(best))
    assert abs(margins(rate, x0).min() - found.numbers["after"]) < 1e-4
    assert abs(margins(1.0, x0).min() - found.numbers["before"]) < 1e-4


def test_fresh_rows(result):
    """Margins of each fresh row in closed form, bounds as of every study; no draw is a sample."""
    found = result["tuning"]
    space = read_study(result.folder / "study.toml", folder=result.folder.parent).experiment.space
    design = independent(space, 60, 5)
    x0, fresh = design.table["lag.x(0)"].to_numpy(), found.tables["fresh"]
    assert np.allclose(fresh["before"], margins(1.0, x0), atol=1e-4)
    assert np.allclose(fresh["after"], margins(found.numbers["gains"]["lag.rate"], x0), atol=1e-4)
    statement = violation_probability(design, fresh["after"].to_numpy(), 0.99)
    assert found.numbers["fresh_after"]["upper"] == statement.upper
    assert str(statement) in found.sentence
    assert found.answer == ("shown" if statement.upper <= 0.1 else "not shown yet")
    assert "proved" not in found.sentence


def test_rows_can_be_run_again(result):
    """A row of either half, bit for bit, with the gains of that half."""
    again = [replay(result.folder, row, part="tuning") for row in (0, 60)]
    assert all(each.differences == () for each in again)
    rates = [each.stored["lag.rate"] for each in again]
    assert rates == [1.0, result["tuning"].numbers["gains"]["lag.rate"]]


def test_the_page(result):
    """Before and after, what was bought, and what was tried; the same from a loaded run."""
    for each in (result, load_result(result.folder)):
        made = study_report(each)
        (section,) = (s for s in made.sections if s.key == "tuning")
        keys = [item.key for item in section.items if hasattr(item, "key")]
        assert keys == [f"tuning-{k}" for k in ("signals", "bought", "fresh", "tried")]
        assert "at most" in made.claims[0].measured


def test_a_resumed_run_is_the_same(result, folder):
    """All of it again in another folder, to the last bit."""
    file = read_study(write(folder, HEAD, TUNED))
    again = run(file, folder / "again", threads=2)
    assert again["tuning"].plain() == result["tuning"].plain()
    for name, table in result["tuning"].tables.items():
        assert table.equals(again["tuning"].tables[name]), name


def test_planned_runs(folder):
    """No more than are planned."""
    file = read_study(write(folder, HEAD, TUNED))
    assert plan(file, threads=1).runs["tuning"] >= 120


def test_lowered_metric(folder):
    """The IAE of y is the lower, the faster it decays: as far as z >= 0.1 lets it."""
    text = TUNED.replace("limit = 0.1", 'lower = "iae"').replace("samples = 3", "samples = 0")
    found = run(read_study(write(folder, HEAD, text)), folder / "lowered", threads=1)["tuning"]
    rate = found.numbers["gains"]["lag.rate"]
    assert abs(20 * np.exp(-2 * rate) - 1) < 5e-3
    assert found.numbers["after"] < found.numbers["before"]
    assert "mean iae" in found.sentence


@each_row(
    ("before", "after", "words"),
    [
        ('"lag.rate" = [0.1, 4.0]', '"lag.x(0)" = [0.1, 4.0]', "is tuned: leave it out"),
        ('"lag.rate" = [0.1, 4.0]', '"lag.raet" = [0.1, 4.0]', "nearest: 'lag.rate'"),
        ("[0.1, 4.0]", "[2.0, 4.0]", "nominal value in its box [2, 4], got 1"),
        ("[0.1, 4.0]", "[4.0, 2.0]", "low < high"),
        ("limit = 0.1", 'lower = "iaee"', "nearest: 'iae'"),
        ('{ "lag.rate" = [0.1, 4.0] }', "{}", "at least 1 item"),
    ],
)
def test_mistakes(before, after, words, tmp_path):
    """Before anything runs, with the next step."""
    with pytest.raises(StudyError) as told:
        read_study(write(tmp_path, HEAD, TUNED.replace(before, after)))
    assert words in str(told.value)


TORNADO = """
[[analysis]]
kind = "tornado"
of = "decays"
"""


def test_tornado(folder):
    """1 - 2 x(0) exp(-rate) by both, times the distance to either end; x(0) acts linearly."""
    head = HEAD.replace("[spec]", '"lag.rate" = { bounds = [0.5, 2.0] }\n[spec]')
    found = run(read_study(write(folder, head, TORNADO)), folder / "tornado")["tornado"]
    table = found.tables["effects"]
    by_rate, by_start = 2 * np.exp(-1), -2 * np.exp(-1)
    assert abs(found.numbers["value"] - (1 - 2 * np.exp(-1))) < 1e-5
    assert np.allclose(table.loc["lag.rate", ["low", "high"]], [-0.5 * by_rate, by_rate], rtol=1e-3)
    ends = [-0.2 * by_start, 0.2 * by_start]
    assert np.allclose(table.loc["lag.x(0)", ["low", "high"]], ends, rtol=1e-3)
    assert np.allclose(table.loc["lag.x(0)", ["run_low", "run_high"]], ends, rtol=1e-3)
    runs = [margin - (1 - 2 * np.exp(-1)) for margin in 1 - 2 * np.exp([-0.5, -2.0])]
    assert np.allclose(table.loc["lag.rate", ["run_low", "run_high"]], runs, rtol=1e-3)
    assert found.sentence.index("lag.rate") < found.sentence.index("lag.x(0)")


@pytest.mark.slow
def test_the_command(tmp_path):
    """It prints the gains and the page; a study that tunes nothing is refused with what to add."""
    path = write(tmp_path, HEAD, TUNED)
    told = nlctl_here("tune", path.name, cwd=tmp_path)
    assert told.returncode in (0, 5), told.stderr
    assert "lag.rate = " in told.stdout
    assert (tmp_path / "reports" / "study" / "index.html").is_file()
    path = write(tmp_path, HEAD, TORNADO, name="other.toml")
    refused = nlctl_here("tune", path.name, cwd=tmp_path)
    assert refused.returncode == 2
    assert 'kind = "tuning"' in refused.stderr
