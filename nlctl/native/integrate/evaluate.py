"""The right-hand side at a time: with its inputs, and memories that stand still within a step.

The right-hand side is an address: what calls it is compiled once and not once per diagram.  Here
and in what works on a run's arrays elements are assigned in loops: assigning a slice compiles to
the same loop and to the text of errors that cannot happen, and takes ten times as long to compile.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ..machine.address import call_out, call_rhs
from .delayed import past_value
from .memory import Places2, Reals1, Reals2, with_table
from .state import INNER


class Scratch(NamedTuple):
    """For evaluations besides a step's own, with their results."""

    x: Reals2  # (states, lanes)
    dx: Reals2
    g: Reals2  # see `Events.g`
    m: Reals2  # and `Memories.m`
    x_flat: Reals1  # the same memory as x
    dx_flat: Reals1
    begin: Reals1  # (lanes,): the time from which it is looked ahead (s)
    table: Places2


def new_ahead(n: int, rows: int, memories: int, lanes: int) -> Scratch:
    """Return the arrays for n states, so many rows of g, and of m."""
    x, dx = np.zeros((n, lanes)), np.zeros((n, lanes))
    return with_table(
        Scratch, x=x, dx=dx, g=np.zeros((rows, lanes)), m=np.zeros((memories, lanes)),
        x_flat=x.reshape(-1), dx_flat=dx.reshape(-1), begin=np.zeros(lanes),
    )  # fmt: skip


@numba.njit(**INNER)
def on_this_side(lanes, w):
    """Have functions of t alone seen on the side on which a step lies, also at its ends."""
    for j in range(lanes.size):
        w.t[j] = max(min(w.t[j], lanes[j].left), lanes[j].right)


@numba.njit(**INNER)
def inputs_at(task, lanes, w):
    """Fill w.u with the inputs at the times w.t: linear within a segment of the time grid."""
    # What leaves transport delays then follows behind them, and the inputs' rates where ideal
    # relays ask for them.
    t, times, inputs, u = w.t, task.times, task.inputs, w.u
    for j in range(lanes.size):
        m = min(lanes[j].segment, times.size - 2)  # a lane that has finished is not moved on
        share = (t[j] - times[m]) / (times[m + 1] - times[m])
        for i in range(inputs.shape[0]):
            first, last = inputs[i, m], inputs[i, m + 1]  # exact at both, and where they are equal
            u[i, j] = last if share == 1.0 else first + share * (last - first)
    for i in range(task.lines.delays.shape[0]):
        for j in range(lanes.size):
            u[inputs.shape[0] + i, j] = past_value(task, w, i, j, t[j])
    for j in range(lanes.size):
        input_rates(task, lanes[j].segment, inputs.shape[0] + task.lines.delays.shape[0], u, j)


@numba.njit(**INNER)
def input_rates(task, segment, first, rates, j):
    """Fill rows of `rates` from `first` on, if there are any, with the inputs' slopes."""
    m = min(segment, task.times.size - 2)
    for i in range(min(task.inputs.shape[0], rates.shape[0] - first)):
        rise = task.inputs[i, m + 1] - task.inputs[i, m]
        rates[first + i, j] = rise / (task.times[m + 1] - task.times[m])


@numba.njit(**INNER)
def evaluate(rhs, task, lanes, w, x, dx, g, m):
    """Evaluate the right-hand side at the times w.t; memory stands still within a step."""
    if task.timed.jumps.shape[1]:
        on_this_side(lanes, w)
    if w.u.shape[0]:
        inputs_at(task, lanes, w)
    call_rhs(rhs, w.t, x, w.u, task.p, dx, g, m)
    hold_memories(task, dx)


@numba.njit(**INNER)
def hold_memories(task, dx):
    """Have memories stand still within a step."""
    for i in task.rows.memory:
        for j in range(dx.shape[1]):
            dx[i, j] = 0.0


def outputs(rhs, out, task, w):
    """Fill ``w.y[m, :, lane]`` with the outputs at ``w.samples[m, :, lane]``."""
    # Samples inside a step have the memory of its beginning; here they get their own.
    states, y = w.samples, w.y
    for m in range(task.times.size):
        for j in range(w.t.size):
            w.t[j] = task.times[m]
            for i in range(task.inputs.shape[0]):
                w.u[i, j] = task.inputs[i, m]
            for i in range(task.lines.delays.shape[0]):
                w.u[task.inputs.shape[0] + i, j] = w.past.shown[m, i, j]
            input_rates(task, m, task.inputs.shape[0] + task.lines.delays.shape[0], w.u, j)
        if task.rows.memory.size:
            call_rhs(rhs, w.t, states[m], w.u, task.p, w.ahead.dx, w.ahead.g, w.ahead.m)
            for i in range(task.rows.memory.size):
                for j in range(w.t.size):
                    states[m, task.rows.memory[i], j] = w.ahead.m[i, j]
        call_out(out, w.t, states[m], w.u, task.p, y[m])
