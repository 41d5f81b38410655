"""One step of an explicit Runge-Kutta pair, whatever its tableau, for batched members.

Arrays have the member ("lane") as their last index, so that one loop serves all of them: state
``x[i, lane]``, stages ``k[s, i, lane]``.  What a lane computes never depends on another lane.
Sums over up to seven stages are written out, so that each is one loop; longer ones are right too.
"""

from __future__ import annotations

import numba
import numpy as np

from ...machine.address import call_rhs
from ..evaluate import inputs_at, on_this_side
from ..state import INNER


@numba.njit(**INNER)
def explicit_attempt(rhs, task, lanes, w):
    """Try a step in all lanes: fill w.x_new, the stages, the error and the rate."""
    pair = task.pair
    x, hh, k, count, last = w.x_flat, w.hh, w.k_flat, lanes.size, pair.C.size - 1
    for j in range(count):
        w.h[j] = lanes[j].step
    for i in range(w.x.shape[0]):
        for j in range(count):
            hh[i * count + j] = w.h[j]
    for s in range(1, last + 1):
        for j in range(count):
            w.t[j] = lanes[j].t + pair.C[s] * w.h[j]
        if task.timed.jumps.shape[1]:
            on_this_side(lanes, w)
        if w.u.shape[0]:
            inputs_at(task, lanes, w)
        if s < last:
            combined(x, hh, pair.A, k, s, w.x_stage_flat)
            g, m = w.events.g_inside[pair.kept[s]], w.memories.m_inside[pair.kept[s]]
            call_rhs(rhs, w.t, w.x_stage, w.u, task.p, w.k[s], g, m)
        else:
            combined(x, hh, pair.A, k, s, w.x_new_flat)
            call_rhs(rhs, w.t, w.x_new, w.u, task.p, w.k[s], w.events.g, w.memories.m)
        for i in task.rows.memory:
            for j in range(count):
                w.k[s, i, j] = 0.0
    change, parts = w.ahead.dx_flat, w.ahead.x_flat
    difference(hh, pair.E, k, change)
    weighed(x, w.x_new_flat, change, task.rtol, task.atol, parts)
    errors(w.ahead.x, w.x_new, w.x_stage, w.k, w.error, w.rate)


@numba.njit(**INNER)
def combined(x, h, A, k, s, result):
    """Fill `result` with x + h (A[s, 0] k[0] + ... + A[s, s-1] k[s-1])."""
    # All are flat, over states and lanes, so that SIMD registers are full whatever the number of
    # lanes; one loop per stage keeps every loop free of decisions.
    a0, a1, a2, a3, a4, a5 = A[s, 0], A[s, 1], A[s, 2], A[s, 3], A[s, 4], A[s, 5]
    if s == 1:
        for j in range(x.size):
            result[j] = x[j] + h[j] * (a0 * k[0, j])
    elif s == 2:
        for j in range(x.size):
            result[j] = x[j] + h[j] * (a0 * k[0, j] + a1 * k[1, j])
    elif s == 3:
        for j in range(x.size):
            result[j] = x[j] + h[j] * (a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j])
    elif s == 4:
        for j in range(x.size):
            slope = a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j] + a3 * k[3, j]
            result[j] = x[j] + h[j] * slope
    elif s == 5:
        for j in range(x.size):
            slope = a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j] + a3 * k[3, j] + a4 * k[4, j]
            result[j] = x[j] + h[j] * slope
    elif s == 6:
        for j in range(x.size):
            slope = a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j] + a3 * k[3, j] + a4 * k[4, j]
            result[j] = x[j] + h[j] * (slope + a5 * k[5, j])
    else:
        summed(A[s], k, s, result)
        for j in range(x.size):
            result[j] = x[j] + h[j] * result[j]


@numba.njit(**INNER)
def summed(weights, k, count, result):
    """Fill `result` with the weighted sum of so many stages, one after the other."""
    for j in range(result.size):
        result[j] = weights[0] * k[0, j]
    for i in range(1, count):
        weight = weights[i]
        for j in range(result.size):
            result[j] += weight * k[i, j]


@numba.njit(**INNER)
def difference(h, E, k, result):
    """Fill `result` with the difference of both solutions; all are flat."""
    if E.size == 7:
        e0, e1, e2, e3, e4, e5, e6 = E[0], E[1], E[2], E[3], E[4], E[5], E[6]
        for j in range(h.size):
            slope = e0 * k[0, j] + e1 * k[1, j] + e2 * k[2, j] + e3 * k[3, j]
            slope += e4 * k[4, j] + e5 * k[5, j] + e6 * k[6, j]
            result[j] = h[j] * slope
    else:
        summed(E, k, E.size, result)
        for j in range(h.size):
            result[j] = h[j] * result[j]


@numba.njit(**INNER)
def weighed(x, x_new, change, rtol, atol, result):
    """Fill `result` with the magnitudes of `change` over atol + rtol |x|; all are flat."""
    for j in range(x.size):
        largest = abs(x[j]) if abs(x[j]) > abs(x_new[j]) else abs(x_new[j])
        result[j] = abs(change[j]) / (atol + rtol * largest)


@numba.njit(**INNER)
def errors(parts, x_new, x_stage, k, error, rate):
    """Fill, lane by lane, the error over its tolerance, and the fastest rate seen (1/s)."""
    # The error is the largest of the states' `parts`; it is not finite if a state is not. (A mean
    # would let the many weights of a network hide the few states that move.) The rate |k_m -
    # k_{m-1}| / |x_m - x_{m-1}| of the two stages at the end of the step estimates the largest
    # eigenvalue (Hairer, Wanner, Solving ODEs II, IV.2).
    n, lanes = x_new.shape
    last = k.shape[0] - 1
    for j in range(lanes):
        largest, spoilt, changes, steps = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            part = parts[i, j]
            largest = part if part > largest else largest
            spoilt += 0.0 * (part + x_new[i, j])  # NaN or infinity: no maximum keeps it
            step, change = x_new[i, j] - x_stage[i, j], k[last, i, j] - k[last - 1, i, j]
            changes += change * change
            steps += step * step
        error[j] = largest + spoilt
        rate[j] = np.sqrt(changes / steps) if steps > 0.0 else 0.0


@numba.njit(**INNER)
def interpolate(theta, h, x, k, B, lane, result):
    """Fill column `lane` of `result` with the solution at the fraction theta of its step."""
    if B.shape[0] == 7:
        w0, w1, w2 = _weight(theta, B, 0), _weight(theta, B, 1), _weight(theta, B, 2)
        w3, w4, w5 = _weight(theta, B, 3), _weight(theta, B, 4), _weight(theta, B, 5)
        w6 = _weight(theta, B, 6)
        for i in range(x.shape[0]):
            slope = w0 * k[0, i, lane] + w1 * k[1, i, lane] + w2 * k[2, i, lane]
            slope += w3 * k[3, i, lane]
            slope += w4 * k[4, i, lane]
            slope += w5 * k[5, i, lane]
            slope += w6 * k[6, i, lane]
            result[i, lane] = x[i, lane] + h * slope
    else:
        for i in range(x.shape[0]):
            result[i, lane] = x[i, lane]
        for s in range(B.shape[0]):
            weight = h * _weight(theta, B, s)
            for i in range(x.shape[0]):
                result[i, lane] += weight * k[s, i, lane]


@numba.njit(**INNER)
def _weight(theta, B, s):
    """Return the share of a stage's derivative in the solution at the fraction theta of a step."""
    value = B[s, B.shape[1] - 1]
    for i in range(B.shape[1] - 2, -1, -1):
        value = B[s, i] + theta * value
    return theta * value
