"""Parameters that may lie between two integers.

Users write a gain as 2 and mean 2.0.  A function that is handed an integer may count with it, so
that what is read of it holds for integers alone.  Where something is to move by a little, such a
parameter is a float in the equations, which are read again.
"""

import contextlib
from collections.abc import Collection, Mapping
from typing import Any, TypeVar

import numpy as np

from ..errors import ParameterError
from ..names import base_name, element_name
from .diagram.nodes import Node
from .reading import Reading

_Read = TypeVar("_Read", bound=Reading)


def float_parameters(reading: Reading) -> dict[str, tuple[int, Node]]:
    """Return the parameters that can be differentiated by: place in `p`, and whose they are."""
    # Entries of arrays have their index in their names.
    found = {}
    for i, own in reading.program.layout.items():
        for slot in own.values():
            for k, index in enumerate(np.ndindex(slot.shape) if slot.kind == "f" else ()):
                name = element_name(slot.name, index)
                found[name] = slot.offset + k, reading.schedule.holders[i]
    return found


def with_floats(reading: _Read, names: Collection[str]) -> _Read:
    """Return a diagram in which parameters by these names, short ones too, are floats."""
    # the audit of a run compares the equations with functions that are handed the integers
    ends = tuple(f".{base_name(name)}" for name in names)
    return _changed(reading, [name for name in reading.integers if f".{name}".endswith(ends)])


def as_given(reading: _Read, params: Mapping[str, Any] | None) -> _Read:
    """Return a diagram that takes parameters as they are given, floats for integers too."""
    return with_floats(reading, [name for name, value in (params or {}).items() if _between(value)])


def _between(value: object) -> bool:
    """Whether a value, or one of many, lies between two integers."""
    array = np.asarray(value)
    return array.dtype.kind == "f" and not np.array_equal(array, np.trunc(array), equal_nan=True)


def with_every_float(reading: _Read) -> _Read:
    """Return a diagram in which all parameters are floats that can be."""
    steering = reading.equations.graph.assumptions
    names = [name for name, place in reading.integers.items() if place not in steering]
    with contextlib.suppress(ParameterError):
        return _changed(reading, names)
    for name in names:
        with contextlib.suppress(ParameterError):
            reading = _changed(reading, [name])
    return reading


def _changed(reading: _Read, names: Collection[str]) -> _Read:
    """Return a diagram in which some integers are floats, if its functions take that."""
    if not names:
        return reading
    changed = reading.with_floats(frozenset(names))
    calls = changed.equations.calls
    for call in calls.keys() - reading.equations.calls.keys():
        named = ", ".join(f"'{name}'" for name in names)
        raise ParameterError(
            f"{named} in '{reading.system.name}' cannot lie between two integers: "
            f"{calls[call].reason}"
        )
    return changed
