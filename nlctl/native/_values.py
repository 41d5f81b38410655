"""Turning what a block's function returns into something that can be indexed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload


def as_vector(value: Any) -> Any:
    """Return a function's result, an array, tuple, list or number, as a 1-D sequence."""
    return value if isinstance(value, tuple) else np.asarray(value).reshape(-1)


@overload(as_vector)
def _as_vector_native(value):  # numba compares signatures: no annotations here
    if isinstance(value, types.BaseTuple):
        return lambda value: value
    if isinstance(value, types.Array):
        if value.ndim == 1:  # no copy: it is only read
            return lambda value: value
        return lambda value: value.copy().reshape(-1)
    if isinstance(value, types.List | types.ListType):
        return lambda value: np.array(value).reshape(-1)
    if isinstance(value, types.Number | types.Boolean):
        return lambda value: (value,)
    return None
