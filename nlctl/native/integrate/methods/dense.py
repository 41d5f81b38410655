"""The solution inside of the step just tried, whatever method has made it."""

from __future__ import annotations

import numba

from ..evaluate import evaluate
from ..state import INNER, is_stiff
from . import explicit, rodas5p, taylor


@numba.njit(**INNER)
def solution_at(theta, task, lane, w, j, result):
    """Fill column `j` of `result` with the solution at the fraction theta of a lane's step."""
    if is_stiff(lane):
        rodas5p.interpolate(theta, w.x, w.x_new, w.stiff.U, result)
    elif task.taylor.highest:
        taylor.interpolate(theta, lane.step, task.taylor.highest, w.taylor.terms, j, result)
    else:
        explicit.interpolate(theta, lane.step, w.x, w.k, task.pair.B, j, result)


@numba.njit(**INNER)
def events_at_parts(rhs, task, lanes, w, g, m):
    """Fill `g` and `m` at the parts w.inside.part of the steps just tried."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t + w.inside.part[j] * lanes[j].step
        solution_at(w.inside.part[j], task, lanes[j], w, j, w.ahead.x)
    evaluate(rhs, task, lanes, w, w.ahead.x, w.ahead.dx, g, m)
