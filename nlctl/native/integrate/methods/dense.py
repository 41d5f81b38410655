"""The solution inside of the step just tried, whatever method has made it."""

from __future__ import annotations

import numba

from ..state import INNER, is_stiff
from ..workspace import evaluate
from . import explicit, rodas5p, taylor


@numba.njit(**INNER)
def solution_at(theta, task, lane, w, j, result):
    """Fill column `j` of `result` with the solution at the fraction theta of a lane's step."""
    if is_stiff(lane):
        rodas5p.interpolate(theta, w.x, w.x_new, w.U, result)
    elif task.highest:
        taylor.interpolate(theta, lane.step, task.highest, w.terms, j, result)
    else:
        explicit.interpolate(theta, lane.step, w.x, w.k, task.B, j, result)


@numba.njit(**INNER)
def events_at_parts(rhs, task, lanes, w, g):
    """Fill `g` with switching functions and memories at w.part of the steps just tried."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t + w.part[j] * lanes[j].step
        solution_at(w.part[j], task, lanes[j], w, j, w.x_ahead)
    evaluate(rhs, task, lanes, w, w.x_ahead, w.dx_ahead, g)
