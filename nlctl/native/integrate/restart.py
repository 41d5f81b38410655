"""Where a run begins or resumes behind an event: memories are committed, or locked far behind."""

from __future__ import annotations

import numba
import numpy as np

from .state import INNER
from .workspace import evaluate

FAR = 1e6
AHEAD = 1e-4  # part of a step over which the rate of a memory is taken


@numba.njit(**INNER)
def memory_rates(rhs, task, lanes, w, x, dx):
    """Fill the memory rows of w.e with the rates at which memories would be carried along.

    A difference over a small part of the step: its error moves the turning point by so little
    that the turning value does not change.  Where functions of t alone jump, it is taken backwards.
    """
    for j in range(lanes.size):
        w.t[j] = w.t_end[j] + AHEAD * max(lanes[j].h, 1e-12)
        if w.t[j] > lanes[j].left:
            w.t[j] = w.t_end[j] - AHEAD * max(lanes[j].last, 1e-12)
        ahead = w.t[j] - w.t_end[j]  # what is left of it after rounding
        w.h[j] = ahead
        for i in range(x.shape[0]):
            w.x_ahead[i, j] = x[i, j] + ahead * dx[i, j]
    evaluate(rhs, task, lanes, w, w.x_ahead, w.dx_ahead, w.g_ahead)
    for i in range(w.g.shape[0]):
        for j in range(lanes.size):
            w.slope[i, j] = (w.g_ahead[i, j] - w.g[i, j]) / (
                w.h[j] if w.h[j] < 0.0 else max(w.h[j], 1e-300)
            )
    for i in range(task.switching, w.g.shape[0]):
        for j in range(lanes.size):
            change = w.g_ahead[i, j] - w.g[i, j]  # exactly 0 where the memory stands still
            if w.h[j] < 0.0:
                change = -change
            noise = 1e-15 * max(abs(w.g[i, j]), abs(w.g_ahead[i, j]))
            w.e[i, j] = change if change == 0.0 or abs(change) > noise else w.e_start[i, j]
            if lanes[j].quiet > 0:
                w.e[i, j] = 0.0  # memories are committed step by step for a while


@numba.njit(**INNER)
def restart(rhs, task, lanes, w, chosen):
    """Make the chosen lanes' derivatives, event functions and memories those of their state.

    What is carried along is first what it was at the end of the step, before anything jumps.
    """
    for i in range(task.memory.size):
        for j in range(lanes.size):
            if chosen[j] and w.e_start[task.switching + i, j] != 0.0:
                w.x[task.memory[i], j] = w.g[task.switching + i, j]
    _refresh(rhs, task, lanes, w, chosen)
    if task.memory.size:
        for _ in range(task.memory.size):  # one that commits may move the next
            if not _commit(task, w, chosen):
                break
            _refresh(rhs, task, lanes, w, chosen)
        saved = w.e.copy()
        for j in range(lanes.size):
            w.t_end[j] = lanes[j].t
            for i in range(w.e.shape[0]):
                w.e_start[i, j] = 0.0 if chosen[j] else w.e_start[i, j]
        memory_rates(rhs, task, lanes, w, w.x, w.k[0])
        for i in range(w.e.shape[0]):
            for j in range(lanes.size):
                w.e[i, j] = w.e[i, j] if chosen[j] else saved[i, j]
        _lock(rhs, task, lanes, w, chosen)
    for i in range(w.e.shape[0]):
        for j in range(lanes.size):
            if chosen[j]:
                w.e[i, j] = w.g[i, j] if i < task.switching else w.e[i, j]
                w.e_start[i, j] = w.e[i, j]
                w.g_start[i, j], w.slope_start[i, j] = w.g[i, j], w.slope[i, j]


@numba.njit(**INNER)
def _commit(task, w, chosen):
    """Commit the chosen lanes' memories; return whether one of them has changed."""
    changed = False
    for i in range(task.memory.size):
        for j in range(chosen.size):
            if chosen[j] and w.x[task.memory[i], j] != w.g[task.switching + i, j]:
                w.x[task.memory[i], j] = w.g[task.switching + i, j]
                changed = True
    return changed


@numba.njit(**INNER)
def _refresh(rhs, task, lanes, w, chosen):
    """Evaluate the chosen lanes' derivatives and event functions at their state."""
    _look(rhs, task, lanes, w)
    _adopt(w, chosen)


