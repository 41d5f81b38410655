"""The near side of a break point: what memories are before their input jumps.

Behind a break point, what carries a memory along may have jumped back.  The memory keeps what it
was just before, which is extrapolated from two looks at the solution inside the step.
"""

from __future__ import annotations

import numba
import numpy as np

from ..methods.dense import events_at_parts
from ..state import INNER, opposite
from .location import AGAIN, EVENT, behind_event

_HALVINGS = 24  # of the way to a break point that is farther back


@numba.njit(**INNER)
def look_before(rhs, task, lanes, w, found):
    """Make memories in w.memories.m what they are just before a break point that ends a step."""
    # Behind it, what carries a memory along may have jumped back: it keeps what it was before.
    inside, ahead, memories = w.inside, w.ahead, w.memories
    wanted, any_wanted, nearer = inside.wanted, False, w.events.g_inside[3]
    back = 2.5 * behind_event(task.rtol)  # the break point is not so far back
    for j in range(lanes.size):
        wanted[j] = found[j] == EVENT and _crosses(task, w, w.events.g, j)
        if found[j] > AGAIN and _carries(w, j) and _reaches_condition(task, w, j):
            found[j], wanted[j] = EVENT, 1  # at 0 what jumps there may have jumped
        any_wanted |= wanted[j]
    if not any_wanted:
        return
    for j in range(lanes.size):
        inside.part[j] = 1.0 - back
    events_at_parts(rhs, task, lanes, w, nearer, memories.m_inside[3])
    any_far = False
    for j in range(lanes.size):
        inside.part[j] = 1.0 - 2.0 * back
        inside.sought[j] = 1 if wanted[j] and _comes_to(task, w, nearer, j) else -1
        any_far |= inside.sought[j] > 0
    if any_far:
        _halve(rhs, task, lanes, w, back)
    events_at_parts(rhs, task, lanes, w, ahead.g, ahead.m)
    for j in range(lanes.size):
        far = inside.sought[j] > 0
        on = 0.0 if far else 1.0 + _until_break_point(task, w, nearer, j)
        for i in range(memories.m.shape[0]):
            if wanted[j] and memories.rate_start[i, j] != 0.0:
                change = 0.0 if far else memories.m_inside[3, i, j] - ahead.m[i, j]
                memories.m[i, j] = ahead.m[i, j] + on * change


@numba.njit(**INNER)
def _halve(rhs, task, lanes, w, back):
    """Set w.inside.part right before the first break point of the lanes that are sought."""
    # Where a memory turns at the break point at which its input jumps, a step ends farther behind.
    inside = w.inside
    for j in range(lanes.size):
        if inside.sought[j] > 0:
            # a step across a condition is in no bracket: it begins on the near side
            inside.bracket[0, j] = 0.0 if lanes[j].across else lanes[j].low / lanes[j].step
            inside.bracket[2, j] = 1.0 - back
            inside.part[j] = 0.5 * (inside.bracket[0, j] + inside.bracket[2, j])
    for _ in range(_HALVINGS):
        events_at_parts(rhs, task, lanes, w, w.ahead.g, w.ahead.m)
        for j in range(lanes.size):
            if inside.sought[j] > 0:
                is_behind = _comes_to(task, w, w.ahead.g, j)
                inside.bracket[2 if is_behind else 0, j] = inside.part[j]
                inside.part[j] = 0.5 * (inside.bracket[0, j] + inside.bracket[2, j])
    for j in range(lanes.size):
        if inside.sought[j] > 0:
            inside.part[j] = inside.bracket[0, j]


@numba.njit(**INNER)
def _until_break_point(task, w, nearer, j):
    """Return how far it is to the first break point, in distances between the last two looks."""
    first = np.inf
    for i in range(task.rows.switching):
        if opposite(w.events.g_start[i, j], w.events.g[i, j]):
            first = min(first, nearer[i, j] / (w.ahead.g[i, j] - nearer[i, j]))
    return min(max(first, 0.0), 1.0)


@numba.njit(**INNER)
def _crosses(task, w, g, j):
    """Whether a switching function has another sign than at the start of a step."""
    for i in range(task.rows.switching):  # noqa: SIM110 (no generators in machine code)
        if opposite(w.events.g_start[i, j], g[i, j]):
            return True
    return False


@numba.njit(**INNER)
def _comes_to(task, w, g, j):
    """Whether a switching function has left the sign of the start; at 0 what jumps may have."""
    for i in range(task.rows.switching):
        start = w.events.g_start[i, j]
        if opposite(start, g[i, j]) or (start != 0.0 and g[i, j] == 0.0):
            return True
    return False


@numba.njit(**INNER)
def _reaches_condition(task, w, j):
    """Whether a step ends where a condition is exactly 0 that was not at its start."""
    for i in range(task.rows.declared, task.rows.guarded):
        if w.events.g[i, j] == 0.0 and w.events.g_start[i, j] != 0.0:
            return True
    return False


@numba.njit(**INNER)
def _carries(w, j):
    """Whether a memory is being carried along."""
    for i in range(w.memories.m.shape[0]):  # noqa: SIM110 (no generators in machine code)
        if w.memories.rate_start[i, j] != 0.0:
            return True
    return False
