"""Where a run begins: memories are committed, guards seen, first steps proposed."""

from __future__ import annotations

import numba
import numpy as np

from .evaluate import evaluate
from .resets import begin_guards
from .restart import restart
from .samples import begin_afresh, pass_jumps, take_samples
from .state import INNER


@numba.njit(**INNER)
def _first_step(rhs, task, lanes, w):
    """Propose a first step, after Hairer, Norsett, Wanner, Solving ODEs I, II.4."""
    ahead = w.ahead
    n, span = w.x.shape[0], task.times[-1] - task.times[0]
    d0, d1, d2 = np.zeros(lanes.size), np.zeros(lanes.size), np.zeros(lanes.size)
    for i in range(n):
        for j in range(lanes.size):
            if w.k[0, i, j] == 0.0:
                continue  # a locked memory, for instance
            scale = task.atol + task.rtol * abs(w.x[i, j])
            d0[j] += (w.x[i, j] / scale) ** 2 / n
            d1[j] += (w.k[0, i, j] / scale) ** 2 / n
    for j in range(lanes.size):
        small = d0[j] < 1e-10 or d1[j] < 1e-10
        lanes[j].h = min(1e-6 if small else 0.01 * np.sqrt(d0[j] / d1[j]), span)
        w.t[j] = lanes[j].t + lanes[j].h
        for i in range(n):
            ahead.x[i, j] = w.x[i, j] + lanes[j].h * w.k[0, i, j]
    evaluate(rhs, task, lanes, w, ahead.x, ahead.dx, ahead.g, ahead.m)
    for i in range(n):
        for j in range(lanes.size):
            scale = task.atol + task.rtol * abs(w.x[i, j])
            d2[j] += ((ahead.dx[i, j] - w.k[0, i, j]) / scale) ** 2 / n
    for j in range(lanes.size):
        h0 = lanes[j].h
        largest = max(np.sqrt(d1[j]), np.sqrt(d2[j]) / h0)
        power = 1.0 / task.pair.order
        h1 = max(1e-6, h0 * 1e-3) if largest <= 1e-15 else (0.01 / largest) ** power
        h = min(100 * h0, h1, span)
        lanes[j].h = task.fixed if task.fixed > 0.0 else (h if np.isfinite(h) else h0)


def start(rhs, task, w):
    """Begin at the initial states in w.x: commit the memories, propose first steps."""
    lanes = w.lanes
    everyone = np.ones(lanes.size, np.bool_)
    sampled = np.zeros(lanes.size, np.bool_)
    if task.timed.jumps.shape[1]:
        pass_jumps(task, lanes, sampled)
        for j in range(lanes.size):
            sampled[j] = False
    if task.clocks.ticks.size:
        take_samples(task, lanes, w, sampled)
    restart(rhs, task, lanes, w, everyone)
    _first_step(rhs, task, lanes, w)
    begin_afresh(task, lanes, w, sampled)
    restart(rhs, task, lanes, w, everyone)
    begin_guards(task, lanes, w)
