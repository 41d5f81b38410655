"""Records that machine code gets as one pointer hold there what they hold in Python."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numba.core import config

from nlctl.native.integrate.memory import (
    Places1,
    Places2,
    Reals1,
    Reals2,
    Reals3,
    arrays_of,
    grown,
    type_of,
    with_fields,
    with_table,
)


class Record(NamedTuple):
    line: Reals1
    grid: Reals2
    cube: Reals3
    places: Places1
    number: float
    count: int
    table: Places2


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


class Found(NamedTuple):
    line: Reals1
    grid: Reals2
    cube: Reals3
    places: Places1
    number: Reals1
    whole: Places1
    table: Places2


def run(function, *given):
    """Run a function of records and integers as machine code that is given their tables."""
    if getattr(config, "DISABLE_JIT", False):
        function(*given)
        return
    is_record = [isinstance(g, tuple) for g in given]
    kinds = [type_of(type(g)) if r else numba.intp for g, r in zip(given, is_record, strict=True)]
    if function not in COMPILED:  # once, not once an example
        COMPILED[function] = numba.cfunc(numba.void(*kinds))(function)
    call = ctypes.CFUNCTYPE(
        None, *[ctypes.c_void_p if record else ctypes.c_ssize_t for record in is_record]
    )(COMPILED[function].address)
    call(*(g.table.ctypes.data if isinstance(g, tuple) else g for g in given))


COMPILED = {}


def copied(record, found):
    for i in range(record.line.size):
        found.line[i] = record.line[i]
    found.grid[:] = record.grid
    found.cube[:], found.places[:] = record.cube, record.places
    found.number[0] = record.number
    found.whole[0], found.whole[1] = record.count, record.line.shape[0]
    for i in range(2):
        found.whole[2 + i] = record.grid.shape[i]
    for i in range(3):
        found.whole[4 + i] = record.cube.shape[i]


@pytest.mark.weekly
@pytest.mark.ci
@given(RECORDS)
def test_every_field_is_the_same_in_machine_code(record):
    """All bits of all numbers, and all shapes, empty arrays included."""
    arrays = [np.empty_like(a) for a in record[:4]]
    names = ("line", "grid", "cube", "places")
    found = with_table(
        Found, **dict(zip(names, arrays, strict=True)), number=np.zeros(1),
        whole=np.zeros(7, dtype=np.int64),
    )  # fmt: skip
    run(copied, record, found)
    for array, original in zip(arrays, record, strict=False):
        assert array.tobytes() == original.tobytes()
    assert found.number.tobytes() == np.float64(record.number).tobytes()
    shapes = [length for a in record[:3] for length in a.shape]
    assert found.whole.tolist() == [record.count, *shapes]


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
    run(through, record, 1, 10)
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


def outer(record, times):
    record.cube[0, 0, 0] = inner(record, times) + record.line[0]


def test_a_record_is_passed_on_between_functions():
    """sum of 2^-k for k = 1 .. n, twice, and the last of them."""
    record = sample()
    run(outer, record, 10)
    assert record.cube[0, 0, 0] == 2 * (1 - 2.0**-10) + 2.0**-10


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("line", np.ones(2, dtype=np.float32), "1 dimensions of float64, got 1 of float32"),
        ("grid", np.ones(2), "2 dimensions of float64, got 1 of float64"),
        ("number", 1, "0 dimensions of float64, got 0 of int64"),
        ("count", 1.0, "0 dimensions of int64, got 0 of float64"),
    ],
)
def test_a_field_of_another_type_is_refused(field, value, message):
    """What is compiled for one type is not run on another."""
    with pytest.raises(TypeError, match=f"'{field}' of Record needs {message}"):
        with_fields(sample(), **{field: value})


@pytest.mark.parametrize("array", [np.ones(4)[::2], np.ones((2, 3)).T])
def test_an_array_with_gaps_or_in_another_order_is_refused(array):
    name = "line" if array.ndim == 1 else "grid"
    with pytest.raises(ValueError, match=f"'{name}' of Record needs a C-contiguous array"):
        with_fields(sample(), **{name: array})


class Outer(NamedTuple):
    number: float
    inner: Record
    last: Reals1
    table: Places2


def scaled_inside(outer):
    inside = outer.inner
    for i in range(inside.line.size):
        inside.line[i] *= outer.number * inside.number
    outer.last[0] = outer.inner.line[inside.line.size - 1]


def test_a_record_in_a_record_is_the_same_memory():
    """Machine code reads and writes what is inside as Python does."""
    outer = with_table(Outer, number=3.0, inner=sample(), last=np.zeros(1))
    run(scaled_inside, outer)
    assert outer.inner.line.tolist() == [1.5, 1.5]
    assert outer.last.tolist() == [1.5]
    assert type_of(Outer).fields["inner"] == type_of(Record)


def test_another_record_inside_is_refused():
    other = with_table(Outer, number=3.0, inner=sample(), last=np.zeros(1))
    with pytest.raises(TypeError, match="'inner' of Outer needs"):
        with_fields(other, inner=other)


def test_a_record_with_more_room_holds_what_it_held():
    """`grown` adds rows that are 0; the other fields are the same arrays."""
    before = sample()
    after = grown(before, ("grid", "cube"), 5)
    assert after.grid.tolist() == [*before.grid.tolist(), *[[0.0] * 3] * 3]
    assert after.cube.shape == (5, 3, 2)
    assert after.line is before.line


def test_zeros_have_the_types_that_fields_are_annotated_with():
    made = arrays_of(
        Found, line=(2,), grid=(1, 2), cube=(1, 1, 1), places=(3,), number=(1,), whole=(1,)
    )
    assert [a.dtype.kind for a in made[:-1]] == ["f", "f", "f", "i", "f", "i"]
    assert not any(a.any() for a in made[:-1])
