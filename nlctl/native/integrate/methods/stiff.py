"""The stiff method within the integration of a single run."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ...machine.address import call_along, call_point
from ..control import TRIAL, memory_error
from ..evaluate import evaluate, inputs_at
from ..memory import Places1, Places2, Reals1, Reals2, Reals3, with_table
from ..state import DIRECTIONS, INNER
from . import lu, rodas5p
from .lu import Elimination, cost, place

RELATIVE = 1.5e-8  # square root of the machine precision
FLOOR = 1e-4  # a state smaller than this is varied as if it were so large
AHEAD = 1e-4  # part of a step by which time is varied
LEAST_DEFECT = 1e-3  # part of a rate by which it may differ from the solution's slope
ANOTHER = 0.5  # part of what J says: what differs by more is another thing
SHARE = 0.3  # of the defect at the end of a step: what of it may be an error of the solution


UNKNOWN, DIFFERENCES, EXACT = 0, 1, 2  # where the Jacobian is from


class StiffMethod(NamedTuple):
    """How the stiff method has its Jacobian, and solves its linear equations."""

    derivatives: int  # UNKNOWN until it asks for them
    c: Reals2  # what exact ones read besides their arguments
    cost: float  # of a step, in explicit ones
    elimination: Elimination
    table: Places2


class StiffArrays(NamedTuple):
    """What the stiff method works on; empty with several lanes."""

    jacobian: Reals3  # see `jacobian_place`
    jacobian_flat: Reals1
    columns: Reals2  # of 1 / (h gamma) - J, and of its factors
    factors: Reals1
    f_t: Reals1
    defect: Reals1  # how far rates at the end of a step are from the solution's slope
    linear: Reals1  # what J makes of a correction of these
    pivots: Places1
    U: Reals2
    t_along: Reals1  # what exact derivatives are evaluated with, a direction in each column
    x_along: Reals2
    u_along: Reals2
    v: Reals3  # the directions
    finite: Reals1
    table: Places2


def stiff_method(n: int, derivatives: int, c: np.ndarray, order: Elimination) -> StiffMethod:
    """Return the stiff method for n states."""
    cost_of_step = cost(n, order)
    return with_table(
        StiffMethod, derivatives=derivatives, c=c, cost=cost_of_step, elimination=order
    )


def new_stiff(n: int, inputs: int) -> StiffArrays:
    """Return the arrays for n states."""
    jacobian = np.zeros((n // DIRECTIONS + 1, n, DIRECTIONS))
    return with_table(
        StiffArrays,
        jacobian=jacobian,
        jacobian_flat=jacobian.reshape(-1),
        columns=np.zeros((n, n)),
        factors=np.zeros(n * n),
        f_t=np.zeros(n),
        defect=np.zeros(n),
        linear=np.zeros(n),
        pivots=np.zeros(n, dtype=np.int64),
        U=np.zeros((rodas5p.STAGES, n)),
        t_along=np.zeros(DIRECTIONS),
        x_along=np.zeros((n, DIRECTIONS)),
        u_along=np.zeros((inputs, DIRECTIONS)),
        v=directions(n, inputs),
        finite=np.zeros(DIRECTIONS),
    )


def directions(n: int, inputs: int) -> np.ndarray:
    """Return unit vectors of n states and, behind the inputs, of time, `DIRECTIONS` together."""
    v = np.zeros((n // DIRECTIONS + 1, n + inputs + 1, DIRECTIONS))
    for c in range(n + 1):
        v[c // DIRECTIONS, c if c < n else n + inputs, c % DIRECTIONS] = 1.0
    return v


@numba.njit(**INNER)
def _jacobian(rhs, point, along, task, lanes, w):
    """Fill w.stiff.jacobian and w.stiff.f_t at the start of a step."""
    # Where a derivative is not finite, that of sqrt(x) at 0 for instance, differences are taken.
    lane = lanes[0]
    w.t[0] = lane.t
    if task.stiff.derivatives == DIFFERENCES or not _exact(point, along, task, lanes, w):
        _differences(rhs, task, lanes, w)
    lane.jacobian_at = lane.t


@numba.njit(**INNER)
def _exact(point, along, task, lanes, w):
    """Fill them with the derivatives of the equations; return whether all are finite."""
    stiff = w.stiff
    n, m, lane = w.x.shape[0], w.u.shape[0], lanes[0]
    wide, last = stiff.finite.size, n // stiff.finite.size
    if m:
        inputs_at(task, lanes, w)
    for j in range(wide):
        stiff.t_along[j], stiff.finite[j] = w.t[0], 0.0
        for i in range(n):
            stiff.x_along[i, j] = w.x[i, 0]
        for i in range(m):
            stiff.u_along[i, j] = w.u[i, 0]
    k = min(lane.segment, task.times.size - 2)
    for i in range(task.inputs.shape[0]):  # inputs change as time goes on
        rise = task.inputs[i, k + 1] - task.inputs[i, k]
        stiff.v[last, n + i, n - last * wide] = rise / (task.times[k + 1] - task.times[k])
    t, x, u, c = stiff.t_along, stiff.x_along, stiff.u_along, task.stiff.c
    call_point(point, t, x, u, c)
    total = 0.0
    for part in range(last + 1):
        found = stiff.jacobian[part]
        call_along(along, t, x, u, c, stiff.v[part], found)
        for i in task.rows.memory:
            for j in range(wide):
                found[i, j] = 0.0
        for i in range(n):
            for j in range(wide):
                stiff.finite[j] += 0.0 * found[i, j]  # NaN of NaN and infinity
    for j in range(wide):
        total += stiff.finite[j]
    for i in range(n):
        stiff.f_t[i] = stiff.jacobian_flat[place(i, n, n)]
    return total == 0.0


@numba.njit(**INNER)
def _differences(rhs, task, lanes, w):
    """Fill both by forward differences, of what has no exact derivatives."""
    ahead = w.ahead
    n, lane = w.x.shape[0], lanes[0]
    for i in range(n):
        ahead.x[i, 0] = w.x[i, 0]
    for c in range(n):
        ahead.x[c, 0] += RELATIVE * max(abs(w.x[c, 0]), FLOOR)
        delta = ahead.x[c, 0] - w.x[c, 0]
        evaluate(rhs, task, lanes, w, ahead.x, ahead.dx, ahead.g, ahead.m)
        for i in range(n):
            w.stiff.jacobian_flat[place(i, c, n)] = (ahead.dx[i, 0] - w.k[0, i, 0]) / delta
        ahead.x[c, 0] = w.x[c, 0]
    w.t[0] = lane.t + max(AHEAD * lane.step, 1e-12 * abs(lane.t))
    evaluate(rhs, task, lanes, w, w.x, ahead.dx, ahead.g, ahead.m)
    for i in range(n):
        w.stiff.f_t[i] = (ahead.dx[i, 0] - w.k[0, i, 0]) / (w.t[0] - lane.t)


@numba.njit(**INNER)
def _spectral_radius(task, w):
    """Estimate the largest eigenvalue's magnitude by a few steps of the power method."""
    n = w.x.shape[0]
    v, product, rate = np.zeros(n), np.zeros(n), 0.0
    for i in range(n):
        v[i] = 0.5 + (0.6180339887 * (i + 1)) % 1.0  # like no matrix's null space
    for _ in range(8):
        before, after = 0.0, 0.0
        lu.multiply(task.stiff.elimination, w.stiff.jacobian_flat, v, product)
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
def _defect(task, lane, w):
    """Fill w.stiff.defect with f - x' at the end of a step; return whether it counts anywhere."""
    defect, counts = w.stiff.defect, False
    rodas5p.end_slope(lane.step, w.x_flat, w.x_new_flat, w.stiff.U, defect)
    for i in range(defect.size):
        defect[i] = w.k[w.k.shape[0] - 1, i, 0] - defect[i]
        counts |= _is_apart(task, lane, w, i)
    return counts


