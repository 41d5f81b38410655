"""Equations: plain Python functions that machine code may call too."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, ParamSpec, TypeVar, cast

from numba.extending import register_jitable

from .errors import ParameterError
from .params import EQUATION

_P = ParamSpec("_P")
_R = TypeVar("_R")


# typed as what it is in a record, whose equations are static; elsewhere it is called alike
def equation(function: Callable[_P, _R]) -> staticmethod[_P, _R]:
    """Mark a function as an equation of a block.

    An equation is written once, in plain Python and NumPy, and read by everybody: python-control
    calls it unchanged, the native engine compiles it, interval proofs evaluate it on balls and
    the reader finds it in the paper.

    What an equation may contain is what all of these understand: arithmetic, comparisons, NumPy
    functions, tuples.  It is pure: the result depends on the arguments alone, which stay
    unchanged, and NaN in gives NaN out.

    Parameters
    ----------
    function : callable
        ``f(x, v)`` of a plant, or ``update(t, x, u, p)`` and ``output(t, x, u, p)`` of a block,
        see `nlctl.Spec`.

    Returns
    -------
    callable
        The function, unchanged; numba is informed that compiled code may call it.

    Raises
    ------
    ParameterError
        If it is not a function.

    Examples
    --------
    >>> @equation
    ... def pendulum(x, v):
    ...     return -9.81 * np.sin(x[0]) - 0.1 * x[1] + v
    """
    if not callable(function):
        raise ParameterError(f"equation needs a function, got {type(function).__name__}")
    if isinstance(function, FunctionType):
        setattr(function, EQUATION, True)
    return cast(Any, register_jitable(function))
