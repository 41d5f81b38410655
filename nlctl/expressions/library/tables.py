"""Tables, splines and polynomials: which interval, and what holds in it."""

from __future__ import annotations

import bisect
import functools
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays import Tracer, mapped, scalar, traced
from ..constants import constant_value
from ..graph import Expr, Graph, Untraceable
from ..many_pieces import at_place, count_below, of_interval
from ..operators import elementwise
from .table import known_numbers, of

__all__: list[str] = []

MOST_PIECES = 256


def _constants(graph: Graph, values: object, what: str) -> np.ndarray:
    """Return what must be known when a function is traced."""
    return _row(constant_value(traced(graph, values)), what)


def _row(known: Any, what: str) -> np.ndarray:
    if isinstance(known, Tracer) or np.ndim(known) != 1:
        raise Untraceable(f"{what} that depend on the state or on parameters")
    return np.asarray(known, dtype=float)


def constant_cells(graph: Graph, values: np.ndarray) -> Any:
    """Return an array of numbers as one of constants."""
    return np.frompyfunc(lambda v: graph.const(float(v)), 1, 1)(values)


def interval_choice(graph: Graph, x: Expr, bounds: Sequence[float], pieces: Sequence[Expr]) -> Expr:
    """Return the piece of the interval of x: the first below all bounds, by halving."""
    if len(pieces) == 1:
        return pieces[0]
    if len(pieces) > MOST_PIECES:
        return of_interval(graph, x, np.asarray(bounds), [_numbers(pieces)])[0]
    middle = len(pieces) // 2
    low = interval_choice(graph, x, bounds[: middle - 1], pieces[:middle])
    high = interval_choice(graph, x, bounds[middle:], pieces[middle:])
    below = graph.op("lt", x, graph.const(float(bounds[middle - 1])))
    return graph.op("select", below, low, high)


def _number(graph: Graph, c: Any) -> Expr:
    return c if isinstance(c, Expr) else graph.const(float(c))


def interval_polynomial(
    graph: Graph, x: Expr, breaks: Any, pieces: Iterable[Iterable[Any]]
) -> Expr:
    """Return the polynomial in x - start of the interval of x, the highest power first."""

    expr = functools.partial(_number, graph)
    pieces = list(pieces)
    if len(pieces) > MOST_PIECES:
        columns = [breaks[:-1], *map(_numbers, zip(*pieces, strict=True))]
        start, *here = of_interval(graph, x, np.asarray(breaks[1:-1]), columns)
        breaks, pieces = [start, None], [here]
    values = []
    for start, (first, *others) in zip(breaks[:-1], pieces, strict=True):
        inside, value = graph.op("sub", x, expr(start)), expr(first)
        for c in others:
            value = graph.op("add", graph.op("mul", value, inside), expr(c))
        values.append(value)
    return interval_choice(graph, x, list(breaks[1:-1]), values)


def _numbers(pieces: Iterable[Any]) -> np.ndarray:
    """Return pieces of a long table as numbers."""
    values = [c.data if isinstance(c, Expr) and c.op == "const" else c for c in pieces]
    if any(isinstance(c, Expr) for c in values):
        raise Untraceable("a long table of values that depend on the state or on parameters")
    return np.array(values, dtype=float)


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
    known = constant_value(traced(graph, xp))
    if period is None and isinstance(known, Tracer):
        return _of_open_table(graph, x, (known, traced(graph, fp)), (left, right))
    places = _row(known, "places of a table")
    given = constant_value(traced(graph, fp))
    is_open = isinstance(given, Tracer)
    values: Any = [graph.number(e) for e in given.elements()] if is_open else given
    if period is not None and places.size == len(values):
        turn = abs(float(known_numbers(period, "periods")))
        x, places, left, right = elementwise(graph, "remainder", x, turn), places % turn, None, None
        order = np.argsort(places)
        around = [order[-1], *order, order[0]]
        values = [values[k] for k in around] if is_open else np.asarray(values)[around]
        places = places[around] + np.array([-turn, *np.zeros(order.size), turn])
    if (
        places.size != len(values)
        or np.any(np.diff(places) < 0)
        or (places.size > 1 and places[0] == places[-1])
    ):
        raise Untraceable("a table whose places do not increase")
    ends = [_number(graph, v) if e is None else traced(graph, e).only for e, v in
            ((left, values[0]), (right, values[-1]))]  # fmt: skip
    array = traced(graph, x)
    return Tracer(
        graph, mapped(lambda e: _linear(graph, e, places, values, *ends), array.elements())
    )


