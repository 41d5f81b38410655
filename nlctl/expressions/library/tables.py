"""Tables, splines and polynomials: which interval, and what holds in it."""

from __future__ import annotations

import bisect
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays import Tracer, mapped, traced
from ..graph import Expr, Graph, Untraceable
from ..operators import elementwise
from .table import known_numbers, of

__all__: list[str] = []

MOST_PIECES = 256


def _constants(graph: Graph, values: object, what: str) -> np.ndarray:
    """Return what must be known when a function is traced."""
    array = traced(graph, values)
    elements = array.elements()
    if array.ndim != 1 or any(e.op != "const" for e in elements):
        raise Untraceable(f"{what} that depend on the state or on parameters")
    if array.size > MOST_PIECES:
        raise Untraceable("a table with too many places")
    return np.array([e.data for e in elements], dtype=float)


def constant_cells(graph: Graph, values: np.ndarray) -> Any:
    """Return an array of numbers as one of constants."""
    return np.frompyfunc(lambda v: graph.const(float(v)), 1, 1)(values)


def interval_choice(graph: Graph, x: Expr, bounds: Sequence[float], pieces: Sequence[Expr]) -> Expr:
    """Return the piece of the interval of x: the first below all bounds, by halving."""
    if len(pieces) == 1:
        return pieces[0]
    middle = len(pieces) // 2
    low = interval_choice(graph, x, bounds[: middle - 1], pieces[:middle])
    high = interval_choice(graph, x, bounds[middle:], pieces[middle:])
    below = graph.op("lt", x, graph.const(float(bounds[middle - 1])))
    return graph.op("select", below, low, high)


def interval_polynomial(
    graph: Graph, x: Expr, breaks: Any, pieces: Iterable[Iterable[Any]]
) -> Expr:
    """Return the polynomial in x - start of the interval of x, the highest power first."""

    def expr(c: Any) -> Expr:
        return c if isinstance(c, Expr) else graph.const(float(c))

    values = []
    for start, (first, *others) in zip(breaks[:-1], pieces, strict=True):
        inside, value = graph.op("sub", x, graph.const(float(start))), expr(first)
        for c in others:
            value = graph.op("add", graph.op("mul", value, inside), expr(c))
        values.append(value)
    return interval_choice(graph, x, list(breaks[1:-1]), values)


@of(np.interp)
def interp(
    graph: Graph,
    x: object,
    xp: object,
    fp: object,
    left: object = None,
    right: object = None,
    period: object = None,
) -> Tracer:
    """Return a piecewise linear function, its ends beyond the table."""
    places = _constants(graph, xp, "places of a table")
    values = [graph.number(e) for e in traced(graph, fp).elements()]
    if period is not None and places.size == len(values):
        turn = abs(float(known_numbers(period, "periods")))
        x, places, left, right = elementwise(graph, "remainder", x, turn), places % turn, None, None
        order = np.argsort(places)
        places, values = places[order], [values[k] for k in order]
        places = np.concatenate([places[-1:] - turn, places, places[:1] + turn])
        values = [values[-1], *values, values[0]]
    if places.size != len(values) or np.any(np.diff(places) <= 0):
        raise Untraceable("a table whose places do not increase")
    ends = [v if e is None else traced(graph, e).only for e, v in
            ((left, values[0]), (right, values[-1]))]  # fmt: skip
    array = traced(graph, x)
    return Tracer(
        graph, mapped(lambda e: _linear(graph, e, places, values, *ends), array.elements())
    )


def _linear(
    graph: Graph, x: Expr, places: np.ndarray, values: Sequence[Expr], left: Expr, right: Expr
) -> Expr:
    """Return NumPy's formula of an interval: slope (x - x_j) + f_j, and f_j at the last place."""
    op, const = graph.op, graph.const
    x = graph.number(x)
    slopes = (
        op("div", op("sub", b, a), const(float(width)))
        for (a, b), width in zip(pairwise(values), np.diff(places), strict=True)
    )
    pieces = zip(slopes, values, strict=False)
    value = interval_polynomial(graph, x, places, pieces) if places.size > 1 else values[0]
    value = op("select", op("eq", x, const(float(places[-1]))), values[-1], value)
    value = op("select", op("gt", x, const(float(places[-1]))), right, value)
    return op("select", op("lt", x, const(float(places[0]))), left, value)


def _place(graph: Graph, x: Expr, bounds: np.ndarray, side: str) -> Expr:
    """Return how many bounds are below x; NaN is behind all."""
    x = graph.number(x)
    name = "lt" if side == "left" else "le"
    count = graph.const(0)
    for bound in bounds:
        beyond = graph.op(name, graph.const(float(bound)), x)
        beyond = graph.op("or", beyond, graph.op("ne", x, x))
        count = graph.op("add", count, graph.integer(beyond))
    return count


@of(np.searchsorted)
def searchsorted(
    graph: Graph, a: object, v: object, side: str = "left", sorter: object = None
) -> Tracer:
    """Return where values belong in an ordered table."""
    bounds = _constants(graph, a, "places of a table")
    if sorter is not None or np.any(np.diff(bounds) < 0):
        raise Untraceable("a table that is not in order")
    return Tracer(
        graph, mapped(lambda e: _place(graph, e, bounds, side), traced(graph, v).elements())
    )


@of(np.digitize)
def digitize(graph: Graph, x: object, bins: object, right: bool = False) -> Tracer:
    """Return in which bin values are."""
    return searchsorted(graph, bins, x, "left" if right else "right")


def _bisected(side: str) -> Callable[..., Any]:
    def written(graph: Graph, a: object, x: object) -> Any:
        if traced(graph, x).shape:
            raise Untraceable("a bisection for an array")
        bounds, guard = _constants(graph, a, "places of a table"), traced(graph, x)
        graph.guards.append(graph.op("eq", guard.only, guard.only))  # by halving: not what NaN does
        return searchsorted(graph, bounds, x, side)

    return written


of(bisect.bisect_left)(_bisected("left"))
of(bisect.bisect_right)(_bisected("right"))


@of(np.polynomial.polynomial.polyval)
def polynomial(graph: Graph, x: object, c: object, tensor: bool = True) -> Any:
    """Return a polynomial by its coefficients, the constant first."""
    x, coefficients = traced(graph, x), list(traced(graph, c))
    value = coefficients[-1] + x * 0.0
    for coefficient in reversed(coefficients[:-1]):
        value = coefficient + value * x
    return value
