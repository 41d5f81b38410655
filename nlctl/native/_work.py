"""What an integration works on: the task, arrays for all members, and the right-hand side.

The right-hand side is an argument of one fixed type: what calls it is compiled once and not once
per diagram.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numba
import numpy as np

from . import _rodas5p, _tsit5
from ._lane import INNER

VECTOR = numba.float64[::1]
MATRIX = numba.float64[:, ::1]
RHS = numba.types.FunctionType(numba.void(VECTOR, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX))
OUT = numba.types.FunctionType(numba.void(VECTOR, MATRIX, MATRIX, MATRIX, MATRIX))

AUTO, EXPLICIT, IMPLICIT = 0, 1, 2
FAR = 1e6
AHEAD = 1e-4  # part of a step over which the rate of a memory is taken

Task = namedtuple("Task", "times inputs p corners memory rtol atol fixed max_steps method alone")
Work = namedtuple(
    "Work",
    "t h hh x x_new x_stage k g e e_start e_low e_high behind u error rate x_ahead dx_ahead "
    "g_start slope slope_start g_ahead x_flat x_new_flat x_stage_flat x_ahead_flat k_flat sums "
    "t_end jacobian matrix f_t pivots U",
)
FLAT = ("x", "x_new", "x_stage", "x_ahead")


def new_work(n: int, inputs: int, events: int, lanes: int) -> Work:
    """Return the arrays for integrating members with `n` states."""
    size = n if lanes == 1 else 0  # the stiff method is for single runs
    columns: dict[str, Any] = {
        name: np.zeros((n, lanes)) for name in ("x", "x_new", "x_stage", "x_ahead", "dx_ahead")
    }
    rows = (
        "g",
        "g_ahead",
        "e",
        "e_start",
        "e_low",
        "e_high",
        "behind",
        "g_start",
        "slope",
        "slope_start",
    )
    columns |= {name: np.zeros((events, lanes)) for name in rows}
    flat = {f"{name}_flat": columns[name].reshape(-1) for name in FLAT}  # the same memory
    k = np.zeros((_tsit5.STAGES, n, lanes))
    return Work(
        **columns,
        **flat,
        **{name: np.zeros(lanes) for name in ("t", "h", "error", "rate", "t_end")},
        hh=np.zeros(n * lanes),
        k=k,
        k_flat=k.reshape(_tsit5.STAGES, n * lanes),
        sums=np.zeros((3, lanes)),
        u=np.zeros((inputs, lanes)),
        jacobian=np.zeros((size, size)),
        matrix=np.zeros((size, size)),
        f_t=np.zeros(size),
        pivots=np.zeros(size, dtype=np.int64),
        U=np.zeros((_rodas5p.STAGES, size)),
    )


@numba.njit(**INNER)
def inputs_at(t, times, inputs, lanes, u):
    """Fill `u` with the inputs at each lane's time: linear within a segment of the time grid."""
    for j in range(lanes.size):
        m = min(lanes[j].segment, times.size - 2)  # a lane that has finished is not moved on
        share = (t[j] - times[m]) / (times[m + 1] - times[m])
        for i in range(u.shape[0]):
            u[i, j] = inputs[i, m] * (1.0 - share) + inputs[i, m + 1] * share


@numba.njit(**INNER)
def evaluate(rhs, task, lanes, w, x, dx, g):
    """Evaluate the right-hand side at the times w.t; memory stands still within a step."""
    if w.u.shape[0]:
        inputs_at(w.t, task.times, task.inputs, lanes, w.u)
    rhs(w.t, x, w.u, task.p, dx, g)
    for i in task.memory:
        dx[i, :] = 0.0


@numba.njit(**INNER)
def memory_rates(rhs, task, lanes, w, x, dx):
    """Fill the memory rows of w.e with the rates at which memories would be carried along.

    A difference over a small part of the step: its error moves the turning point by so little
    that the turning value does not change.
    """
    for j in range(lanes.size):
        w.t[j] = w.t_end[j] + AHEAD * max(lanes[j].h, 1e-12)
        ahead = w.t[j] - w.t_end[j]  # what is left of it after rounding
        w.h[j] = ahead
        w.x_ahead[:, j] = x[:, j] + ahead * dx[:, j]
    evaluate(rhs, task, lanes, w, w.x_ahead, w.dx_ahead, w.g_ahead)
    for i in range(w.g.shape[0]):
        for j in range(lanes.size):
            w.slope[i, j] = (w.g_ahead[i, j] - w.g[i, j]) / max(w.h[j], 1e-300)
    for i in range(task.corners, w.g.shape[0]):
        for j in range(lanes.size):
            change = w.g_ahead[i, j] - w.g[i, j]  # exactly 0 where the memory stands still
            noise = 1e-15 * max(abs(w.g[i, j]), abs(w.g_ahead[i, j]))
            w.e[i, j] = change if change == 0.0 or abs(change) > noise else w.e_start[i, j]
            if lanes[j].quiet > 0:
                w.e[i, j] = 0.0  # memories are committed step by step for a while


@numba.njit(**INNER)
def restart(rhs, task, lanes, w, chosen):
    """Make the chosen lanes' derivatives, event functions and memories those of their state."""
    _refresh(rhs, task, lanes, w, chosen)
    if task.memory.size:
        for _ in range(task.memory.size):  # one that commits may move the next
            if not _commit(task, w, chosen):
                break
            _refresh(rhs, task, lanes, w, chosen)
        saved = w.e.copy()
        for j in range(lanes.size):
            w.t_end[j] = lanes[j].t
            if chosen[j]:
                w.e_start[:, j] = 0.0
        memory_rates(rhs, task, lanes, w, w.x, w.k[0])
        for j in range(lanes.size):
            if not chosen[j]:
                w.e[:, j] = saved[:, j]
        _lock(rhs, task, lanes, w, chosen)
    for j in range(lanes.size):
        if chosen[j]:
            w.e[: task.corners, j] = w.g[: task.corners, j]
            w.e_start[:, j] = w.e[:, j]
            w.g_start[:, j], w.slope_start[:, j] = w.g[:, j], w.slope[:, j]


