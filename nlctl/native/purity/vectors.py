"""Turning what a block's function returns into something that can be indexed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload, register_jitable

MESSAGE = "a function returns another number of values than its block has states or outputs"


def as_vector(value: object, count: int) -> Any:
    """Return a function's result, an array, tuple, list or number, as `count` values."""
    return _counted(value if isinstance(value, tuple) else np.asarray(value).reshape(-1), count)


@register_jitable
def _counted(values, count):
    if len(values) != count:
        raise ValueError(MESSAGE)
    return values


@overload(as_vector)
def _as_vector_native(value, count):  # numba compares signatures: no annotations here
    if isinstance(value, types.BaseTuple):
        return lambda value, count: _counted(value, count)
    if isinstance(value, types.Array):
        if value.ndim == 1:  # no copy: it is only read
            return lambda value, count: _counted(value, count)
        return lambda value, count: _counted(value.copy().reshape(-1), count)
    if isinstance(value, types.List | types.ListType):
        return lambda value, count: _counted(np.array(value).reshape(-1), count)
    if isinstance(value, types.Number | types.Boolean):
        return lambda value, count: _counted((value,), count)
    return None
