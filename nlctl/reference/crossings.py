"""Where something happens within a step, on the polynomial that an integrator has of it.

A step is looked at in 22 places, near its ends as well, and one of the short steps with which an
integrator begins again in 9; where functions do more than is seen there, `looks` has more places.
Between two of them a sign that has changed is located; where a function may be 0 in between, its
least value is looked for.  A memory is located where it reverses, and where it jumps.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from .looks import STEP_PLACES, LookPlaces, Looks, looks_at_step

_ULPS = 4.0
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
    look: Callable[..., np.ndarray],
    ends: tuple[float, float],
    before: np.ndarray,
    kinds: tuple[int, int],
    small: Callable[[np.ndarray], np.ndarray],
    places: LookPlaces = STEP_PLACES,
) -> Event | None:
    """Return the first event in a step; ``look(t, rounded)`` is that of `looks_at_step`.

    Shapes: `before` (n,).
    """
    begin, end = ends
    signed, first = sum(kinds), Event(np.inf, -1)
    t, seen = [begin], [before]
    sides = _sides(before[:signed], kinds[0])
    for looks in looks_at_step(look, ends, before, places, signed):
        t += looks.t[1:].tolist()
        seen += list(looks.values[1:])
        first, sides = _signed(look, looks, sides, kinds)
        if first.number >= 0:
            break
    memories = np.array(seen)[:, signed:]
    least = small(np.abs(memories).max(axis=0, initial=0.0))
    for i in range(before.size - signed):
        own = _memory(look, np.array(t), signed + i, memories[:, i], least[i], first.time)
        first = min(first, own)
    if not first.time <= end:
        return None
    apart = _TOGETHER * max(abs(begin), abs(end))
    return Event(min(first.time + apart, end), first.number, max(first.time - apart, begin))


def _signed(
    look: Callable[..., np.ndarray], looks: Looks, came: np.ndarray, kinds: tuple[int, int]
) -> tuple[Event, np.ndarray]:
    """Return the first change of a sign, and the sides of all functions at the end.

    Shapes: `came` (n,), the sides at the begin.
    """
    guards, first = kinds[0], Event(np.inf, -1)
    sides = _sides(looks.values[:, : came.size], guards)
    sides[0] = came
    for k in range(1, len(looks.t)):  # what is exactly 0 is still on its side
        sides[k] = np.where(sides[k] == 0.0, sides[k - 1], sides[k])
    for i, k, near in _suspects(looks, sides, guards):
        if looks.t[k] < first.time:
            crossing = _crossing(look, looks.t, (sides[k, i], i < guards), (i, k), near)
            first = min(first, crossing)
    return _consistent(look, looks.t, first, sides, guards), sides[-1]


def _consistent(
    look: Callable[..., np.ndarray], t: np.ndarray, event: Event, sides: np.ndarray, guards: int
) -> Event:
    """Return the first event, by what functions are at the event that was found.

    One that is on another side there has changed before: a hat narrower than the looks, on top of
    which something else happens.

    Shapes: `sides` (k, n), at the times t.
    """
    for _ in range(sides.shape[1] if event.number >= 0 else 0):
        k = max(int(np.searchsorted(t, event.time)) - 1, 0)
        here = _sides(look(event.time)[: sides.shape[1]], guards)
        changed = (sides[k] != 0.0) & (here != 0.0) & (here != sides[k])
        changed[:guards] &= sides[k, :guards] > 0.0
        changed[event.number] = False
        earlier = [
            _crossing(look, np.array([t[k], event.time]), (sides[k, i], i < guards), (i, 0), None)
            for i in np.flatnonzero(changed).tolist()
        ]
        before, event = event, min([event, *earlier])
        if event is before:
            break
    return event


def _sides(values: np.ndarray, guards: int) -> np.ndarray:
    """Return the sides of guards, which are at 0 or above or not, and of other functions."""
    sides = _side(values)
    sides[..., :guards] = np.where(values[..., :guards] >= 0.0, 1.0, -1.0)
    return sides


def _side(values: Any) -> Any:
    """Return the signs of numbers; NaN is on a side of its own."""
    sides = np.sign(values)
    return np.where(np.isnan(sides), _NEITHER, sides)


def _suspects(
    looks: Looks, sides: np.ndarray, guards: int
) -> list[tuple[int, int, tuple[float, float] | None]]:
    """Return functions that may leave their side, the places behind which they do, in order.

    And where the least value is to be sought of one that may come back.
    """
    leaves = (sides[:-1] != 0.0) & (sides[1:] != sides[:-1])
    leaves[:, :guards] &= sides[:-1, :guards] > 0.0  # a guard happens where it falls
    found: list[Any] = [(int(i), int(k), None) for k, i in np.argwhere(leaves)]
    is_near = looks.lowest(sides) <= looks.doubt
    is_near &= (sides[:-1] == sides[1:]) & (np.abs(sides[:-1]) == 1.0)
    is_near[:, :guards] &= sides[:-1, :guards] > 0.0
    for k, i in np.argwhere(is_near).tolist():
        found.append((i, k, looks.around(k, i, sides)))
    return sorted(found, key=lambda one: one[1])


def _crossing(
    look: Callable[..., np.ndarray],
    t: np.ndarray,
    side: tuple[float, bool],
    which: tuple[int, int],
    near: tuple[float, float] | None,
) -> Event:
    """Return where a function leaves its side behind a place, or dips near one."""
    (sign, is_guard), (i, k) = side, which

    def stays(value: float) -> bool:
        return (value >= 0.0) if is_guard else (_side(value) in (sign, 0.0))

    a, b = float(t[k]), float(t[k + 1])
    if near:
        b = _lowest(lambda s: sign * look(s)[i], *near)
        if stays(look(b)[i]):
            return Event(np.inf, -1)
        a = float(t[max(int(np.searchsorted(t, b)) - 1, 0)])
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
