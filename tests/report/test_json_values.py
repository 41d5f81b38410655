"""Results as JSON: nothing is lost on the way there and back."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlctl.analysis.json_values import as_json, from_json

LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text("abc .", max_size=4)
VALUES = st.recursive(
    LEAVES,
    lambda inside: st.lists(inside, max_size=3) | st.dictionaries(st.text("xy"), inside),
    max_leaves=12,
)


@given(VALUES)
def test_what_is_written_is_what_is_read(value):
    """Also NaN and infinities, which JSON lacks."""
    text = json.dumps(as_json(value), allow_nan=False)
    np.testing.assert_equal(from_json(json.loads(text)), value)


@given(VALUES)
def test_the_other_way_knows_no_number_that_is_not_finite(value):
    """They become null; everything else is as before."""
    told, plain = as_json(value, null=True), as_json(value)

    def hold(a, b):
        if isinstance(b, dict):
            assert list(a) == list(b)
            a, b = list(a.values()), list(b.values())
        if isinstance(b, list):
            assert len(a) == len(b)
            for x, y in zip(a, b, strict=True):
                hold(x, y)
        else:
            assert a == b or (a is None and b in ("nan", "inf", "-inf"))

    hold(told, plain)


@pytest.mark.parametrize(
    ("value", "plain"),
    [
        (np.float64(0.5), 0.5),
        (np.longdouble(0.5), 0.5),
        (np.int8(3), 3),
        (np.bool_(True), True),
        (np.array([[1.0, np.nan], [np.inf, 2.0]]), [[1.0, "nan"], ["inf", 2.0]]),
        ((1, 2), [1, 2]),
        ({1: Path("a")}, {"1": "a"}),
    ],
)
def test_numpy_and_other_types_become_plain(value, plain):
    """With the same numbers; what has no counterpart becomes text."""
    assert as_json(value) == plain
    assert type(as_json(value)) is type(plain)
