"""The stiff method within the integration of a single run."""

from __future__ import annotations

import numba
import numpy as np

from ...machine.address import call_along, call_point
from ..control import TRIAL, memory_error
from ..state import INNER
from ..workspace import DIFFERENCES, evaluate, inputs_at
from . import lu, rodas5p
from .lu import place

RELATIVE = 1.5e-8  # square root of the machine precision
FLOOR = 1e-4  # a state smaller than this is varied as if it were so large
AHEAD = 1e-4  # part of a step by which time is varied
SHARE = 0.3  # of the defect at the end of a step: what of it may be an error of the solution


@numba.njit(**INNER)
def _jacobian(rhs, point, along, task, lanes, w):
    """Fill w.jacobian and w.f_t at the start of a step.

    Where a derivative is not finite, that of sqrt(x) at 0 for instance, differences are taken.
    """
    lane = lanes[0]
    w.t[0] = lane.t
    if task.derivatives == DIFFERENCES or not _exact(point, along, task, lanes, w):
        _differences(rhs, task, lanes, w)
    lane.jacobian_at = lane.t


@numba.njit(**INNER)
def _exact(point, along, task, lanes, w):
    """Fill them with the derivatives of the equations; return whether all are finite."""
    n, m, lane = w.x.shape[0], w.u.shape[0], lanes[0]
    wide, last = w.finite.size, n // w.finite.size
    if m:
        inputs_at(task, lanes, w)
    for j in range(wide):
        w.t_along[j], w.finite[j] = w.t[0], 0.0
        for i in range(n):
            w.x_along[i, j] = w.x[i, 0]
        for i in range(m):
            w.u_along[i, j] = w.u[i, 0]
    k = min(lane.segment, task.times.size - 2)
    for i in range(task.inputs.shape[0]):  # inputs change as time goes on
        rise = task.inputs[i, k + 1] - task.inputs[i, k]
        w.v[last, n + i, n - last * wide] = rise / (task.times[k + 1] - task.times[k])
    call_point(point, w.t_along, w.x_along, w.u_along, task.c_along)
    total = 0.0
    for part in range(last + 1):
        found = w.jacobian[part]
        call_along(along, w.t_along, w.x_along, w.u_along, task.c_along, w.v[part], found)
        for i in task.memory:
            for j in range(wide):
                found[i, j] = 0.0
        for i in range(n):
            for j in range(wide):
                w.finite[j] += 0.0 * found[i, j]  # NaN of NaN and infinity
    for j in range(wide):
        total += w.finite[j]
    for i in range(n):
        w.f_t[i] = w.jacobian_flat[place(i, n, n)]
    return total == 0.0


@numba.njit(**INNER)
def _differences(rhs, task, lanes, w):
    """Fill w.jacobian and w.f_t by forward differences, of what has no exact derivatives."""
    n, lane = w.x.shape[0], lanes[0]
    for i in range(n):
        w.x_ahead[i, 0] = w.x[i, 0]
    for c in range(n):
        w.x_ahead[c, 0] += RELATIVE * max(abs(w.x[c, 0]), FLOOR)
        delta = w.x_ahead[c, 0] - w.x[c, 0]
        evaluate(rhs, task, lanes, w, w.x_ahead, w.dx_ahead, w.g_ahead)
        for i in range(n):
            w.jacobian_flat[place(i, c, n)] = (w.dx_ahead[i, 0] - w.k[0, i, 0]) / delta
        w.x_ahead[c, 0] = w.x[c, 0]
    w.t[0] = lane.t + max(AHEAD * lane.step, 1e-12 * abs(lane.t))
    evaluate(rhs, task, lanes, w, w.x, w.dx_ahead, w.g_ahead)
    for i in range(n):
        w.f_t[i] = (w.dx_ahead[i, 0] - w.k[0, i, 0]) / (w.t[0] - lane.t)


@numba.njit(**INNER)
def _spectral_radius(task, w):
    """Estimate the largest eigenvalue's magnitude by a few steps of the power method."""
    n = w.x.shape[0]
    v, product, rate = np.zeros(n), np.zeros(n), 0.0
    for i in range(n):
        v[i] = 0.5 + (0.6180339887 * (i + 1)) % 1.0  # like no matrix's null space
    for _ in range(8):
        before, after = 0.0, 0.0
        lu.multiply(task, w.jacobian_flat, v, product)
        for i in range(n):
            before += v[i] * v[i]
            after += product[i] * product[i]
        rate = np.sqrt(after / before)
        if not rate > 0.0:
            return 0.0
        for i in range(n):
            v[i] = product[i] / rate
    return rate


@numba.njit(**INNER)
def _memory_error(rhs, task, lanes, w, only_entries):
    """Return the largest error of what memories would become, over its tolerance.

    Estimated by the defect f - x' of the solution at the end of the step, divided by
    1 / (h gamma) - J.  Most of that is the polynomial's, which is of order 3 in what fast
    components amplify; less than `SHARE` of it (a tenth, measured) is the solution's, of order 4.
    """
    error = w.x_stage_flat  # not needed any more
    rodas5p.end_slope(lanes[0].step, w.x_flat, w.x_new_flat, w.U, error)
    for i in range(error.size):
        error[i] = w.k[w.k.shape[0] - 1, i, 0] - error[i]
    lu.solve(task, only_entries, w, error)
    for i in range(error.size):
        w.x_ahead[i, 0] = w.x_new[i, 0] + error[i]
    evaluate(rhs, task, lanes, w, w.x_ahead, w.dx_ahead, w.g_ahead)
    return SHARE * memory_error(task, w.x, w.g, w.g_ahead, 0)


@numba.njit(**INNER)
def stiff_attempt(rhs, point, along, task, lanes, w):
    """Try a step of Rodas5P in the only lane."""
    n, lane, h = w.x.shape[0], lanes[0], lanes[0].step
    if lane.jacobian_at != lane.t:
        _jacobian(rhs, point, along, task, lanes, w)
        if (lane.stiff + 1) % TRIAL == 0:  # when the methods are compared
            w.rate[0] = _spectral_radius(task, w)
    only_entries = lu.factorise(task, 1.0 / (h * rodas5p.GAMMA), w)
    for s in range(rodas5p.STAGES):
        w.t[0] = lane.t + rodas5p.NODES[s] * h
        if s == 0:
            for i in range(n):
                w.dx_ahead[i, 0] = w.k[0, i, 0]
        else:
            rodas5p.stage(s, w.x_flat, w.U, w.x_stage_flat)
            kept = w.g_inside[rodas5p.KEPT[s]]
            evaluate(rhs, task, lanes, w, w.x_stage, w.dx_ahead, kept)
        rodas5p.right_side(s, h, w.dx_ahead_flat, w.f_t, w.U)
        lu.solve(task, only_entries, w, w.U[s])
    for i in range(n):
        w.x_new[i, 0] = w.x_stage[i, 0] + w.U[7, i]
    w.t[0] = lane.t + h
    evaluate(rhs, task, lanes, w, w.x_new, w.k[w.k.shape[0] - 1], w.g)
    w.error[0] = rodas5p.error_norm(w.x, w.x_new, w.U, task.rtol, task.atol)
    if task.memory.size:
        error = _memory_error(rhs, task, lanes, w, only_entries)
        if not error <= w.error[0]:
            w.error[0] = error
