"""Records that machine code gets as one pointer hold there what they hold in Python."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numba.core import config

from nlctl.native._pointed import pointed, with_table


@pointed
class Record(NamedTuple):
    line: np.ndarray
    grid: np.ndarray
    cube: np.ndarray
    places: np.ndarray
    number: float
    count: int
    table: np.ndarray


FLOATS = st.floats(width=64)  # NaN, infinities, -0.0 and subnormal numbers as well


def floats(dims):
    shapes = array_shapes(min_dims=dims, max_dims=dims, min_side=0, max_side=4)
    return arrays(np.float64, shapes, elements=FLOATS)


RECORDS = st.builds(
    lambda **values: with_table(Record, **values),
    line=floats(1),
    grid=floats(2),
    cube=floats(3),
    places=arrays(np.int64, st.integers(0, 4), elements=st.integers(-(2**63), 2**63 - 1)),
    number=FLOATS,
    count=st.integers(-(2**63), 2**63 - 1),
)


@numba.njit
def copied(record, line, grid, cube, places):
    line[:], grid[:], cube[:], places[:] = record.line, record.grid, record.cube, record.places
    return record.number, record.count, record.line.shape, record.grid.shape, record.cube.shape


@pytest.mark.slow
@given(RECORDS)
def test_every_field_is_the_same_in_machine_code(record):
    """All bits of all numbers, and all shapes, empty arrays included."""
    found = [np.empty_like(a) for a in record[:4]]
    number, count, *shapes = copied(record, *found)
    for array, original in zip(found, record, strict=False):
        assert array.tobytes() == original.tobytes()
    assert np.float64(number).tobytes() == np.float64(record.number).tobytes()
    assert count == record.count
    assert shapes == [a.shape for a in record[:3]]


@numba.njit
def through(record, i, value):
    slab = record.cube[i]  # a view of a view
    for j in range(slab.shape[0]):
        slab[j, 0] = value + record.grid[-1, j]
    record.line[0] += record.number


def sample():
    return with_table(
        Record,
        line=np.ones(2),
        grid=np.arange(6.0).reshape(2, 3),
        cube=np.zeros((2, 3, 2)),
        places=np.zeros(1, dtype=np.int64),
        number=0.5,
        count=1,
    )


def test_what_machine_code_writes_is_seen_in_python():
    record = sample()
    through(record, 1, 10.0)
    assert record.cube[1, :, 0].tolist() == [13.0, 14.0, 15.0]
    assert not record.cube[0].any()
    assert not record.cube[1, :, 1].any()
    assert record.line.tolist() == [1.5, 1.0]


@numba.njit
def inner(record, times):
    total = 0.0
    for _ in range(times):
        for i in range(record.line.size):
            record.line[i] *= 0.5  # stores between the reads of the table
            total += record.line[i]
    return total


@numba.njit
def outer(record, times):
    return inner(record, times) + record.line[0]


def test_a_record_is_passed_on_between_functions():
    """sum of 2^-k for k = 1 .. n, twice, and the last of them."""
    assert outer(sample(), 10) == 2 * (1 - 2.0**-10) + 2.0**-10


@pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="plain Python has no types to refuse"
)
def test_an_array_of_another_type_is_refused():
    """What is compiled for one type is not run on another."""
    compiled = numba.njit(numba.float64(numba.typeof(sample()), numba.int64))(inner.py_func)
    assert compiled(sample(), 1) == 1.0
    with pytest.raises(TypeError, match="No matching definition"):
        compiled(changed(line=np.ones(2, dtype=np.float32)), 1)


@pytest.mark.parametrize("array", [np.ones(4)[::2], np.ones((2, 3)).T])
def test_an_array_with_gaps_or_in_another_order_is_refused(array):
    name = "line" if array.ndim == 1 else "grid"
    with pytest.raises(ValueError, match=f"'{name}' of Record needs a C-contiguous array"):
        changed(**{name: array})


def changed(**values):
    kept = sample()._asdict() | values
    kept.pop("table")
    return with_table(Record, **kept)
