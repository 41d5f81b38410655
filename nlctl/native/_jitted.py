"""Blocks' functions that machine code calls as they stand."""

from __future__ import annotations

from types import FunctionType
from typing import Any

import numba
from numba.core.registry import CPUDispatcher

from .._errors import CompileError
from . import _numpy, _values
from .thirdparty import dicts
from .thirdparty.dicts import make_callable

TAUGHT = (dicts, _numpy, _values)  # modules that teach numba what functions of others use


def jitted(function: Any) -> Any:
    """Make a block's function callable from machine code; equations already are.

    Raises
    ------
    CompileError
        If it is no plain function.
    """
    if isinstance(function, CPUDispatcher):
        return function
    if not isinstance(function, FunctionType):
        raise CompileError(
            f"{function!r} is no plain function: give the block a function made with def"
        )
    make_callable(function)
    return numba.njit(function, error_model="numpy", nogil=True, boundscheck=True)
