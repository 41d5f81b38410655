"""What enters the equations at a time: inputs from outside, and what leaves transport delays."""

from __future__ import annotations

import numba

from .state import INNER

DEGREE = 5  # of the polynomials that delayed signals are kept as


@numba.njit(**INNER)
def inputs_at(task, lanes, w):
    """Fill w.u with the inputs at the times w.t: linear within a segment of the time grid.

    What leaves transport delays then follows behind them.
    """
    t, times, inputs, u = w.t, task.times, task.inputs, w.u
    for j in range(lanes.size):
        m = min(lanes[j].segment, times.size - 2)  # a lane that has finished is not moved on
        share = (t[j] - times[m]) / (times[m + 1] - times[m])
        for i in range(inputs.shape[0]):
            first, last = inputs[i, m], inputs[i, m + 1]  # exact at both, and where they are equal
            u[i, j] = last if share == 1.0 else first + share * (last - first)
    for i in range(task.delays.shape[0]):
        for j in range(lanes.size):
            u[inputs.shape[0] + i, j] = past_value(task, w, i, j, t[j])


@numba.njit(**INNER)
def past_value(task, w, i, j, t):
    """Return what leaves line `i` of a lane at time t.

    Of the polynomials between two breaks only, so that rounding never reads the other side.
    """
    s = t - task.delays[i, j]
    low, high = w.first[i, j], w.kept[j] - 1
    if w.next[i, j] >= 0:
        high = w.next[i, j] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if w.past_t[middle, j] <= s:
            low = middle
        else:
            high = middle - 1
    z = 2.0 * (s - w.past_t[low, j]) / w.past_h[low, j] - 1.0
    z = min(max(z, -1.0 - 1e-6), 1.0 + 1e-6)  # what looks ahead of a step sees it standing still
    value = w.past[low, i, DEGREE, j]
    for n in range(DEGREE - 1, -1, -1):
        value = value * z + w.past[low, i, n, j]
    return value