@numba.njit(**INNER)
def _is_apart(task, lane, w, i):
    """Whether a rate at the end of a step is apart from the slope by what counts in the step."""
    size, rate = abs(w.stiff.defect[i]), w.k[w.k.shape[0] - 1, i, 0]
    if size > LEAST_DEFECT * max(abs(rate), abs(rate - w.stiff.defect[i])):
        return lane.step * size > _tolerance(task, w, i)
    return False


@numba.njit(**INNER)
def _tolerance(task, w, i):
    return rodas5p.tolerance(i, w.x, w.x_new, task.rtol, task.atol)


@numba.njit(**INNER)
def _corrected(rhs, task, lanes, w):
    """Fill w.ahead with what the new state moved by the correction makes of rates and memories."""
    ahead = w.ahead
    for i in range(w.x_stage_flat.size):
        ahead.x[i, 0] = w.x_new[i, 0] + w.x_stage_flat[i]
    evaluate(rhs, task, lanes, w, ahead.x, ahead.dx, ahead.g, ahead.m)


@numba.njit(**INNER)
def _estimate(task, w, only_entries):
    """Make the correction what the defect leads to, divided by 1 / (h gamma) - J."""
    for i in range(w.stiff.defect.size):
        w.x_stage_flat[i] = w.stiff.defect[i]  # that stage is not needed any more
    lu.solve(task.stiff.elimination, only_entries, w.stiff, w.x_stage_flat)


