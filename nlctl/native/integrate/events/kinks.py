"""What is on the other side around a kink at which a step ends: located before the kink is.

A guard |x - a| - b falls for as long as it takes to go 2 b, and that may be less than what a step
may end by behind the kink in its middle.  So what jumps, and what a run watches, is looked at where
the kink is, once a step.
"""

from __future__ import annotations

import numba

from ..control import shorten
from ..methods.dense import events_at_parts
from ..state import INNER, opposite
from .crossing import bracket, has_crossed, next_try
from .location import AGAIN, EVENT, first_root

_NEWTON = 2  # secants towards a kink


@numba.njit(**INNER)
def crossed_before(task, lane, w, j):
    """Look for what is crossed at the end of a step that is to end behind a break point."""
    if lane.returns == 0 and _any_crossed(task, w, w.events.g, j):
        lane.returns, lane.tries = 1, 0
        bracket(task, lane, w, True, j)
        return next_try(task, lane, w, True, j)
    return EVENT


@numba.njit(**INNER)
def look_at_kinks(rhs, task, lanes, w, found):
    """Have steps end at the kink that they end behind, where something is crossed there."""
    inside, any_wanted = w.inside, False
    for j in range(lanes.size):
        inside.wanted[j], inside.part[j] = 0, 0.0
        if found[j] == EVENT and lanes[j].returns == 0 and lanes[j].across == 0:
            root = first_root(lanes[j], task, False, w, w.events.g_low, w.events.g_high, j)
            inside.wanted[j] = 0.0 < root < lanes[j].step
            inside.part[j] = root / lanes[j].step if inside.wanted[j] else 0.0
        any_wanted |= inside.wanted[j] != 0
    if not any_wanted:
        return
    for n in range(_NEWTON + 1):
        events_at_parts(rhs, task, lanes, w, w.ahead.g, w.ahead.m)
        for j in range(lanes.size):
            if inside.wanted[j] and n < _NEWTON:
                inside.part[j] = _nearer(task, w, inside.part[j], j)
    for j in range(lanes.size):
        if inside.wanted[j] and _any_crossed(task, w, w.ahead.g, j):
            shorten(lanes[j], inside.part[j])
            lanes[j].returns = 1
            found[j] = AGAIN


@numba.njit(**INNER)
def _any_crossed(task, w, g, j):
    """Whether a guard, or what the run watches, is crossed by values within a step."""
    for i in range(task.rows.watched, task.rows.switching):
        if has_crossed(task, w, i, g[i, j], j):
            return True
    return False


@numba.njit(**INNER)
def _nearer(task, w, part, j):
    """Return where the first break point is by its values at a part of the step and at its end."""
    first = 2.0
    for i in range(task.rows.declared):
        here, end = w.ahead.g[i, j], w.events.g[i, j]
        if opposite(w.events.g_start[i, j], end) and here != end:
            first = min(first, part - here * (1.0 - part) / (end - here))
    return first if 0.0 < first < 1.0 else part
