"""Where a run begins or resumes behind an event: memories are committed, or locked far behind."""

from __future__ import annotations

import numba
import numpy as np

from .delayed import arrival, next_arrival
from .evaluate import evaluate
from .events.functions import begin_next
from .samples import time_rounding
from .state import INNER, opposite

FAR = 1e6
AHEAD = 1e-4  # part of a step over which the rate of a memory is taken
AT_BREAK = 0.01  # of what is looked ahead: nearer, a break is at hand
_NEARER = 1e-6  # the same of long steps, by Taylor's method
_NEAREST = 1e-10  # and of a run


@numba.njit(**INNER)
def memory_rates(rhs, task, lanes, w, x, dx):
    """Fill w.memories with the rates at which memories would be carried along."""
    # A difference over a small part of the step: its error moves the turning point by so little
    # that the turning value does not change. Where functions of t alone jump, or a break of a
    # delayed signal arrives, it is taken backwards. Where a break point lies in between, it says
    # nothing: a relay is about to jump.
    ahead, memories = w.ahead, w.memories
    for j in range(lanes.size):
        far, gap = _far(task, lanes[j].h), next_arrival(task, w, j) - ahead.begin[j]
        w.t[j] = ahead.begin[j] + far
        if far > gap > AT_BREAK * far:
            w.t[j] = ahead.begin[j] + 0.5 * gap
        elif w.t[j] > lanes[j].left or far > gap:
            w.t[j] = ahead.begin[j] - min(far, lanes[j].step)
        away = w.t[j] - ahead.begin[j]  # what is left of it after rounding
        w.h[j] = away
        for i in range(x.shape[0]):
            ahead.x[i, j] = x[i, j] + away * dx[i, j]
    evaluate(rhs, task, lanes, w, ahead.x, ahead.dx, ahead.g, ahead.m)
    for i in range(memories.m.shape[0]):
        for j in range(lanes.size):
            change = ahead.m[i, j] - memories.m[i, j]  # exactly 0 where the memory stands still
            memories.slope[i, j] = change / (w.h[j] if w.h[j] < 0.0 else max(w.h[j], 1e-300))
            if w.h[j] < 0.0:
                change = -change
            noise = 1e-15 * max(abs(memories.m[i, j]), abs(ahead.m[i, j]))
            known = change == 0.0 or (abs(change) > noise and not _is_between(task, w, j))
            memories.rate[i, j] = change if known else memories.rate_start[i, j]
            if lanes[j].quiet > 0:
                memories.rate[i, j] = 0.0  # memories are committed step by step for a while


@numba.njit(**INNER)
def _far(task, step):
    """Return how far to look ahead for the rate of a memory (s)."""
    if task.taylor.highest == 0:
        return AHEAD * max(step, 1e-12)
    span = task.times[task.times.size - 1] - task.times[0]
    return max(_NEARER * min(step, span), _NEAREST * span)


@numba.njit(**INNER)
def _is_between(task, w, j):
    """Whether a break point that a block declares lies between a state and the look ahead of it."""
    for i in range(task.rows.bending):  # noqa: SIM110 (no generators in machine code)
        if opposite(w.events.g[i, j], w.ahead.g[i, j]):
            return True
    return False


