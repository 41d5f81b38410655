"""How far a step of an integrator may be followed through functions that are flat elsewhere.

What `integrate.events.sharp` does for machine code's own steps, for those of the reference: from
values of the arguments at many places of a step, with parabolas through three of them in between.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ..expressions.sharp import AREA, ITSELF, LEADS, RANGE, SHORTER, UNEXAMINED, WAVE
from .compiled import Compiled
from .machine.evaluations import prepared_parameters
from .machine.routine import Routine


def followed(compiled: Compiled, p: np.ndarray) -> Callable[..., float] | None:
    """Return what says up to which part of a step sharp functions are followed, None for none."""
    # ``part(places, t, x, u)`` with the states and inputs at these parts of a step, columns
    code, c = prepared_parameters(compiled, p)
    kinds, rows = code.lowered.sharp, code.lowered.rows
    if not kinds:
        return None
    x_now, u_now, s = (np.empty((rows[name], 1)) for name in "xus")
    now, (function,) = np.empty(1), code.sharp
    given = now, x_now, u_now, c, s
    sharp = function.bound(*given) if isinstance(function, Routine) else partial(function, *given)

    def part(places: np.ndarray, t: np.ndarray, x: np.ndarray, u: np.ndarray) -> float:
        values = np.empty((len(kinds), t.size))
        for k in range(t.size):
            now[0], x_now[:, 0], u_now[:, 0] = t[k], x[:, k], u[:, k]
            sharp()
            values[:, k] = s[: len(kinds), 0]
        return min(_part(kind, places, row) for kind, row in zip(kinds, values, strict=True))

    return part


def _part(kind: int, places: np.ndarray, values: np.ndarray) -> float:
    """Return up to which part of a step an argument with these values may be followed."""
    near, far = np.min(np.abs(values)), np.max(np.abs(values))
    is_number = kind in (ITSELF, WAVE)
    calm = np.ptp(values) < UNEXAMINED if is_number else max(kind, 1) * (far - near) < 0.1 * near
    if calm and (is_number or abs(values.sum()) >= values.size * near):  # of one sign
        return 1.0
    least, most = np.minimum(values[1:], values[:-1]), np.maximum(values[1:], values[:-1])
    at, extreme = _vertices(places, values)
    for k in np.flatnonzero(np.isfinite(extreme)).tolist():  # on either side of the middle
        i = k if at[k] < 0.0 else k + 1
        least[i], most[i] = min(least[i], extreme[k]), max(most[i], extreme[k])
    lower, upper = _measured(kind, least, most)
    led = np.maximum.accumulate(upper) - np.minimum.accumulate(lower)
    too_far = np.flatnonzero(led > LEADS)
    if not too_far.size:
        return 1.0
    k = int(too_far[0])
    return float(max(places[k], SHORTER * places[k + 1]))


def _vertices(places: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where parabolas through three values turn, from the middle one, and their values."""
    # Not a number where that is not between the three.
    slopes = np.diff(values) / np.diff(places)
    bend = np.diff(slopes) / (places[2:] - places[:-2])
    slope = slopes[:-1] + bend * np.diff(places)[:-1]
    with np.errstate(all="ignore"):
        at = -0.5 * slope / bend
        extreme = values[1:-1] + 0.5 * slope * at
    within = (places[:-2] < places[1:-1] + at) & (places[1:-1] + at < places[2:])
    return at, np.where(within, extreme, np.nan)


def _measured(kind: int, least: Any, most: Any) -> tuple[Any, Any]:
    """Return between which measures a function is whose argument is between two numbers."""
    if kind == WAVE:
        return least, most
    if kind == ITSELF:
        lower, upper = least, most
    elif kind == AREA:
        lower, upper = 2.0 * np.arcsinh(least), 2.0 * np.arcsinh(most)
    else:
        nearest = np.maximum(np.maximum(least, -most), np.exp(-RANGE / kind))
        lower = kind * np.log(nearest)
        upper = kind * np.log(np.maximum(np.maximum(most, -least), nearest))
    return np.clip(lower, -RANGE, RANGE), np.clip(upper, -RANGE, RANGE)
