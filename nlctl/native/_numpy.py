"""What equations of control engineers use and numba (0.68) does not know."""

from __future__ import annotations

import builtins
import operator

import numpy as np
from numba import types
from numba.extending import overload, register_jitable


@overload(np.clip)
def _clip_number(a, a_min, a_max):  # numba compares signatures: no annotations here
    numbers = (types.Number, types.Boolean)
    if not isinstance(a, numbers):
        return None
    if isinstance(a_min, types.NoneType):
        return lambda a, a_min, a_max: np.minimum(a, a_max)
    if isinstance(a_max, types.NoneType):
        return lambda a, a_min, a_max: np.maximum(a, a_min)
    if isinstance(a_min, numbers) and isinstance(a_max, numbers):
        return lambda a, a_min, a_max: np.minimum(np.maximum(a, a_min), a_max)
    return None


@overload(builtins.abs)
def _abs_array(a):
    return (lambda a: np.abs(a)) if isinstance(a, types.Array) else None


@overload(operator.matmul)
def _matmul_mixed(a, b):
    return (lambda a, b: _as_float(a) @ _as_float(b)) if _needs_floats(a, b) else None


@overload(np.dot)
def _dot_mixed(a, b):
    return (lambda a, b: np.dot(_as_float(a), _as_float(b))) if _needs_floats(a, b) else None


def _needs_floats(a, b):
    """Whether a product of matrices has whole numbers in it."""
    arrays = [v for v in (a, b) if isinstance(v, types.Array)]
    return len(arrays) == 2 and any(isinstance(v.dtype, types.Integer) for v in arrays)


@register_jitable
def _as_float(a):
    return a.astype(np.float64)


@overload(np.array)
def _array_of_array(a, dtype=None):
    return (lambda a, dtype=None: a.copy()) if isinstance(a, types.Array) and not dtype else None
