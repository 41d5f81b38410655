"""The kept record on sampling: what it says, whether it is of these loops, its section."""

import numpy as np
import pandas as pd
import pytest

from nlctl import paper
from nlctl.analysis.paper.controllers import compared_controllers
from nlctl.analysis.paper.page.closing import sampling_section
from nlctl.analysis.paper.sampling_limits import (
    QUANTITIES,
    SAMPLING_RECORD,
    check_lines,
    checked_record,
    sampling_runs,
    spec_ends,
    where_it_ends,
)


def table(errors, peaks=0.0):
    return pd.DataFrame({"value": np.arange(1.0, len(errors) + 1), "error": errors, "peak": peaks})


@pytest.mark.parametrize(
    ("errors", "peaks", "expected"),
    [
        ([0.1, 0.15, 0.2], 0.0, (2.0, 3.0)),
        ([0.1, np.nan, 0.1], 0.0, (1.0, 2.0)),  # what diverges violates; what follows is not excuse
        ([0.1, 0.1, 0.1], 15.0, (3.0, np.nan)),
        ([0.1, 0.1], 15.1, (np.nan, 1.0)),
    ],
)
def test_the_spec_ends_at_its_first_violation(errors, peaks, expected):
    """In whatever order the runs are."""
    shuffled = table(errors, peaks).sample(frac=1.0, random_state=1)
    np.testing.assert_array_equal(where_it_ends(shuffled), expected)


def test_the_record_has_all_controllers_and_quantities():
    record = pd.read_csv(SAMPLING_RECORD)
    found = spec_ends(record)
    wanted = [(e, label) for e in paper.EXAMPLES for label in compared_controllers(e)]
    assert list(found.index) == wanted
    for quantity in QUANTITIES:
        values = record[record["quantity"] == quantity.key]["value"]
        assert values.min() == pytest.approx(quantity.low)
        assert values.max() == pytest.approx(quantity.high)


def test_a_record_of_other_equations_is_refused(tmp_path):
    """The run of today tells, and the command that makes the record again is named."""
    record = pd.read_csv(SAMPLING_RECORD)
    record["error"] *= 1.01
    record.to_csv(tmp_path / "record.csv", index=False)
    with pytest.raises(ValueError, match=r"example_1.*python campaign/sampling_runs\.py"):
        checked_record(tmp_path / "record.csv")


@pytest.mark.slow
def test_the_section_says_what_the_record_says():
    record = checked_record()
    section = sampling_section(record)
    row = spec_ends(record).loc[("example_1", "paper")]
    assert f"sampling time of {1e3 * row[('dt', 'good')]:.3g} ms" in section.items[0].text
    *_, shown, _ = section.items
    assert len(shown.rows) == sum(len(compared_controllers(example)) for example in paper.EXAMPLES)


@pytest.mark.weekly
@pytest.mark.parametrize("example", ["example_1", "example_2"])
def test_every_controllers_line_is_one_of_today(example):
    """Where its run ends well, at the least value of each quantity."""
    record = pd.read_csv(SAMPLING_RECORD)
    for label in compared_controllers(example):
        own = record[(record["example"] == example) & (record["controller"] == label)]
        kept = own.groupby("quantity", sort=False).head(1)
        wanted = dict(zip(kept["quantity"], kept[["value"]].to_numpy(), strict=True))
        check_lines(kept, sampling_runs(example, label, wanted))