@numba.njit(**INNER)
def restart(rhs, task, lanes, w, chosen):
    """Make the chosen lanes' derivatives, event functions and memories those of their state."""
    # What is carried along is first what it was at the end of the step, before anything jumps.
    # A sample taken there is shown with what the signals make of that, on whichever side it lies.
    memories, rounding = w.memories, time_rounding(task)
    for i in range(memories.m.shape[0]):
        for j in range(lanes.size):
            if chosen[j] and memories.rate_start[i, j] != 0.0:
                row, segment = task.rows.memory[i], lanes[j].segment
                w.x[row, j] = memories.m[i, j]
                is_shown = lanes[j].t - task.times[segment] <= rounding
                if is_shown and _jumps_in_time(task, lanes[j], w, j):
                    w.samples[segment, row, j] = memories.m[i, j]
    _refresh(rhs, task, lanes, w, chosen)
    if memories.m.shape[0]:
        for _ in range(memories.m.shape[0]):  # one that commits may move the next
            if not _commit(task, w, chosen):
                break
            _refresh(rhs, task, lanes, w, chosen)
        for j in range(lanes.size):
            for i in range(memories.m.shape[0]):
                memories.rate_start[i, j] = 0.0 if chosen[j] else memories.rate_start[i, j]
        _rates_now(rhs, task, lanes, w, chosen)
        _lock(rhs, task, lanes, w, chosen)
    for j in range(lanes.size):
        if chosen[j]:
            begin_next(task, w, j)


@numba.njit(**INNER)
def _rates_now(rhs, task, lanes, w, chosen):
    """Make the chosen lanes' rates of memories those of their state; the others' stay."""
    rates = w.memories.rate
    saved = rates.copy()
    for j in range(lanes.size):
        w.ahead.begin[j] = lanes[j].t
    memory_rates(rhs, task, lanes, w, w.x, w.k[0])
    for i in range(rates.shape[0]):
        for j in range(lanes.size):
            rates[i, j] = rates[i, j] if chosen[j] else saved[i, j]


@numba.njit(**INNER)
def continue_behind_kinks(rhs, task, lanes, w, passed):
    """Let memories move on where a kink arrives, or resume there: add these lanes to `passed`."""
    # A memory that is carried further in the same direction, or stands still as before, needs no
    # more than its rate behind the kink. Return whether any lane is to resume.
    memories, again, bent = w.memories, False, np.zeros(lanes.size, np.bool_)
    for j in range(lanes.size):
        bent[j] = w.past.bends[j] != 0 and not passed[j]
    _rates_now(rhs, task, lanes, w, bent)
    for j in range(lanes.size):
        for i in range(memories.rate.shape[0] if bent[j] else 0):
            if np.sign(memories.rate[i, j]) == np.sign(memories.rate_start[i, j]):
                memories.rate_start[i, j] = memories.rate[i, j]
            else:
                passed[j] = again = True
    return again


@numba.njit(**INNER)
def _jumps_in_time(task, lane, w, j):
    """Whether a lane has come to where functions of t jump, a clock samples, or a jump arrives."""
    early = lane.t - time_rounding(task)
    if lane.right >= early or (lane.tick > 0 and task.clocks.ticks[j, lane.tick - 1] >= early):
        return True
    for i in range(task.lines.delays.shape[0]):
        k = w.past.first[i, j]
        if w.past.level[k, i, j] == 0 and arrival(task, i, j, w.past.t[k, j]) >= early:
            return True
    return False


@numba.njit(**INNER)
def _commit(task, w, chosen):
    """Commit the chosen lanes' memories; return whether one of them has changed."""
    changed = False
    for i in range(w.memories.m.shape[0]):
        for j in range(chosen.size):
            if chosen[j] and w.x[task.rows.memory[i], j] != w.memories.m[i, j]:
                w.x[task.rows.memory[i], j] = w.memories.m[i, j]
                changed = True
    return changed


@numba.njit(**INNER)
def _refresh(rhs, task, lanes, w, chosen):
    """Evaluate the chosen lanes' derivatives and event functions at their state."""
    _look(rhs, task, lanes, w)
    _adopt(w, chosen)


@numba.njit(**INNER)
def _look(rhs, task, lanes, w):
    """Fill w.ahead with derivatives and event functions at the states."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t
    evaluate(rhs, task, lanes, w, w.x, w.ahead.dx, w.ahead.g, w.ahead.m)


@numba.njit(**INNER)
def _adopt(w, chosen):
    """Make what `_look` has found the chosen lanes' derivatives and event functions."""
    for j in range(chosen.size):
        if chosen[j]:
            for i in range(w.x.shape[0]):
                w.k[0, i, j] = w.ahead.dx[i, j]
            for i in range(w.events.g.shape[0]):
                w.events.g[i, j] = w.ahead.g[i, j]
            for i in range(w.memories.m.shape[0]):
                w.memories.m[i, j] = w.ahead.m[i, j]


