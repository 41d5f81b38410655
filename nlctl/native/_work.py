"""What an integration works on: the task, arrays for all members, and the right-hand side.

The right-hand side is an argument of one fixed type: what calls it is compiled once and not once
per diagram.  Here and in what works on these arrays elements are assigned in loops: assigning a
slice compiles to the same loop and to the text of errors that cannot happen, and takes ten times
as long to compile.
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
        for j in range(lanes.size):
            dx[i, j] = 0.0


def outputs(rhs, out, task, w, states, y):
    """Fill ``y[m, :, lane]`` with the outputs at ``states[m, :, lane]``.

    Samples inside a step have the memory of its beginning; here they get their own.
    """
    for m in range(task.times.size):
        for j in range(w.t.size):
            w.t[j] = task.times[m]
            for i in range(w.u.shape[0]):
                w.u[i, j] = task.inputs[i, m]
        if task.memory.size:
            rhs(w.t, states[m], w.u, task.p, w.dx_ahead, w.g)
            for i in range(task.memory.size):
                for j in range(w.t.size):
                    states[m, task.memory[i], j] = w.g[task.corners + i, j]
        out(w.t, states[m], w.u, task.p, y[m])
