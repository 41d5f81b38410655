"""What a run watches: which changes of sign count, and that it comes to rest at 0."""

from __future__ import annotations

import numba
import numpy as np

from ..log import note
from ..state import ENDED, INNER, RUNNING, is_stiff, opposite
from .functions import at_zero, is_of_relay
from .location import SHORT

_ROUNDING = 1e-14  # of what a function has been


@numba.njit(**INNER)
def changed_side(task, lane, w, i, j):
    """Return the side to which a relay has let change what is watched where a step begins, or 0."""
    # The way to and fro over which it begins to slide does not count: a step that is not short, all
    # of it on one side or sliding, says what has become.  To slide is to be on the other side.
    events, before, now = w.events, w.events.g_start[i, j], w.events.g[i, j]
    came, at_start = events.came[i, j], at_zero(task, w, i, events.g_start, j)
    at_end = at_zero(task, w, i, events.g, j)
    if at_start and at_end:
        return -came if came == events.side[i, j] else 0.0
    if at_start or at_end or before * now <= 0.0 or lane.step < SHORT * lane.h:
        return 0.0
    return np.sign(now) if opposite(came, now) else 0.0


@numba.njit(**INNER)
def keep_side(task, lane, w, i, j):
    """Keep the side on which what a relay lets change is at the end of an accepted step."""
    events, now = w.events, w.events.g[i, j]
    at_start = at_zero(task, w, i, events.g_start, j)
    at_end = at_zero(task, w, i, events.g, j)
    if at_start and at_end:
        events.came[i, j] = -2.0 * events.side[i, j]
        return
    stays = not (at_start or at_end) and events.g_start[i, j] * now > 0.0
    if stays and lane.step >= SHORT * lane.h:
        events.came[i, j] = events.side[i, j] = np.sign(now)


@numba.njit(**INNER)
def has_come_to_rest(task, lane, w, i, j):
    """Whether what a run watches came to 0 where the step just tried begins, and stays there."""
    # Also where it has stopped next to 0, by the rounding of what it is the difference of.
    events, known = w.events, task.pair.inside[1 if is_stiff(lane) else 0, 0] != 0.0
    before, now = events.g_start[i, j], events.g[i, j]
    if abs(events.came[i, j]) != 1.0 or events.came[i, j] != events.side[i, j] or now != now:
        return False
    if before == now and abs(now) <= _ROUNDING * events.largest[i, j] and now != 0.0:
        return lane.across == 0 and lane.step >= SHORT * lane.h
    if not (at_zero(task, w, i, events.g_start, j) and at_zero(task, w, i, events.g, j)):
        return False
    for n in range(3):  # noqa: SIM110 (no generators in machine code)
        if known and not at_zero(task, w, i, events.g_inside[n], j):
            return False
    return True


@numba.njit(**INNER)
def counts(task, lane, i, end):
    """Whether a change of sign counts; of functions that the run watches one may end it."""
    k = i - task.rows.watched
    if k < 0:
        return True
    if task.rows.ways[k] != 0 and (task.rows.ways[k] > 0) != (end > 0.0):
        return False
    if task.rows.ending[k] and lane.status == RUNNING:
        lane.status = ENDED
    return True


@numba.njit(**INNER)
def ends_at_rest(task, lane, w, j):
    """End a run where the step just tried begins, if what ends it has come to 0 there and stays."""
    rows = task.rows
    for i in range(rows.watched, rows.watched + rows.ways.size):
        if not rows.ending[i - rows.watched]:
            continue
        side = changed_side(task, lane, w, i, j) if is_of_relay(task, i) else 0.0
        if not is_of_relay(task, i) and has_come_to_rest(task, lane, w, i, j):
            side = -w.events.came[i, j]
        if side != 0.0 and counts(task, lane, i, side):
            note(task, lane, w, lane.t, i, side > 0.0, j)
            return True
    return False


@numba.njit(**INNER)
def note_rest(task, lane, w, i, j):
    """Note what a run watches that has come to rest at 0, or is on another side of a relay."""
    # Return whether it is either.
    events = w.events
    if is_of_relay(task, i):
        side = changed_side(task, lane, w, i, j)
        keep_side(task, lane, w, i, j)
    elif has_come_to_rest(task, lane, w, i, j):
        side = -events.came[i, j]
        events.came[i, j] = 2.0 * side
    else:
        return False
    if side != 0.0 and counts(task, lane, i, side):
        note(task, lane, w, lane.begun, i, side > 0.0, j)
    return True