@numba.njit(**INNER)
def _commit(task, w, chosen):
    """Commit the chosen lanes' memories; return whether one of them has changed."""
    changed = False
    for i in range(task.memory.size):
        for j in range(chosen.size):
            if chosen[j] and w.x[task.memory[i], j] != w.g[task.corners + i, j]:
                w.x[task.memory[i], j] = w.g[task.corners + i, j]
                changed = True
    return changed


@numba.njit(**INNER)
def _refresh(rhs, task, lanes, w, chosen):
    """Evaluate the chosen lanes' derivatives and event functions at their state."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t
    evaluate(rhs, task, lanes, w, w.x, w.dx_ahead, w.g_ahead)
    for j in range(lanes.size):
        if chosen[j]:
            w.k[0, :, j], w.g[:, j] = w.dx_ahead[:, j], w.g_ahead[:, j]


@numba.njit(**INNER)
def _lock(rhs, task, lanes, w, chosen):
    """Move memories that are being carried along far behind what carries them.

    The stages of a step are approximations: with the memory right behind, one that falls back a
    little would see it standing still, and the step would not be smooth.  Only where the memory
    turns round does its value count again, and there it is committed.

    A memory that counts wherever it stands, a relay's, is not carried but about to jump.  It
    keeps its value up to the corner where it jumps; at that corner already, it jumps.
    """
    every = np.ones(task.memory.size, np.bool_)
    if np.all(_carried(rhs, task, lanes, w, chosen, every)):
        return
    for j in range(lanes.size):
        for i in range(task.memory.size):
            if chosen[j] and w.e[task.corners + i, j] != 0.0:
                w.x[task.memory[i], j] = w.x_ahead[task.memory[i], j]
    _refresh(rhs, task, lanes, w, chosen)
    for i in range(task.memory.size):
        row, one = task.corners + i, np.zeros(task.memory.size, np.bool_)
        one[i] = True
        before, after = w.g[row].copy(), w.g[row] + w.e[row]
        carried = _carried(rhs, task, lanes, w, chosen, one)
        for j in range(lanes.size):
            if not carried[j]:
                at_corner = np.any(w.g[: task.corners, j] == 0.0)
                w.x[task.memory[i], j] = after[j] if at_corner else before[j]
                w.e[row, j] = 0.0
        if not np.all(carried):
            _refresh(rhs, task, lanes, w, chosen)


@numba.njit(**INNER)
def _carried(rhs, task, lanes, w, chosen, which):
    """Move memories far behind; return, lane by lane, whether nothing else has changed by that.

    Where they stood is left in w.x_ahead.
    """
    g, k = w.g[task.corners :].copy(), w.k[0].copy()
    w.x_ahead[:] = w.x
    for j in range(lanes.size):
        for i in range(task.memory.size):
            rate, m = w.e[task.corners + i, j], task.memory[i]
            if chosen[j] and which[i] and rate != 0.0:
                far = FAR * (1.0 + abs(w.x[m, j]))
                w.x[m, j] -= far if rate > 0.0 else -far
    _refresh(rhs, task, lanes, w, chosen)
    carried = np.ones(lanes.size, np.bool_)
    for j in range(lanes.size):
        same = np.all(g[:, j] == w.g[task.corners :, j]) and np.all(k[:, j] == w.k[0, :, j])
        carried[j] = same or not chosen[j]
    return carried


@numba.njit(**INNER)
def _first_step(rhs, task, lanes, w):
    """Propose a first step, after Hairer, Norsett, Wanner, Solving ODEs I, II.4."""
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
        w.x_ahead[:, j] = w.x[:, j] + lanes[j].h * w.k[0, :, j]
    evaluate(rhs, task, lanes, w, w.x_ahead, w.dx_ahead, w.g_ahead)
    for i in range(n):
        for j in range(lanes.size):
            scale = task.atol + task.rtol * abs(w.x[i, j])
            d2[j] += ((w.dx_ahead[i, j] - w.k[0, i, j]) / scale) ** 2 / n
    for j in range(lanes.size):
        h0 = lanes[j].h
        largest = max(np.sqrt(d1[j]), np.sqrt(d2[j]) / h0)
        h1 = max(1e-6, h0 * 1e-3) if largest <= 1e-15 else (0.01 / largest) ** 0.2
        h = min(100 * h0, h1, span)
        lanes[j].h = task.fixed if task.fixed > 0.0 else (h if np.isfinite(h) else h0)


def start(rhs, task, lanes, w):
    """Begin at the initial states in w.x: commit the memories, propose first steps."""
    everyone = np.ones(lanes.size, np.bool_)
    restart(rhs, task, lanes, w, everyone)
    _first_step(rhs, task, lanes, w)
    restart(rhs, task, lanes, w, everyone)


def outputs(rhs, out, task, w, states, y):
    """Fill ``y[m, :, lane]`` with the outputs at ``states[m, :, lane]``.

    Samples inside a step have the memory of its beginning; here they get their own.
    """
    for m in range(task.times.size):
        w.t[:] = task.times[m]
        for i in range(w.u.shape[0]):
            w.u[i, :] = task.inputs[i, m]
        if task.memory.size:
            rhs(w.t, states[m], w.u, task.p, w.dx_ahead, w.g)
            for i in range(task.memory.size):
                states[m, task.memory[i], :] = w.g[task.corners + i, :]
        out(w.t, states[m], w.u, task.p, y[m])