@numba.njit(**INNER)
def _lock(rhs, task, lanes, w, chosen):
    """Move memories that are being carried along far behind what carries them."""
    # The stages of a step are approximations: with the memory right behind, one that falls back a
    # little would see it standing still, and the step would not be smooth. Only where the memory
    # reverses does its value count again, and there it is committed. A memory that counts wherever
    # it stands, a relay's, is not carried but about to jump. It keeps its value up to the break
    # point where it jumps; at that break point already, it jumps.
    memories, memory = w.memories, task.rows.memory
    if not _any_moves(w, chosen):
        return
    which, carried = np.ones(memory.size, np.bool_), np.ones(lanes.size, np.bool_)
    if _carried(rhs, task, lanes, w, chosen, which, carried):
        return
    for j in range(lanes.size):
        for i in range(memory.size):
            if chosen[j] and memories.rate[i, j] != 0.0:
                w.x[memory[i], j] = w.ahead.x[memory[i], j]
    _refresh(rhs, task, lanes, w, chosen)
    before = np.zeros(lanes.size)
    for i in range(memory.size):
        for k in range(memory.size):
            which[k] = k == i
        for j in range(lanes.size):
            before[j] = memories.m[i, j]
        if _carried(rhs, task, lanes, w, chosen, which, carried):
            continue
        for j in range(lanes.size):
            if not carried[j]:
                after = before[j] + memories.rate[i, j]
                w.x[memory[i], j] = after if _at_break_point(w.events.g, j) else before[j]
                memories.rate[i, j] = 0.0
        _refresh(rhs, task, lanes, w, chosen)


@numba.njit(**INNER)
def _any_moves(w, chosen):
    """Whether a memory of a chosen lane is being carried along: behind a held input none is."""
    for i in range(w.memories.rate.shape[0]):
        for j in range(chosen.size):
            if chosen[j] and w.memories.rate[i, j] != 0.0:
                return True
    return False


@numba.njit(**INNER)
def _at_break_point(g, j):
    """Whether a lane's state lies on a break point."""
    for i in range(g.shape[0]):  # noqa: SIM110 (no generators in machine code)
        if g[i, j] == 0.0:
            return True
    return False


@numba.njit(**INNER)
def _carried(rhs, task, lanes, w, chosen, which, carried):
    """Move memories far behind; fill `carried`: whether nothing else of a lane changes by that."""
    # Return whether it holds for all lanes. Where the memories stood is left in w.ahead.x.
    for i in range(w.x.shape[0]):
        for j in range(lanes.size):
            w.ahead.x[i, j] = w.x[i, j]
    for j in range(lanes.size):
        for i in range(task.rows.memory.size):
            rate, m = w.memories.rate[i, j], task.rows.memory[i]
            if chosen[j] and which[i] and rate != 0.0:
                far = FAR * (1.0 + abs(w.x[m, j]))
                w.x[m, j] -= far if rate > 0.0 else -far
    _look(rhs, task, lanes, w)
    every = True
    for j in range(lanes.size):
        carried[j] = not chosen[j] or _unchanged(w, j)
        every &= carried[j]
    _adopt(w, chosen)
    return every


@numba.njit(**INNER)
def _unchanged(w, j):
    """Whether `_look` has found a lane's derivatives and memories as they were before."""
    for i in range(w.x.shape[0]):
        if w.ahead.dx[i, j] != w.k[0, i, j]:
            return False
    for i in range(w.memories.m.shape[0]):  # noqa: SIM110
        if w.ahead.m[i, j] != w.memories.m[i, j]:
            return False
    return True
