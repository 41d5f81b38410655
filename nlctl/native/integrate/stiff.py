"""The stiff method within the integration of a single run."""

from __future__ import annotations

import numba
import numpy as np

from . import rodas5p
from .control import TRIAL
from .state import INNER
from .workspace import evaluate

RELATIVE = 1.5e-8  # square root of the machine precision
FLOOR = 1e-4  # a state smaller than this is varied as if it were so large
AHEAD = 1e-4  # part of a step by which time is varied


@numba.njit(**INNER)
def _jacobian(rhs, task, lanes, w):
    """Fill w.jacobian and w.f_t at the start of a step by forward differences."""
    n, lane = w.x.shape[0], lanes[0]
    w.t[0] = lane.t
    for i in range(n):
        w.x_ahead[i, 0] = w.x[i, 0]
    for c in range(n):
        w.x_ahead[c, 0] += RELATIVE * max(abs(w.x[c, 0]), FLOOR)
        delta = w.x_ahead[c, 0] - w.x[c, 0]
        evaluate(rhs, task, lanes, w, w.x_ahead, w.dx_ahead, w.g_ahead)
        for i in range(n):
            w.jacobian[i, c] = (w.dx_ahead[i, 0] - w.k[0, i, 0]) / delta
        w.x_ahead[c, 0] = w.x[c, 0]
    w.t[0] = lane.t + max(AHEAD * lane.step, 1e-12 * abs(lane.t))
    evaluate(rhs, task, lanes, w, w.x, w.dx_ahead, w.g_ahead)
    for i in range(n):
        w.f_t[i] = (w.dx_ahead[i, 0] - w.k[0, i, 0]) / (w.t[0] - lane.t)
    lane.jacobian_at = lane.t


@numba.njit(**INNER)
def _spectral_radius(w):
    """Estimate the largest eigenvalue's magnitude by a few steps of the power method."""
    n = w.jacobian.shape[0]
    v, product, rate = np.zeros(n), np.zeros(n), 0.0
    for i in range(n):
        v[i] = 0.5 + (0.6180339887 * (i + 1)) % 1.0  # like no matrix's null space
    for _ in range(8):
        before, after = 0.0, 0.0
        for i in range(n):
            product[i] = 0.0
            for j in range(n):
                product[i] += w.jacobian[i, j] * v[j]
            before += v[i] * v[i]
            after += product[i] * product[i]
        rate = np.sqrt(after / before)
        if not rate > 0.0:
            return 0.0
        for i in range(n):
            v[i] = product[i] / rate
    return rate


@numba.njit(**INNER)
def stiff_attempt(rhs, task, lanes, w):
    """Try a step of Rodas5P in the only lane."""
    n, lane, h = w.x.shape[0], lanes[0], lanes[0].step
    if lane.jacobian_at != lane.t:
        _jacobian(rhs, task, lanes, w)
        if (lane.stiff + 1) % TRIAL == 0:  # when the methods are compared
            w.rate[0] = _spectral_radius(w)
    for i in range(n):
        for j in range(n):
            w.matrix[i, j] = -w.jacobian[i, j]
        w.matrix[i, i] += 1.0 / (h * rodas5p.GAMMA)
    rodas5p.factorise(w.matrix, w.pivots)
    for s in range(rodas5p.STAGES):
        w.t[0] = lane.t + rodas5p.NODES[s] * h
        for i in range(n):
            total = 0.0
            for j in range(s):
                total += rodas5p.A[s, j] * w.U[j, i]
            w.x_stage[i, 0] = w.x[i, 0] + total
        if s == 0:
            for i in range(n):
                w.dx_ahead[i, 0] = w.k[0, i, 0]
        else:
            evaluate(rhs, task, lanes, w, w.x_stage, w.dx_ahead, w.g_ahead)
        for i in range(n):
            total = 0.0
            for j in range(s):
                total += rodas5p.C[s, j] * w.U[j, i]
            w.U[s, i] = w.dx_ahead[i, 0] + total / h + h * rodas5p.D[s] * w.f_t[i]
        rodas5p.solve(w.matrix, w.pivots, w.U[s])
    for i in range(n):
        w.x_new[i, 0] = w.x_stage[i, 0] + w.U[7, i]
    w.t[0] = lane.t + h
    evaluate(rhs, task, lanes, w, w.x_new, w.k[6], w.g)
    w.error[0] = rodas5p.error_norm(w.x, w.x_new, w.U, task.rtol, task.atol)
