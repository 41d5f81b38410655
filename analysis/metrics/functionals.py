"""The functions of (t, y) that nlctl has, as machine code."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

from nlctl.native.machine.machine_code import kept

from . import extremes, integrals, travel

OWN = [getattr(home, name) for home in (extremes, integrals, travel) for name in home.__all__]


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
        return functools.partial(
            in_machine_code(function.func), *function.args, **function.keywords
        )
    return _compiled(function) if any(function is metric for metric in OWN) else function


@functools.cache
def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    return kept(nogil=True, error_model="numpy")(inspect.unwrap(function))