def _linear(
    graph: Graph, x: Expr, places: np.ndarray, values: Sequence[Any], left: Expr, right: Expr
) -> Expr:
    """Return NumPy's formula of an interval: slope (x - x_j) + f_j, and f_j at the last place."""
    op, const = graph.op, graph.const
    x, last = graph.number(x), _number(graph, values[-1])
    widths = np.diff(places)
    wide = widths > 0  # where a place comes twice it jumps, to the last value there
    is_known = isinstance(values, np.ndarray)
    slopes = np.asarray(np.diff(values))[wide] / widths[wide] if is_known else [
        op("div", op("sub", b, a), const(float(width)))
        for (a, b), width in zip(pairwise(values), widths, strict=True) if width > 0
    ]  # fmt: skip
    begins = [value for value, is_wide in zip(values, wide, strict=False) if is_wide]
    pieces = zip(slopes, begins, strict=True)
    breaks = np.append(places[:-1][wide], places[-1])
    value = interval_polynomial(graph, x, breaks, pieces) if places.size > 1 else last
    value = op("select", op("eq", x, const(float(places[-1]))), last, value)
    return beyond_ends(graph, x, (places[0], places[-1]), value, left, right)


def beyond_ends(
    graph: Graph, x: Expr, ends: Sequence[Any], inside: Expr, below: Expr, above: Expr
) -> Expr:
    """Return what is inside of a range, and other values beyond its ends."""
    first, last = _number(graph, ends[0]), _number(graph, ends[-1])
    inside = graph.op("select", graph.op("gt", x, last), above, inside)
    return graph.op("select", graph.op("lt", x, first), below, inside)


def _of_open_table(
    graph: Graph, x: object, table: tuple[Tracer, Tracer], beyond: tuple[object, object]
) -> Tracer:
    """Return NumPy's interpolation in a table that is not known yet: one of parameters."""
    xs, fs = table
    if xs.ndim != 1 or xs.shape != fs.shape or xs.shape[0] < 2:
        raise Untraceable("a table whose places and values are not two rows of one length")
    op, size = graph.op, xs.shape[0]
    rises = scalar(graph, count_below(graph, "le", xs[1:] - xs[:-1], graph.const(0.0)))
    graph.guards.append(elementwise(graph, "eq", rises, 0).only)  # else NumPy finds anything
    below, above = (traced(graph, fs[k] if v is None else v).only
                    for k, v in zip((0, -1), beyond, strict=True))  # fmt: skip

    def at(e: Expr) -> Expr:
        x = graph.number(e)
        k = scalar(graph, op("sub", count_below(graph, "le", xs, x), graph.const(1)))
        k = elementwise(graph, "minimum", elementwise(graph, "maximum", k, 0), size - 2)
        x_0, x_1, f_0, f_1 = (
            at_place(graph, k, part) for part in (xs[:-1], xs[1:], fs[:-1], fs[1:])
        )
        slope = op("div", op("sub", f_1, f_0), op("sub", x_1, x_0))
        value = op("add", op("mul", slope, op("sub", x, x_0)), f_0)
        first, last = xs[0].only, xs[-1].only
        value = op("select", op("ge", x, last), fs[-1].only, value)
        return beyond_ends(graph, x, (first, last), value, below, above)

    return Tracer(graph, mapped(at, traced(graph, x).elements()))


def _place(graph: Graph, x: Expr, bounds: np.ndarray, side: str) -> Expr:
    """Return how many bounds are below x; NaN is behind all."""
    x = graph.number(x)
    name = "lt" if side == "left" else "le"
    if bounds.size > MOST_PIECES:
        return count_below(graph, name, bounds, x)
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
