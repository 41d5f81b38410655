"""What happens to sampled blocks, at instants that are known before a run."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ..machine.address import call_out
from .delays import is_due, next_break
from .evaluate import inputs_at
from .memory import Places1, Places2, Reals1, Reals2
from .state import INNER, RUNNING


class Ticks(NamedTuple):
    """When what happens to sampled blocks."""

    ticks: Reals2  # (lanes, instants): when something does, then inf
    which: Places2  # (lanes, instants): which of the functions then
    functions: Places1
    due: Places2  # (functions, sampled states): whether it makes the next state
    states: Places1  # indices of these states
    table: Places2


class Timed(NamedTuple):
    """What is known before a run of functions of t alone."""

    jumps: Reals2  # (lanes, instants): when they have jumped or have kinks, then inf
    until: Reals2  # (lanes, instants): until when they are what they were before that
    longest: Reals1  # (lanes,) step in s that none may be longer than
    reach: Reals2  # (lanes, cells): until when a step may lead that begins in a cell
    opaque: float  # longest step from rest where something is called as it stands (s), otherwise 0
    table: Places2


@numba.njit(**INNER)
def next_stop(task, lane, w, j):
    """Return where a step must end."""
    # That is when something happens to sampled blocks, with inputs at their next break point, where
    # a break leaves a transport delay, and at the last time.
    times = task.times
    stop = times[-1]
    if task.inputs.shape[0] and lane.segment < times.size - 1:
        stop = times[lane.segment + 1]
    if lane.tick < task.clocks.ticks.shape[1]:
        stop = min(stop, task.clocks.ticks[j, lane.tick])
    if lane.jump < task.timed.jumps.shape[1]:
        stop = min(stop, task.timed.jumps[j, lane.jump])
    return next_break(task, w, lane, j, stop) if task.lines.delays.shape[0] else stop


@numba.njit(**INNER)
def take_samples(task, lanes, w, sampled):
    """Let happen what is due in each lane; fill ``sampled``: whether that is anything."""
    # Return whether it is in any lane.
    found = False
    for j in range(lanes.size):
        sampled[j] = lanes[j].status == RUNNING and is_due(task, lanes[j], j)
        found |= sampled[j]
    for j in range(lanes.size):
        if sampled[j] and lanes[j].segment == task.times.size - 1:
            lanes[j].resumes = 1
            for i in range(w.x.shape[0]):
                w.resume[i, j] = w.x[i, j]
    for k in range(task.clocks.functions.size if found else 0):
        wanted = False
        for j in range(lanes.size):
            w.t[j] = lanes[j].t
            wanted |= sampled[j] and task.clocks.which[j, lanes[j].tick] == k
        if not wanted:
            continue
        if w.u.shape[0]:
            inputs_at(task, lanes, w)
        call_out(task.clocks.functions[k], w.t, w.x, w.u, task.p, w.s)
        for j in range(lanes.size):
            if sampled[j] and task.clocks.which[j, lanes[j].tick] == k:
                _take(task, lanes[j], w, j, k)
    for j in range(lanes.size):
        if sampled[j]:
            lanes[j].tick += 1
    return found


@numba.njit(**INNER)
def time_rounding(task):
    """Return by how little two times of a run differ that are the same (s)."""
    return 1e-14 * max(abs(task.times[0]), abs(task.times[task.times.size - 1]))


@numba.njit(**INNER)
def pass_jumps(task, lanes, jumped):
    """Go on to the other side of the break points that lanes have come to; fill ``jumped``."""
    # Return whether any lane has come to one.
    found, count = False, task.timed.jumps.shape[1]
    rounding = time_rounding(task)
    for j in range(lanes.size):
        lane = lanes[j]
        jumped[j] = False
        while lane.jump < count and task.timed.jumps[j, lane.jump] <= lane.t + rounding:
            lane.right = task.timed.jumps[j, lane.jump]
            lane.jump += 1
            jumped[j] = True
        lane.left = task.timed.until[j, lane.jump] if lane.jump < count else np.inf
        found |= jumped[j]
    return found


@numba.njit(**INNER)
def begin_afresh(task, lanes, w, sampled):
    """Forget what was known of steps where a sample is taken: a run that resumes there has none."""
    # The first step tried is the time to what comes next.
    for j in range(lanes.size):
        lane = lanes[j]
        if not sampled[j]:
            continue
        gap = next_stop(task, lane, w, j) - lane.t
        lane.h = task.fixed if task.fixed > 0.0 else max(gap, 1e-12 * abs(lane.t))
        lane.log_error_before = lane.last = lane.low = lane.high = lane.cross = 0.0
        lane.tries = lane.seeks = lane.traces = lane.same_side = 0
        lane.short = lane.quiet = lane.slow = lane.kinks = lane.dull = 0


@numba.njit(**INNER)
def _take(task, lane, w, j, k):
    """Make the next states of sampled blocks the states of a lane, also in its output samples."""
    shown = task.times[lane.segment] == lane.t
    for i in range(task.clocks.states.size):
        if task.clocks.due[k, i]:
            row = task.clocks.states[i]
            w.x[row, j] = w.s[i, j]
            if shown:
                w.samples[lane.segment, row, j] = w.s[i, j]
    lane.jacobian_at = np.nan
    for i in range(task.rows.declared):
        w.events.behind[i, j] = 0.0
