"""SciPy's splines of two variables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import Tracer, mapped, traced
from ..graph import Expr, Graph, Untraceable
from .tables import MOST_PIECES, constant_cells, interval_polynomial


def surface(
    graph: Graph, spline: Any, x: object, y: object, dx: int = 0, dy: int = 0, grid: bool = True
) -> Tracer:
    """Return SciPy's spline of two variables; beyond its ends it is what it is there."""
    if len(spline.tck) != 3:
        raise Untraceable("a spline of two variables that SciPy has not fitted")
    if any(nu >= max(k, 1) for nu, k in zip((dx, dy), spline.degrees, strict=True)):
        raise Untraceable("a derivative of a spline of as many orders as it has degrees")
    tx, ty, c = (np.asarray(v, dtype=float) for v in spline.tck)
    axes = [_axis(t, k, nu) for t, k, nu in zip((tx, ty), spline.degrees, (dx, dy), strict=True)]
    coefficients = c.reshape(axes[0][1].shape[0], -1)
    if coefficients.size > MOST_PIECES:
        raise Untraceable("a spline of two variables with too many pieces")
    xs, ys = (traced(graph, v).short() for v in (x, y))
    if grid:
        xs, ys = xs.reshape(-1, 1), ys.reshape(1, -1)
    elif xs.shape != ys.shape:
        raise Untraceable("a spline of two variables at arrays of different shapes")
    clipped = [mapped(_clipped(graph, t, k), v.elements()) for v, t, k in
               zip((xs, ys), (tx, ty), spline.degrees, strict=True)]  # fmt: skip
    return Tracer(graph, mapped(lambda e, f: _at(graph, axes, coefficients, e, f), *clipped))


_Axis = tuple[np.ndarray, np.ndarray]


def _axis(knots: np.ndarray, degree: int, nu: int) -> _Axis:
    """Return where pieces begin and end, and of each basis function a derivative in each."""
    from scipy.interpolate import BSpline, PPoly

    breaks = np.unique(knots[degree : knots.size - degree])
    count = knots.size - degree - 1
    units = (PPoly.from_spline(BSpline(knots, unit, degree)) for unit in np.eye(count))
    whole = [unit.derivative(nu) for unit in units]
    kept = [int(np.searchsorted(whole[0].x, b, side="right")) - 1 for b in breaks[:-1]]
    return breaks, np.array([p.c[:, kept].T for p in whole])


def _clipped(graph: Graph, knots: np.ndarray, degree: int) -> Callable[[Expr], Expr]:
    low, high = (graph.const(float(v)) for v in (knots[degree], knots[knots.size - degree - 1]))

    def at(e: Expr) -> Expr:
        e = graph.number(e)
        e = graph.op("select", graph.op("lt", e, low), low, e)
        return graph.op("select", graph.op("gt", e, high), high, e)

    return at


def _at(graph: Graph, axes: Sequence[_Axis], c: np.ndarray, x: Expr, y: Expr) -> Expr:
    along_y = np.einsum("ij,jpk->ipk", c, axes[1][1])  # of each row: polynomials in the pieces of y
    rows = [
        interval_polynomial(graph, y, axes[1][0], constant_cells(graph, row)) for row in along_y
    ]
    breaks, basis = axes[0]
    pieces = np.empty(basis.shape[1:], dtype=object)
    for place in np.ndindex(pieces.shape):
        pieces[place] = _weighted(graph, basis[(slice(None), *place)], rows)
    return interval_polynomial(graph, x, breaks, pieces)


def _weighted(graph: Graph, weights: np.ndarray, values: Sequence[Expr]) -> Expr:
    total = graph.const(0.0)
    for weight, value in zip(weights, values, strict=True):
        if weight:
            total = graph.op("add", total, graph.op("mul", graph.const(float(weight)), value))
    return total
