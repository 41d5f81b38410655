"""The kept record of the paper's controller through every actuator is that of today's loops."""

import numpy as np
import pandas as pd
import pytest
from places import ROOT

from analysis.paper.limits.actuators import (
    ACTUATOR_RECORD,
    actuator_run,
    actuators_of_the_table,
    assumption,
    table_text,
)
from nlctl import paper

RECORD = pd.read_csv(ACTUATOR_RECORD)
PAGE = ROOT / "docs" / "explanation" / "actuators.md"


def test_it_has_every_actuator_in_both_examples():
    wanted = [(example, name) for example in paper.EXAMPLES for name in actuators_of_the_table()]
    assert list(zip(RECORD["example"], RECORD["actuator"], strict=True)) == wanted


@pytest.mark.parametrize("name", actuators_of_the_table())
def test_the_assumptions_are_those_of_today(name):
    """What the ledger says of the split (2) of each actuator."""
    kept = RECORD.loc[RECORD["actuator"] == name, "assumption"]
    assert set(kept) == {assumption(actuators_of_the_table()[name])}


@pytest.mark.parametrize("name", ["DeadZone", "Saturation", "DeadZoneInverse", "Relay"])
def test_lines_are_runs_of_today(name):
    """One that meets the spec, one beyond (2), one that chatters, one that diverges."""
    (kept,) = RECORD.query("example == 'example_1' and actuator == @name").to_dict("records")
    today = actuator_run("example_1", name)
    assert today["status"] == kept["status"]
    for column in ("time", "error", "peak"):
        assert np.isclose(today[column], kept[column], rtol=1e-3, equal_nan=True)


def test_a_run_that_does_not_reach_its_end_has_no_numbers():
    ended = RECORD["status"] == "OK"
    assert np.array_equal(np.isfinite(RECORD["error"]), ended)
    assert np.array_equal(np.isfinite(RECORD["peak"]), ended)


def test_the_page_has_the_table_of_the_record():
    assert table_text(RECORD) in PAGE.read_text(encoding="utf-8")
