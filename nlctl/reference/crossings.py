"""Where something happens within a step, on the polynomial that an integrator has of it.

A step is looked at in 18 places, near its ends as well; one of the short steps with which an
integrator begins again, in 7.  Between two of them a sign that has changed is located; where a
function comes close to 0 and goes away again, its least value is looked for.  A memory is located
where it reverses, and where it jumps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

STEP_PLACES = np.array([0.0, 1e-3, *(np.arange(1, 15) / 15.0), 1.0 - 1e-3, 1.0])
FEW_PLACES = np.array([0.0, 1e-3, 0.25, 0.5, 0.75, 1.0 - 1e-3, 1.0])
_CLOSE = 2.0  # a function that falls by half of its value from place to place may reach 0
_ULPS = 4.0
# each time four neighbours, as far apart as places of a step, and one between the middle two:
# not halfway, where a wave that the four do not see may be 0 as well
_BETWEEN = 0.38
CHECKED_PLACES = np.array([k + i for k in (0, 4, 8, 12) for i in (0, 1, 2, 3, 1 + _BETWEEN)]) / 15.0
FEW_CHECKED = np.array([k + i for k in (0, 1) for i in (0, 1, 2, 3, 1 + _BETWEEN)]) / 4.0
# the cubic through values at -1, 0, 1, 2 there
_CUBIC = np.array([
    -_BETWEEN * (_BETWEEN - 1) * (_BETWEEN - 2) / 6,
    (_BETWEEN + 1) * (_BETWEEN - 1) * (_BETWEEN - 2) / 2,
    -(_BETWEEN + 1) * _BETWEEN * (_BETWEEN - 2) / 2,
    (_BETWEEN + 1) * _BETWEEN * (_BETWEEN - 1) / 6,
])  # fmt: skip
_NEAR, _FOLLOWED = 20.0, 0.1  # of the range of a function in a step
_RESOLVED = 1e-9  # of a bracket: how closely an extreme value is located
_NEITHER = 2.0  # the side of a number that is NaN
_STEADY = 0.6  # a memory that changes by less than this part in half of the time does not jump


_TOGETHER = 1e-14  # of a time: what happens closer together happens at one instant


class Event(NamedTuple):
    """Where something happens: a time (s) right behind it, which function says so, and before it.

    So far behind that rounding does not set apart what happens at one instant.
    """

    time: float
    number: int
    before: float = np.nan


def first_event(
    look: Callable[[float], np.ndarray],
    ends: tuple[float, float],
    before: np.ndarray,
    kinds: tuple[int, int],
    small: Callable[[np.ndarray], np.ndarray],
    places: np.ndarray = STEP_PLACES,
) -> Event | None:
    """Return the first event in a step.

    Shapes: `before` (n,).
    """
    begin, end = ends
    t = begin + places * (end - begin)
    t[-1] = end
    seen = np.array([before, *(look(float(s)) for s in t[1:])])
    guards, signed = kinds[0], sum(kinds)
    sides = _side(seen[:, :signed])
    sides[:, :guards] = np.where(seen[:, :guards] >= 0.0, 1.0, -1.0)
    for k in range(1, len(t)):  # what is exactly 0 is still on its side
        sides[k] = np.where(sides[k] == 0.0, sides[k - 1], sides[k])
    first = Event(np.inf, -1)
    for i, k in _suspects(seen[:, :signed], sides, guards):
        if t[max(k - 1, 0)] < first.time:
            first = min(first, _crossing(look, t, sides[k, i], i, k, seen[:, i], i < guards))
    least = small(np.abs(seen[:, signed:]).max(axis=0, initial=0.0))
    for i in range(signed, before.size):
        first = min(first, _memory(look, t, i, seen[:, i], least[i - signed], first.time))
    if not first.time <= end:
        return None
    apart = _TOGETHER * max(abs(begin), abs(end))
    return Event(min(first.time + apart, end), first.number, max(first.time - apart, begin))


def is_followed(values: np.ndarray) -> bool:
    """Return whether looks at `CHECKED_PLACES` say what functions are at those in between.

    Shapes: `values` (5 k, n).
    """
    fives = values.reshape(-1, 5, values.shape[1])
    known, between = fives[:, :4], fives[:, 4]
    with np.errstate(invalid="ignore"):
        missed = np.abs(np.einsum("k,ikn->in", _CUBIC, known) - between)
        extent = np.ptp(values, axis=0)
        is_near = np.abs(values).min(axis=0) <= _NEAR * extent
    return not np.any(is_near & (missed > _FOLLOWED * extent))


def _side(values: Any) -> Any:
    """Return the signs of numbers; NaN is on a side of its own."""
    sides = np.sign(values)
    return np.where(np.isnan(sides), _NEITHER, sides)


def _suspects(seen: np.ndarray, sides: np.ndarray, guards: int) -> list[tuple[int, int]]:
    """Return functions that may leave their side, and the places behind which they do, in order."""
    leaves = (sides[:-1] != 0.0) & (sides[1:] != sides[:-1])
    w = sides * seen
    falls = np.full(w.shape, np.inf)  # how far it falls to a place, from either neighbour
    falls[1:] = w[:-1] - w[1:]
    later = np.full(w.shape, np.inf)
    later[:-1] = w[1:] - w[:-1]
    dips = (np.minimum(falls, later) >= 0.0) & (w > 0.0)
    dips[1:] &= sides[1:] == sides[:-1]
    steepest = np.maximum(np.where(np.isfinite(falls), falls, 0.0),
                          np.where(np.isfinite(later), later, 0.0))  # fmt: skip
    close = dips & (w < _CLOSE * steepest)
    close[:-1] |= leaves
    close[:, :guards] &= sides[:, :guards] > 0.0  # a guard happens where it falls
    return sorted(((int(i), int(k)) for k, i in np.argwhere(close)), key=lambda one: one[1])


def _crossing(look, t, side, i, k, values, is_guard) -> Event:
    """Return where a function leaves its side behind a place, or dips around it."""

    def stays(value: float) -> bool:
        return (value >= 0.0) if is_guard else (_side(value) in (side, 0.0))

    last = t.size - 1
    a, b = float(t[k]), float(t[min(k + 1, last)])
    if stays(values[min(k + 1, last)]):
        a = float(t[max(k - 1, 0)])
        b = _lowest(lambda s: side * look(s)[i], a, b)
        if stays(look(b)[i]):
            return Event(np.inf, -1)
    return Event(first_behind(lambda s: look(s)[i], stays, a, b), i)


def _lowest(value: Callable[[float], float], a: float, b: float) -> float:
    """Return where a function of one minimum has it."""
    close = {"xatol": _RESOLVED * (b - a)}
    found = minimize_scalar(lambda s: value(a + s), bounds=(0, b - a), method="bounded",
                            options=close)  # fmt: skip
    return a + float(found.x)


def first_behind(
    value: Callable[[float], float], stays: Callable[[float], bool], a: float, b: float
) -> float:
    """Return the first time behind a crossing between a, where it `stays`, and b, where not.

    To either side of a secant's root a look, so that the bracket shrinks from both ends; halves
    where that fails.
    """
    first, last, least = value(a), value(b), 1e-16 * (b - a)
    while b - a > max(_ULPS * np.spacing(max(abs(a), abs(b))), least):
        length = b - a
        slope = first - last
        root = a + length * (first / slope if slope != 0.0 and np.isfinite(slope) else 0.5)
        for s in (root - 0.01 * length, root + 0.01 * length, None):
            s = 0.5 * (a + b) if s is None else s
            if not a < s < b or (b - a < 0.3 * length):
                continue
            here = value(s)
            if stays(here):
                a, first = s, here
            else:
                b, last = s, here
    return b


def _memory(look, t, i, values, small, found) -> Event:
    """Return where a memory reverses, or jumps, if that is before what was found."""
    reversal = _reversal(values, small)
    if reversal and t[reversal[0] - 1] < found:
        k, way = reversal
        a, b = float(t[k - 1]), float(t[min(k + 1, t.size - 1)])
        at = _lowest(lambda s: -way * look(s)[i], a, b)
        if way * look(at)[i] < way * values[k]:
            at = float(t[k])
        return Event(at, i)
    changes = np.abs(np.diff(values))
    k = int(changes.argmax())
    if changes[k] > max(small, 0.5 * changes.sum()) and t[k] < found:
        return Event(_jump(lambda s: look(s)[i], float(t[k]), float(t[k + 1]), changes[k]), i)
    return Event(np.inf, -1)


def _reversal(values: np.ndarray, small: float) -> tuple[int, float] | None:
    """Return the place of the first extreme value of a memory that moves, and the way to it."""
    way, k = 0.0, 0
    for n in range(1, values.size):
        if way == 0.0:
            moved = values[n] - values[0]
            way, k = (np.sign(moved), n) if abs(moved) > small else (0.0, 0)
        elif way * (values[n] - values[k]) > 0.0:
            k = n
        elif way * (values[k] - values[n]) > small:
            return k, way
    return None


def _jump(value: Callable[[float], float], a: float, b: float, whole: float) -> float:
    """Return the first time behind a jump between a and b; inf if the function is continuous."""
    first, last = value(a), value(b)
    while b - a > _ULPS * np.spacing(max(abs(a), abs(b))):
        middle = 0.5 * (a + b)
        here = value(middle)
        if abs(here - first) >= abs(last - here):
            b, last = middle, here
        else:
            a, first = middle, here
        if not abs(last - first) >= _STEADY * whole:
            return np.inf
    return b
