"""Whether a step's polynomial solves the equations.

It has been made of right-hand sides behind an event as well, and by a multistep method of none
within.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

_GAUSS = np.polynomial.legendre.leggauss(5)
_SOLVES = 10.0  # tolerances by which a step solves


def solves(
    rates: Callable[[float, np.ndarray], np.ndarray],
    begin: tuple[float, np.ndarray],  # a time (s), and the state there
    end: tuple[float, Callable[[float], np.ndarray]],  # a time, and the polynomial until then
    moves: np.ndarray,  # (nstates,): whether a state is one of those that are integrated
    tolerances: tuple[Any, Any],  # rtol, atol
) -> bool:
    """Whether a polynomial differs from the integral of its rates by a few tolerances at most."""
    (t, x), (until, state), (rtol, atol) = begin, end, tolerances
    length = until - t
    times = t + 0.5 * length * (1.0 + _GAUSS[0])
    slopes = [rates(s, state(s)) for s in times.tolist()]
    left = np.where(moves, state(until) - x - 0.5 * length * (_GAUSS[1] @ slopes), 0.0)
    allowed = atol + rtol * np.abs(state(until))
    if not np.any(np.abs(left) > _SOLVES * allowed):
        return True
    # what rates do where the state moves by the tolerance says nothing
    k = len(slopes) // 2
    noise = np.abs(rates(times[k], state(times[k]) + allowed) - slopes[k])
    return not np.any(np.abs(left) > _SOLVES * (allowed + length * noise))