@numba.njit(**INNER)
def _memory_error(rhs, task, lanes, w, only_entries):
    """Return the largest error of what memories would become, over its tolerance."""
    # Most of that is the polynomial's, which is of order 3 in what fast components amplify; less
    # than `SHARE` of it (a tenth, measured) is the solution's, of order 4.
    _estimate(task, w, only_entries)
    _corrected(rhs, task, lanes, w)
    return SHARE * memory_error(task, w.x, w.memories.m, w.ahead.m, 0)


@numba.njit(**INNER)
def _misled(rhs, task, lanes, w, only_entries):
    """Return the largest error, over its tolerance, where J says nothing true of a new state."""
    # At 1e-20 the slope of -sqrt(x) is -5e9. Whatever else pushes, the linear equations of all
    # stages see x stay there, and so does the estimate of the error. But a tolerance away rates
    # are not what J says: how far the defect leads is estimated by what they are instead.
    correction, stiff, largest = w.x_stage_flat, w.stiff, 0.0
    _estimate(task, w, only_entries)
    for i in range(correction.size):
        if _is_apart(task, lanes[0], w, i):
            least = _tolerance(task, w, i)
            correction[i] += np.copysign(max(least - abs(correction[i]), 0.0), correction[i])
    lu.multiply(task.stiff.elimination, stiff.jacobian_flat, correction, stiff.linear)
    _corrected(rhs, task, lanes, w)
    for i in range(correction.size):
        if not _is_apart(task, lanes[0], w, i):
            continue
        change = w.ahead.dx[i, 0] - w.k[w.k.shape[0] - 1, i, 0]
        if abs(change - stiff.linear[i]) > ANOTHER * abs(stiff.linear[i]):
            slope = 1.0 / (lanes[0].step * rodas5p.GAMMA) + abs(change / correction[i])
            largest = max(largest, abs(stiff.defect[i]) / slope / _tolerance(task, w, i))
    return largest


@numba.njit(**INNER)
def stiff_attempt(rhs, point, along, task, lanes, w):
    """Try a step of Rodas5P in the only lane."""
    stiff, order = w.stiff, task.stiff.elimination
    n, lane, h = w.x.shape[0], lanes[0], lanes[0].step
    w.hh[0] = h
    if lane.jacobian_at != lane.t:
        _jacobian(rhs, point, along, task, lanes, w)
        if (lane.stiff + 1) % TRIAL == 0:  # when the methods are compared
            w.rate[0] = _spectral_radius(task, w)
    only_entries = lu.factorise(order, 1.0 / (h * rodas5p.GAMMA), stiff)
    for s in range(rodas5p.STAGES):
        w.t[0] = lane.t + rodas5p.NODES[s] * h
        if s == 0:
            for i in range(n):
                w.ahead.dx[i, 0] = w.k[0, i, 0]
        else:
            rodas5p.stage(s, w.x_flat, stiff.U, w.x_stage_flat)
            g, m = w.events.g_inside[rodas5p.KEPT[s]], w.memories.m_inside[rodas5p.KEPT[s]]
            evaluate(rhs, task, lanes, w, w.x_stage, w.ahead.dx, g, m)
        rodas5p.right_side(s, h, w.ahead.dx_flat, stiff.f_t, stiff.U)
        lu.solve(order, only_entries, stiff, stiff.U[s])
    for i in range(n):
        w.x_new[i, 0] = w.x_stage[i, 0] + stiff.U[7, i]
    w.t[0] = lane.t + h
    evaluate(rhs, task, lanes, w, w.x_new, w.k[w.k.shape[0] - 1], w.events.g, w.memories.m)
    w.error[0] = rodas5p.error_norm(w.x, w.x_new, stiff.U, task.rtol, task.atol)
    counts = _defect(task, lane, w)
    if counts and task.fixed == 0.0 and w.error[0] <= 1.0:
        w.error[0] = max(w.error[0], _misled(rhs, task, lanes, w, only_entries))
    if task.rows.memory.size:
        error = _memory_error(rhs, task, lanes, w, only_entries)
        if not error <= w.error[0]:
            w.error[0] = error