@numba.njit(**INNER)
def _look(rhs, task, lanes, w):
    """Fill w.dx_ahead and w.g_ahead with derivatives and event functions at the states."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t
    evaluate(rhs, task, lanes, w, w.x, w.dx_ahead, w.g_ahead)


@numba.njit(**INNER)
def _adopt(w, chosen):
    """Make what `_look` has found the chosen lanes' derivatives and event functions."""
    for j in range(chosen.size):
        if chosen[j]:
            for i in range(w.x.shape[0]):
                w.k[0, i, j] = w.dx_ahead[i, j]
            for i in range(w.g.shape[0]):
                w.g[i, j] = w.g_ahead[i, j]


@numba.njit(**INNER)
def _lock(rhs, task, lanes, w, chosen):
    """Move memories that are being carried along far behind what carries them.

    The stages of a step are approximations: with the memory right behind, one that falls back a
    little would see it standing still, and the step would not be smooth.  Only where the memory
    reverses does its value count again, and there it is committed.

    A memory that counts wherever it stands, a relay's, is not carried but about to jump.  It
    keeps its value up to the break point where it jumps; at that break point already, it jumps.
    """
    if not _any_moves(task, w, chosen):
        return
    which, carried = np.ones(task.memory.size, np.bool_), np.ones(lanes.size, np.bool_)
    if _carried(rhs, task, lanes, w, chosen, which, carried):
        return
    for j in range(lanes.size):
        for i in range(task.memory.size):
            if chosen[j] and w.e[task.switching + i, j] != 0.0:
                w.x[task.memory[i], j] = w.x_ahead[task.memory[i], j]
    _refresh(rhs, task, lanes, w, chosen)
    before = np.zeros(lanes.size)
    for i in range(task.memory.size):
        row = task.switching + i
        for m in range(task.memory.size):
            which[m] = m == i
        for j in range(lanes.size):
            before[j] = w.g[row, j]
        if _carried(rhs, task, lanes, w, chosen, which, carried):
            continue
        for j in range(lanes.size):
            if not carried[j]:
                after = before[j] + w.e[row, j]
                w.x[task.memory[i], j] = (
                    after if _at_break_point(w.g, task.switching, j) else before[j]
                )
                w.e[row, j] = 0.0
        _refresh(rhs, task, lanes, w, chosen)


@numba.njit(**INNER)
def _any_moves(task, w, chosen):
    """Whether a memory of a chosen lane is being carried along: behind a held input none is."""
    for i in range(task.switching, w.e.shape[0]):
        for j in range(chosen.size):
            if chosen[j] and w.e[i, j] != 0.0:
                return True
    return False


@numba.njit(**INNER)
def _at_break_point(g, switching, j):
    """Whether a lane's state lies on a break point."""
    for i in range(switching):  # noqa: SIM110 (no generators in machine code)
        if g[i, j] == 0.0:
            return True
    return False


@numba.njit(**INNER)
def _carried(rhs, task, lanes, w, chosen, which, carried):
    """Move memories far behind; fill `carried`: whether nothing else in a lane has changed by that.

    Return whether it holds for all lanes.  Where the memories stood is left in w.x_ahead.
    """
    for i in range(w.x.shape[0]):
        for j in range(lanes.size):
            w.x_ahead[i, j] = w.x[i, j]
    for j in range(lanes.size):
        for i in range(task.memory.size):
            rate, m = w.e[task.switching + i, j], task.memory[i]
            if chosen[j] and which[i] and rate != 0.0:
                far = FAR * (1.0 + abs(w.x[m, j]))
                w.x[m, j] -= far if rate > 0.0 else -far
    _look(rhs, task, lanes, w)
    every = True
    for j in range(lanes.size):
        carried[j] = not chosen[j] or _unchanged(task, w, j)
        every &= carried[j]
    _adopt(w, chosen)
    return every


@numba.njit(**INNER)
def _unchanged(task, w, j):
    """Whether `_look` has found a lane's derivatives and memories as they were before."""
    for i in range(w.x.shape[0]):
        if w.dx_ahead[i, j] != w.k[0, i, j]:
            return False
    for i in range(task.switching, w.g.shape[0]):  # noqa: SIM110
        if w.g_ahead[i, j] != w.g[i, j]:
            return False
    return True
