"""What the parameters of a diagram hang on, to see at once that nothing has changed.

To resolve them is python-control's work, block by block.  A run whose diagram is unchanged since
the run before takes what was resolved then.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import BuiltinFunctionType, FunctionType, MethodType, NoneType
from typing import Any

import numpy as np

from ..names import Parameters
from ..upstream.control_internals import RESOLVED
from .third_party import Apart, own_attributes

_FIXED = {
    bool, int, float, complex, str, bytes, NoneType, np.bool_, np.int64, np.float64,
    FunctionType, BuiltinFunctionType, MethodType,
}  # fmt: skip
_KNOWN = ("control", __name__.partition(".")[0])
_READ_ONCE = {
    "syslist_index", "state_offset", "input_offset", "output_offset", "connect_map", "input_map",
    "output_map", "input_index", "output_index", "state_index", "spec", "inner", "sampling",
}  # fmt: skip


class _CanChange(Exception):  # noqa: N818
    """Something can change and stay the same object."""


def standing(copies: Apart, params: Mapping[str, Any] | None) -> list[Any] | None:
    """Return all that parameters hang on, in an order; None where some can change in place."""
    # They are what they were if each of it is the same object.
    try:
        things = list(_of_mapping(params or {}))
        for old, _ in copies.pairs.values():
            things += _of_system(old)
    except _CanChange:
        return None
    return things


def handed(copies: Apart) -> list[Any]:
    """Return what the equations of the copies have been handed as their parameters."""
    return [vars(new).get(name) for _, new in copies.pairs.values() for name in RESOLVED]


def _of_system(system: Any) -> Iterator[Any]:
    kind = getattr(type(system), "nlctl_base", type(system))
    if kind.__module__.partition(".")[0] not in _KNOWN:
        raise _CanChange  # as a class of others may say
    kept = own_attributes(system) - {"syslist"}
    for name, value in vars(system).items():
        if name in kept:
            continue
        yield value
        if type(value) in _FIXED or name in _READ_ONCE:
            continue
        if name == "syslist":
            yield from value
        elif isinstance(value, dict):
            yield from _of_mapping(value)
        else:
            raise _CanChange


def _of_mapping(values: Mapping[str, Any]) -> Iterator[Any]:
    yield len(values)
    for value in values.values():
        if not is_fixed(value):
            raise _CanChange
    yield from values
    yield from values.values()
    if isinstance(values, Parameters):
        yield from values.strays
        yield from values.owners.values()
        yield from (values.scope, values.table, len(values.clashes))


def is_fixed(value: Any) -> bool:
    """Whether a value cannot change in place."""
    return type(value) in _FIXED or (type(value) is tuple and all(map(is_fixed, value)))
