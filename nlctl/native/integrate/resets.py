"""Guards: where one has fallen through 0, its block jumps to what its reset says.

All guards that have fallen at an instant jump together, from the values before; what falls by that
jumps next, and so on until none falls.  A run in which that has no end ends as ZENO, and one whose
jumps accumulate, or follow each other without progress of time.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ...accumulation import jumps_end
from ..machine.address import call_out
from .evaluate import evaluate, inputs_at
from .log import note
from .memory import Places1, Places2, Reals2, Reals3
from .restart import restart
from .state import DIVERGED, INNER, RUNNING, ZENO

_MOST = 100  # jumps at one instant, or without progress of time
_STILL = 1e-13  # of a time: less is no progress
_HOVERS = 1e-13  # of a run: a ball that lies on the ground hops as far as rounding lets it
_AHEAD = 1e-9  # of a time: over which is seen whether a guard rises
_jumps_end = numba.njit(**INNER)(jumps_end)


class Resets(NamedTuple):
    """What states jump to where guards fall."""

    functions: Places1  # the one that fills states behind jumps, if there are guards
    states: Places1  # indices of these states
    owned: Places2  # (guards, these states): whether a guard's fall is their jump
    table: Places2


class Guards(NamedTuple):
    """What is known of guards: (guards, lanes)."""

    above: Places2  # whether it was not negative when last seen
    rising: Reals2  # the value of one that was negative behind its jump and is to rise, or NaN
    pace: Reals3  # (guards, lanes, PACE): how its jumps follow each other, see `jumps_end`
    table: Places2


@numba.njit(**INNER)
def begin_guards(task, lanes, w):
    """See which guards are not negative where a run begins: none of them falls there."""
    for i in range(task.rows.switching - task.rows.guarded):
        for j in range(lanes.size):
            w.guards.above[i, j] = _above(lanes[j], w.events.g[task.rows.guarded + i, j], i)
            w.guards.rising[i, j] = np.nan


@numba.njit(**INNER)
def fall(rhs, task, lanes, w, seen):
    """Let jump what has fallen in the lanes that are seen; these begin again behind that."""
    fallen = np.zeros((task.rows.switching - task.rows.guarded, lanes.size), np.bool_)
    jumped, any_risen = np.zeros(fallen.shape, np.bool_), False
    for j in range(lanes.size):
        if seen[j] and lanes[j].status == RUNNING:
            _check_rising(task, lanes[j], w, j)
    for again in range(_MOST + 1):
        chosen, any_fallen = _fallen(task, lanes, w, seen, fallen)
        if not any_fallen:
            break
        if again == _MOST:
            for j in range(lanes.size):
                lanes[j].status = ZENO if chosen[j] else lanes[j].status
            break
        any_risen = True
        jumped |= fallen
        _jump(task, lanes, w, fallen, chosen)
        restart(rhs, task, lanes, w, chosen)
    if any_risen:
        _rises(rhs, task, lanes, w, jumped)


@numba.njit(**INNER)
def _above(lane, value, i):
    """Whether a guard is not negative; one that is NaN ends the run."""
    if value != value and lane.status == RUNNING:
        lane.status, lane.culprit = DIVERGED, i
    return 1 if value >= 0.0 else 0


@numba.njit(**INNER)
def _fallen(task, lanes, w, seen, fallen):
    """Fill which guards have fallen since they were last seen; return the lanes, and if any."""
    chosen, found = np.zeros(lanes.size, np.bool_), False
    for i in range(fallen.shape[0]):
        for j in range(lanes.size):
            fallen[i, j] = False
            if not seen[j] or lanes[j].status != RUNNING:
                continue
            before = w.guards.above[i, j]
            w.guards.above[i, j] = _above(lanes[j], w.events.g[task.rows.guarded + i, j], i)
            if before and not w.guards.above[i, j] and lanes[j].status == RUNNING:
                fallen[i, j] = chosen[j] = found = True
    return chosen, found


@numba.njit(**INNER)
def _jump(task, lanes, w, fallen, chosen):
    """Make the states of all blocks with a guard that has fallen those behind the jump."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t
    if w.u.shape[0]:
        inputs_at(task, lanes, w)
    call_out(task.resets.functions[0], w.t, w.x, w.u, task.p, w.s)
    for j in range(lanes.size):
        if not chosen[j]:
            continue
        lane = lanes[j]
        for i in range(fallen.shape[0]):
            if not fallen[i, j]:
                continue
            note(task, lane, w, lane.t, task.rows.guarded + i, False, j)
            if lane.status != ZENO:
                lane.culprit = i
            if _jumps_end(w.guards.pace[i, j], lane.t):
                lane.status = ZENO
            for m in range(task.resets.states.size):
                if task.resets.owned[i, m]:
                    w.x[task.resets.states[m], j] = w.s[m, j]
        _counted(task, lane)
        lane.jacobian_at = np.nan
        if task.times[lane.segment] == lane.t:
            for i in range(w.x.shape[0]):
                w.samples[lane.segment, i, j] = w.x[i, j]
        for i in range(task.rows.declared):
            w.events.behind[i, j] = 0.0


@numba.njit(**INNER)
def _counted(task, lane):
    """Count jumps without progress of time, or in the first step after another."""
    # Too many have no end. That they do not end is so from the first of them on.
    gone = lane.t - lane.fell_at
    still = max(_STILL * abs(lane.t), _HOVERS * (task.times[-1] - task.times[0]))
    lane.crowd = lane.crowd + 1 if gone <= max(still, 1.5 * lane.last) else 0
    lane.fell_at = lane.t
    lane.since = lane.since if lane.crowd else lane.t
    if lane.crowd > _MOST:
        lane.status = ZENO


@numba.njit(**INNER)
def _rises(rhs, task, lanes, w, jumped):
    """Keep the values of guards that are still negative behind their jump, and rise."""
    for j in range(lanes.size):
        ahead = max(abs(lanes[j].t) * _AHEAD, _AHEAD)
        w.t[j] = lanes[j].t + ahead
        for i in range(w.x.shape[0]):
            w.ahead.x[i, j] = w.x[i, j] + ahead * w.k[0, i, j]
    evaluate(rhs, task, lanes, w, w.ahead.x, w.ahead.dx, w.ahead.g, w.ahead.m)
    for i in range(jumped.shape[0]):
        for j in range(lanes.size):
            now, later = w.events.g[task.rows.guarded + i, j], w.ahead.g[task.rows.guarded + i, j]
            if jumped[i, j] and lanes[j].fell_at == lanes[j].t and now < 0.0 and later > now:
                w.guards.rising[i, j] = now


@numba.njit(**INNER)
def _check_rising(task, lane, w, j):
    """End a run in which a guard that should have risen has not: jumps come faster than steps."""
    guards = w.guards
    for i in range(guards.rising.shape[0]):
        if guards.rising[i, j] == guards.rising[i, j] and lane.t > lane.fell_at:
            if w.events.g[task.rows.guarded + i, j] < guards.rising[i, j]:
                lane.status, lane.culprit = ZENO, i
            guards.rising[i, j] = np.nan
