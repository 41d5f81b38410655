"""What holds of many pieces: of tables that have more of them than choices are written out.

A mask says which piece it is, and what holds is a sum in which all others are 0: a loop of machine
code over the table, instead of a choice for each of its pieces.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .arrays import Tracer, scalar, traced
from .graph import Expr, Graph, Untraceable
from .operators import elementwise

_MOST = 65_536  # places; each evaluation looks at all of them
_MOST_INTERVALS = 8192  # their ends are located in time, each by what all compare


def at_place(graph: Graph, k: Tracer, values: np.ndarray) -> Expr:
    """Return the number at a place of a table, which one of the places is."""
    here = elementwise(graph, "eq", k, traced(graph, np.arange(float(values.size))))
    number = _holding(graph, here, values)
    return graph.integer(number) if values.dtype == int else number


def _holding(graph: Graph, here: Tracer, values: np.ndarray) -> Expr:
    """Return the number at the one place where a mask holds; 0 if it holds nowhere."""
    kept = elementwise(graph, "select", here, traced(graph, _checked(values)), 0.0)
    return graph.sum(kept.only, values.size)


def count_below(graph: Graph, name: str, bounds: np.ndarray, x: Expr) -> Expr:
    """Return how many bounds are below x, by the name of that order; NaN is behind all."""
    if bounds.size > _MOST_INTERVALS:
        raise Untraceable("a table with too many places")
    table = traced(graph, _checked(bounds))
    here = elementwise(graph, name, table, scalar(graph, x))
    ones = elementwise(graph, "select", here, 1.0, 0.0)
    count = graph.integer(graph.sum(ones.only, bounds.size))
    return graph.op("select", graph.op("eq", x, x), count, graph.const(bounds.size))


def of_interval(
    graph: Graph, x: Expr, bounds: np.ndarray, columns: Sequence[np.ndarray]
) -> list[Expr]:
    """Return of each column the number of the interval of x: the first below all bounds."""
    if bounds.size > _MOST_INTERVALS:
        raise Untraceable("a table with too many places")
    number, last = scalar(graph, x), float(bounds[-1])
    table = traced(graph, _checked(bounds))
    lower = traced(graph, np.concatenate([[-np.inf], bounds[:-1]]))
    op = lambda name, a, b: elementwise(graph, name, a, b)  # noqa: E731
    here = op("and", op("ge", number, lower), op("lt", number, table))
    is_inside = graph.op("lt", x, graph.const(last))
    return [
        graph.op("select", is_inside, _holding(graph, here, c[:-1]), graph.const(float(c[-1])))
        for c in columns
    ]


def _checked(values: np.ndarray) -> np.ndarray:
    if values.size > _MOST:
        raise Untraceable("a table with too many places")
    if not np.all(np.isfinite(values)):
        raise Untraceable("a long table with places or values that are not finite")
    return values.astype(float)
