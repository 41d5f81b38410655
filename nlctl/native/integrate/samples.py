"""What happens to sampled blocks, at instants that are known before a run."""

from __future__ import annotations

import numba
import numpy as np

from ..machine.address import call_out
from .delays import next_break
from .inputs import inputs_at
from .state import INNER, RUNNING


@numba.njit(**INNER)
def next_stop(task, lane, w, j):
    """Return where a step must end.

    That is when something happens to sampled blocks, with inputs at their next corner, where a
    break leaves a transport delay, and at the last time.
    """
    times, ticks = task.times, task.ticks
    stop = times[-1]
    if task.inputs.shape[0] and lane.segment < times.size - 1:
        stop = times[lane.segment + 1]
    if lane.tick < ticks.size:
        stop = min(stop, ticks[lane.tick])
    return next_break(task, w, lane, j, stop) if task.delays.shape[0] else stop


@numba.njit(**INNER)
def take_samples(task, lanes, w, sampled):
    """Let happen what is due in each lane; fill ``sampled``: whether that is anything.

    Return whether it is in any lane.
    """
    found = False
    for j in range(lanes.size):
        sampled[j] = _is_due(task, lanes[j])
        found |= sampled[j]
    for k in range(task.samples.size if found else 0):
        wanted = False
        for j in range(lanes.size):
            w.t[j] = lanes[j].t
            wanted |= sampled[j] and task.which[lanes[j].tick] == k
        if not wanted:
            continue
        if w.u.shape[0]:
            inputs_at(task, lanes, w)
        call_out(task.samples[k], w.t, w.x, w.u, task.p, w.s)
        for j in range(lanes.size):
            if sampled[j] and task.which[lanes[j].tick] == k:
                _take(task, lanes[j], w, j, k)
    for j in range(lanes.size):
        if sampled[j]:
            lanes[j].tick += 1
    return found


@numba.njit(**INNER)
def _is_due(task, lane):
    running = lane.status == RUNNING
    return running and lane.tick < task.ticks.size and task.ticks[lane.tick] <= lane.t


@numba.njit(**INNER)
def _take(task, lane, w, j, k):
    """Make the next states of sampled blocks the states of a lane, also in its output samples."""
    shown = task.times[lane.segment] == lane.t
    for i in range(task.sampled.size):
        if task.due[k, i]:
            row = task.sampled[i]
            w.x[row, j] = w.s[i, j]
            if shown:
                w.samples[lane.segment, row, j] = w.s[i, j]
    lane.jacobian_at = np.nan
    for i in range(w.behind.shape[0]):
        w.behind[i, j] = 0.0
