"""Machine code of the functions of samples, from bitcode that is shipped next to them."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numba import types
from numpy.typing import ArrayLike

from nlctl.host.checkout import file_of_nlctl
from nlctl.native.machine.export import AS_SHIPPED
from nlctl.native.machine.machine_code import Wanted
from nlctl.native.machine.shipped import Shipped

from . import extremes, integrals, travel
from .curves import path, turning_points

_ROW, _NUMBERS = types.float64[::1], types.int64[::1]
_EVERY = [getattr(home, name) for home in (extremes, integrals, travel) for name in home.__all__]
_NUMBER_OF = {f: inspect.unwrap(f) for f in _EVERY if "t" in inspect.signature(f).parameters}


def _wanted(function: Callable[..., Any], result: Any, breaks: Any = _ROW) -> Wanted:
    """Return a function of samples as it is compiled: with breaks, without, or without such."""
    names = inspect.signature(function).parameters
    kinds = {"t": _ROW, "y": _ROW, "breaks": breaks}
    return Wanted(
        function=function,
        signature=result(*(kinds.get(name, types.float64) for name in names)),
        options=AS_SHIPPED,
        name=_name(function, breaks is not types.none),
    )


def _name(function: Callable[..., Any], has_breaks: bool) -> str:
    return function.__name__ + "_with_breaks" * has_breaks


def _numbers() -> Iterator[Wanted]:
    for function in _NUMBER_OF.values():
        yield _wanted(function, types.float64, types.none)
        if "breaks" in inspect.signature(function).parameters:
            yield _wanted(function, types.float64)


SAMPLE_FUNCTIONS = Shipped(
    path=file_of_nlctl("analysis/metrics/samples.bitcode"),
    wanted=(
        *_numbers(),
        replace(_wanted(turning_points, types.Tuple((_NUMBERS, _ROW, _ROW))), name=""),
        replace(_wanted(path, types.UniTuple(_ROW, 2)), name=""),
    ),
)


def as_row(values: ArrayLike) -> np.ndarray:
    """Return values as machine code takes them."""
    return np.ascontiguousarray(values, dtype=float)


def in_machine_code(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a metric's function, or one with arguments by `partial`, as machine code.

    It keeps no thread of an ensemble waiting, and agrees with the original to rounding.  Other
    functions are returned as they are.

    Parameters
    ----------
    function : callable
        Takes (t, y).

    Returns
    -------
    callable
        Takes the same arguments.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import in_machine_code, integral
    >>> t = np.array([0.0, 0.5, 1.0])
    >>> round(in_machine_code(integral)(t, t**2), 12)
    0.333333333333
    """
    if isinstance(function, functools.partial):
        inner = in_machine_code(function.func)
        return functools.partial(inner, *function.args, **function.keywords)
    return _compiled(function) if any(function is one for one in _NUMBER_OF) else function


@functools.cache
def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return how machine code of a function is called with the function's arguments."""
    signature = inspect.signature(function)
    codes = [SAMPLE_FUNCTIONS.functions.get(_name(function, known)) for known in (False, True)]

    @functools.wraps(function)
    def called(*given: Any, **named: Any) -> Any:
        try:
            bound = signature.bind(*given, **named)
        except TypeError:
            return function(*given, **named)  # says what is wrong
        bound.apply_defaults()
        values = bound.arguments
        if np.shape(values["t"]) != np.shape(values["y"]) or np.size(values["t"]) < 2:
            return function(*given, **named)
        rows = [name for name in ("t", "y", "breaks") if values.get(name) is not None]
        values |= {name: as_row(values[name]) for name in rows}
        code: Any = codes["breaks" in rows]
        return code(*values.values())

    return called
