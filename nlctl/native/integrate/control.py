"""Decisions about one member's steps: how long, accepted or not, by which method.

Each function takes the member's record and a few numbers, never the whole workspace: its arguments
are all that a decision rests on.  Of the task they take the tolerances and what the explicit pair
is like: its order and its limit of stability.
"""

from __future__ import annotations

import numba
import numpy as np

from .methods import rodas5p
from .state import DIVERGED, FIRST_PATIENCE, INNER, OK, RUNNING, STEP_LIMIT, STEP_TOO_SMALL, STIFF

SMALLEST = 4e-16  # of the time: no shorter step can be told from none
TRIAL = 20  # steps of the stiff method before it is judged
MAX_PATIENCE = 2000
_TO_STOP = 1.01  # times a step: a stop so close ends it
LEAST_PART = 0.2  # part of a step that is tried next if its error is too large
_NOTICED = 0.98  # part of one that ends at a stop: a longer one would end there again


@numba.njit(**INNER)
def choose_step(lane, stop, over, max_steps):
    """Set the step to be tried up to time `stop`, or the status of a run that has ended."""
    if over:
        lane.status = OK
    elif lane.accepted + lane.rejected >= max_steps:
        lane.status = STEP_LIMIT
    elif not lane.h > SMALLEST * abs(lane.t):
        lane.status = STEP_TOO_SMALL
    if lane.status != RUNNING:
        lane.step = 0.0
    elif lane.tries == 0 and lane.cross > 0.0:
        lane.ends = 1 if lane.t + lane.cross >= stop else 0
        lane.step = stop - lane.t if lane.ends else lane.cross
        lane.across = 1
    elif lane.tries == 0:
        lane.across = 0
        lane.ends = 1 if lane.t + _TO_STOP * lane.h >= stop else 0
        lane.step = stop - lane.t if lane.ends else lane.h


@numba.njit(**INNER)
def limit_step(task, lane, j):
    """Shorten the step that is proposed where it might pass over a function of t alone."""
    # A function that is called as it stands may move at any time: from rest, where error control
    # sees nothing of it, no step passes an output sample, or is longer than `opaque`.
    if task.fixed > 0.0 or lane.tries > 0 or lane.status != RUNNING:
        return
    longest, cells = task.timed.longest[j], task.timed.reach.shape[1]
    if cells:
        times = task.times
        share = (lane.t - times[0]) / (times[times.size - 1] - times[0])
        longest = min(longest, task.timed.reach[j, min(int(share * cells), cells - 1)] - lane.t)
    if task.timed.opaque > 0.0 and lane.rests and lane.segment < task.times.size - 1:
        longest = min(longest, task.times[lane.segment + 1] - lane.t, task.timed.opaque)
    if lane.h > longest > 0.0:
        lane.h = longest


@numba.njit(**INNER)
def memory_error(task, x, m, m_other, j):
    """Return the largest difference of what a lane's memories would become, over its tolerance."""
    # A memory that is carried along is a state like any other, and follows from the others by an
    # equation that may amplify their errors: in Example 2 that of r by 6000, and with it the time
    # at which the memory is seen to reverse. So `m` is of a step's solution and `m_other` of one
    # that differs from it by the error. What only one of them moves does not count: where a relay
    # switches, or a memory begins to move, is an event, and is located as one.
    largest, spoilt = 0.0, 0.0
    for i in range(m.shape[0]):
        before = x[task.rows.memory[i], j]
        if m[i, j] == before or m_other[i, j] == before:
            continue
        part = abs(m[i, j] - m_other[i, j]) / (task.atol + task.rtol * abs(m[i, j]))
        largest = part if part > largest else largest
        spoilt += 0.0 * part  # NaN or infinity: no maximum keeps it
    return largest + spoilt


@numba.njit(**INNER)
def rejected(lane, error, task, least):
    """Whether the error of a step is too large; if so, propose at least some part of it."""
    finite = np.isfinite(error)
    if error <= 1.0 or (task.fixed > 0.0 and finite):
        return False
    order = rodas5p.ORDER if lane.stiff else task.pair.order
    shorten(lane, max(least, 0.9 * error ** (-1.0 / order)) if finite else 0.1)
    if task.fixed > 0.0 or not (finite or lane.h > SMALLEST * abs(lane.t)):
        lane.status = DIVERGED
    return True


@numba.njit(**INNER)
def shorten(lane, part):
    """Have part of the step just tried be tried instead, whatever was located in it."""
    lane.rejected += 1
    lane.tries = lane.seeks = lane.traces = 0
    lane.cross = 0.0
    lane.h = (min(part, _NOTICED) if lane.ends and part < 1.0 else part) * lane.step


@numba.njit(**INNER)
def next_step(lane, error, rate, task):
    """Propose the next step after an accepted one: PI control, and stability."""
    if task.taylor.highest and task.fixed == 0.0:
        lane.h = max(lane.h, lane.step)  # coefficients will say how long it is to be
        return
    log_error, slower = np.log(max(error, 1e-10)), 5.0 / task.pair.order
    # at equilibrium the error is 0.17 of its tolerance; of the stiff method, whose steps cost
    # more and do not end at a limit of stability, 0.44
    now, before = (0.17, 0.04) if lane.stiff else (0.14 * slower, 0.08 * slower)
    factor = 0.9 * np.exp(before * lane.log_error_before - now * log_error)
    h = lane.step * min(10.0, max(0.2, factor))
    cut_short = lane.step < lane.h  # by an event or the end: no reason for a smaller one
    lane.h = max(h, lane.h) if cut_short else h
    lane.log_error_before = log_error
    lane.rate = rate
    if task.fixed > 0.0:
        lane.h = task.fixed
    elif not lane.stiff:
        limit = min(_reach(task), 0.8 * task.pair.stable)
        lane.slow = lane.slow + 1 if lane.h * rate > limit else 0
        if task.rows.memory.size and lane.slow:
            lane.h = limit / rate


@numba.njit(**INNER)
def _reach(task):
    """Return h |lambda| of the explicit steps that stability limits."""
    # at the limit of stability the rates of memories are noise
    return min(2.0, 0.8 * task.pair.stable) if task.rows.memory.size else task.pair.stable


@numba.njit(**INNER)
def choose_method(lane, task):
    """Go over to the stiff method where stability limits steps, and back where it does not pay."""
    # The stiff method is first tried; it stays while it gets further with a step tried than the
    # explicit one would by more than what its steps cost, `cost` explicit ones each.
    tried = lane.accepted + lane.rejected
    if not lane.stiff:
        if lane.slow >= lane.patience * (1 if task.alone else 100):
            lane.slow = 0
            lane.stiff = 1 if task.alone else 0
            lane.status = RUNNING if task.alone else STIFF
            lane.judged_at, lane.judged_after = lane.t, tried
        return
    lane.stiff += 1
    if lane.stiff % TRIAL == 0:
        limit = _reach(task) / max(lane.rate, 1e-300)
        pays = lane.t - lane.judged_at > task.stiff.cost * limit * (tried - lane.judged_after)
        lane.judged_at, lane.judged_after = lane.t, tried
        if lane.stiff == TRIAL:
            lane.patience = FIRST_PATIENCE if pays else min(2 * lane.patience, MAX_PATIENCE)
        if not pays:
            lane.stiff, lane.h = 0, min(lane.h, limit)
