"""What a step may have passed over: corners crossed and crossed back, turns of memories.

Error control sees the states only.  Where a switching function, or what drives a memory, is no
state (a dead zone behind a source), a step may grow until both of its ends lie on one side of a
corner although it has been on the other in between.  Shallow excursions may still be missed.
Steps of other explicit pairs and of the stiff method are not looked into.
"""

from __future__ import annotations

import numba

from .methods.tsit5 import TSIT5
from .state import INNER

_INSIDE = tuple(map(float, TSIT5.c[1:4]))  # parts of a step at which switching functions are kept
_FIRST, _SECOND, _THIRD = _INSIDE
_GRID = 32
_NEAR = 0.01  # of the range: a minimum so close to 0 is looked at in a shorter step
_DIP = 1e-4  # of the range: a minimum no deeper below the ends is one of them
SHORTER = 0.3  # part of a step to be tried where its switching functions cannot be foreseen


@numba.njit(**INNER)
def unforeseen(w, h, j):
    """Whether an event function has changed over a step otherwise than its slopes say."""
    for i in range(w.g.shape[0]):
        change = w.g[i, j] - w.g_start[i, j]
        before, after = h * w.slope_start[i, j], h * w.slope[i, j]
        scale = abs(change) + abs(before) + abs(after)
        noise = 1e-12 * abs(w.g[i, j])
        if abs(change - 0.5 * (before + after)) > 0.2 * scale + noise:
            return True
    return False


@numba.njit(**INNER)
def without_excursion(task, w, free, j):
    """Return the part of the step just tried that is to be tried instead, 1 for all of it.

    With an end on the side of the start, no switching function may have been on the other side;
    with an end on the other side, only once.  With `free` that is asked of the polynomial through
    them as well.
    """
    if task.C.size < 5 or (task.C[1], task.C[2], task.C[3]) != _INSIDE:
        return 1.0
    for i in range(task.corners):
        start = w.e_start[i, j]
        side = 1.0 if start > 0.0 or (start == 0.0 and w.g_inside[0, i, j] > 0.0) else -1.0
        part = _turning_part(
            side * start,
            side * w.g_inside[0, i, j],
            side * w.g_inside[1, i, j],
            side * w.g_inside[2, i, j],
            side * w.e[i, j],
            free,
        )
        if part < 1.0:
            return part
    return 1.0


@numba.njit(**INNER)
def _turning_part(start, one, two, three, end, free):
    """Return where a function that starts at or above 0 is below 0 before it comes back, or 1.

    Between its values at the parts 0, `_INSIDE` and 1 it is taken for the polynomial through them.
    Where that may be wrong by more than its distance from 0, its minimum counts as below 0.
    """
    least = min(start, one, two, three, end)
    extent = max(start, one, two, three, end) - least
    if not least <= extent:  # far from the corner, or NaN
        return 1.0
    if (
        free
        and (one < 0.0 and not (two < 0.0 and three < 0.0 and end < 0.0))
        and max(two, three, end) > 0.0
    ):
        return _FIRST
    if two < 0.0 and max(three, end) > 0.0:
        return _SECOND
    if three < 0.0 and end > 0.0:
        return _THIRD
    if least < 0.0:
        return 1.0  # one crossing, for `locate`
    return _lowest(start, one, two, three, end, extent) if free else 1.0


@numba.njit(**INNER)
def _lowest(start, one, two, three, end, extent):
    """Return where the polynomial through five values has a minimum near or below 0, or 1."""
    # divided differences at 0, _FIRST, _SECOND, 1 and _THIRD
    a = (one - start) / _FIRST
    b = ((two - one) / (_SECOND - _FIRST) - a) / _SECOND
    c = ((end - two) / (1.0 - _SECOND) - (two - one) / (_SECOND - _FIRST)) / (1.0 - _FIRST) - b
    cubic = start + _THIRD * (a + (_THIRD - _FIRST) * (b + (_THIRD - _SECOND) * c))
    error = abs(three - cubic)
    if error > 0.2 * extent:
        return SHORTER
    d = (three - cubic) / (_THIRD * (_THIRD - _FIRST) * (_THIRD - _SECOND) * (_THIRD - 1.0))
    lowest, part = min(start, end) - _DIP * extent, 1.0
    for n in range(1, _GRID):
        x = (n / _GRID) ** 2  # closer where a step starts that ended at a minimum
        value = start + x * (a + (x - _FIRST) * (b + (x - _SECOND) * (c + (x - 1.0) * d)))
        if value < lowest:
            lowest, part = value, x
    return part if lowest <= error + _NEAR * extent else 1.0
