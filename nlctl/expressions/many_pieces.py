"""What holds of many pieces: of tables that have more of them than choices are written out.

A mask says which piece it is, and what holds is a sum in which all others are 0: a loop of machine
code over the table, instead of a choice for each of its pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np

from .arrays import Tracer, scalar, traced
from .graph import Expr, Graph, Untraceable
from .operators import elementwise

_MOST = 65_536  # places; each evaluation looks at all of them
_MOST_INTERVALS = 8192  # their ends are located in time, each by what all compare


def at_place(graph: Graph, k: Tracer, values: Tracer | np.ndarray) -> Expr:
    """Return the number at a place of a table, which one of the places is."""
    size = values.shape[0]
    if size > _MOST:
        raise Untraceable("a table with too many places")
    table = values if isinstance(values, Tracer) else traced(graph, values.astype(float))
    here = elementwise(graph, "eq", k, traced(graph, np.arange(float(size))))
    number = _total(graph, elementwise(graph, "select", here, table, 0.0))
    is_whole = not isinstance(values, Tracer) and values.dtype == int
    return graph.integer(number) if is_whole else number


def _total(graph: Graph, vector: Tracer) -> Expr:
    if vector.axis is not None:
        return graph.sum(vector.only, vector.size)
    return reduce(lambda a, b: graph.op("add", a, b), vector.cells.flat)


def count_below(graph: Graph, name: str, bounds: Tracer | np.ndarray, x: Expr) -> Expr:
    """Return how many bounds are below x, by the name of that order; NaN is behind all."""
    size = bounds.shape[0]
    if size > _MOST_INTERVALS:
        raise Untraceable("a table with too many places")
    table = bounds if isinstance(bounds, Tracer) else traced(graph, bounds)
    here = elementwise(graph, name, table, scalar(graph, x))
    count = graph.integer(_total(graph, elementwise(graph, "select", here, 1.0, 0.0)))
    return graph.op("select", graph.op("eq", x, x), count, graph.const(size))


def of_interval(
    graph: Graph, x: Expr, bounds: np.ndarray, columns: Sequence[np.ndarray]
) -> list[Expr]:
    """Return of each column the number of the interval of x: the first below all bounds."""
    k = scalar(graph, count_below(graph, "le", bounds, x))
    return [at_place(graph, k, column) for column in columns]
