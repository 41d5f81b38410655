"""The kept record of controllers through every actuator is that of today's loops."""

import numpy as np
import pandas as pd
import pytest
from actuator_limits import (
    ACTUATOR_RECORD,
    actuator_errors,
    actuator_run,
    actuators_of_the_table,
    assumption,
    controllers_text,
)
from matplotlib.collections import PathCollection
from places import ROOT

from nlctl import paper
from nlctl.actuators import Gain, Lag
from nlctl.analysis.paper.rivals import rival_controllers
from nlctl.analysis.paper.sampling_limits import BAND, meets_the_spec

RECORD = pd.read_csv(ACTUATOR_RECORD)
PAGE = ROOT / "docs" / "explanation" / "actuators.md"


def recorded(name):
    """Skip a test of an actuator that has not been run, with the command that does it."""
    if name not in set(RECORD["actuator"]):
        pytest.skip(
            f"'{name}' has no runs yet: python campaign/actuator_limits.py docs/explanation"
        )


@pytest.mark.parametrize("name", actuators_of_the_table())
def test_an_actuator_is_behind_every_controller_in_both_examples(name):
    recorded(name)
    wanted = [
        (example, label) for example in paper.EXAMPLES for label in rival_controllers(example)
    ]
    own = RECORD[RECORD["actuator"] == name]
    assert list(own[["example", "controller"]].itertuples(index=False)) == wanted


def test_it_has_no_actuator_that_is_gone():
    assert set(RECORD["actuator"]) <= set(actuators_of_the_table())


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("paper", "DeadZone"),
        ("paper", "Saturation"),
        ("paper", "DeadZoneInverse"),
        ("paper", "Relay"),
        ("funnel", "Backlash"),
        ("dynamic surface", "Lag"),
    ],
)
def test_lines_are_runs_of_today(label, name):
    """One that meets the spec, one beyond (2), that chatters, that diverges; two of rivals."""
    own = "example == 'example_1' and controller == @label and actuator == @name"
    (kept,) = RECORD.query(own).to_dict("records")
    today = actuator_run("example_1", name, label)
    assert today["status"] == kept["status"]
    for column in ("time", "error", "peak"):
        assert np.isclose(today[column], kept[column], rtol=1e-3, equal_nan=True)


def test_bounds_and_reasons_are_formulas():
    """v = k u: the split is k itself."""
    told = r"$2 \times 10^{-5} \leq k \leq 2 \times 10^{-5}$, $\lvert \varepsilon_u \rvert \leq 0$"
    assert assumption(Gain(k=2e-5)).startswith(told)
    assert r"$v = k(u, t)\, u + \varepsilon_u$" in assumption(Lag())


def test_a_run_that_does_not_reach_its_end_has_no_numbers():
    ended = RECORD["status"] == "OK"
    assert np.array_equal(np.isfinite(RECORD["error"]), ended)
    assert np.array_equal(np.isfinite(RECORD["peak"]), ended)


@pytest.mark.parametrize("example", paper.EXAMPLES)
def test_the_page_has_the_tables_of_the_record(example):
    assert controllers_text(RECORD, example) in PAGE.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", actuators_of_the_table())
def test_the_page_says_what_is_known_of_each_split(name):
    """Of (2), found today."""
    recorded(name)
    row = f"| {name} | {assumption(actuators_of_the_table()[name])} |"
    assert row in PAGE.read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("example", paper.EXAMPLES)
def test_the_figure_has_a_mark_for_every_run(example):
    """Hollow where the spec is violated; those that did not reach 20 s stand apart."""
    own = RECORD[RECORD["example"] == example]
    (ax,) = actuator_errors(own, meets_the_spec, BAND).axes
    marks = [c for c in ax.collections if isinstance(c, PathCollection) and c.get_offsets().size]
    assert sum(len(c.get_offsets()) for c in marks) == len(own)
    faces = np.concatenate([c.get_facecolors() for c in marks])
    assert (faces[:, 3] > 0).sum() == meets_the_spec(own).sum()
    apart = sum((np.asarray(c.get_offsets())[:, 0] > 20).sum() for c in marks)
    assert apart == (own["status"] != "OK").sum()
