"""What is counted or chosen by integers: bins, members of a set, bits."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from ..operators import bits, elementwise, integer_range, mapped_cells, moved_bits
from .shapes import by_moving
from .table import Facade, formula, known_numbers, of

__all__: list[str] = []


@of(np.histogram)
def histogram(
    graph: Graph, a: object, bins: Any = 10, range: Any = None,  # noqa: A002
    density: bool | None = None, weights: object = None,
) -> tuple[Any, Any]:  # fmt: skip
    """Return how many elements lie between edges, the last edge among them."""
    values = traced(graph, a).short().reshape(-1)
    if isinstance(bins, int) and range is None:
        raise Untraceable("a histogram whose edges depend on the state")
    given = bins if isinstance(bins, int | str) else known_numbers(bins, "edges of bins")
    edges = np.histogram_bin_edges(np.zeros(0), given, range)
    beyond = [elementwise(graph, "ge", values, float(edge)) for edge in edges[:-1]]
    inside = [elementwise(graph, "lt", values, float(edge)) for edge in edges[1:-1]]
    inside.append(elementwise(graph, "le", values, float(edges[-1])))
    np_ = Facade(graph)
    share = None if weights is None else traced(graph, weights).short().reshape(-1)
    both = [np_.logical_and(*pair) for pair in zip(beyond, inside, strict=True)]
    counts = traced(
        graph, [np_.sum(b if share is None else np_.where(b, share, 0.0)) for b in both]
    )
    if density:
        counts = counts / np.diff(edges) / np_.sum(counts)
    return counts, traced(graph, edges) if edges.dtype == float else edges


@of(np.bincount)
def bincount(graph: Graph, x: object, weights: object = None, minlength: int = 0) -> Tracer:
    """Return how often each integer occurs, or the sum of the weights there."""
    places = traced(graph, x).short()
    ranges = [integer_range(e) for e in places.values.flat]
    if any(e.kind != "i" for e in places.values.flat) or max(r[1] for r in ranges) >= minlength:
        raise Untraceable("np.bincount whose length depends on the state")
    if min(r[0] for r in ranges) < 0:
        for e in places.values.flat:
            graph.guard(graph.op("ge", e, graph.const(0)), ValueError)
    np_ = Facade(graph)
    share = None if weights is None else traced(graph, weights).short()
    at = [elementwise(graph, "eq", places, k) for k in range(minlength)]
    return traced(graph, [np_.sum(b if share is None else np_.where(b, share, 0.0)) for b in at])


@formula(np.isin)
def isin(
    np: Facade, element: object, test_elements: object, assume_unique: bool = False,
    invert: bool = False,
) -> Any:  # fmt: skip
    """Return which elements are among others."""
    others = traced(np.graph, test_elements).short().reshape(-1)
    if not others.size:
        raise Untraceable("members of an empty set")
    same = [elementwise(np.graph, "eq", element, v) for v in others]
    among = functools.reduce(np.logical_or, same)
    return np.logical_not(among) if invert else among


@of(np.choose)
def choose(graph: Graph, a: Any, choices: Sequence[Any], mode: str = "raise") -> Any:
    """Return of several choices the one that an integer names."""
    places = traced(graph, a)
    if all(e.op == "const" for e in places.values.flat):
        return by_moving(np.choose)(graph, a, choices, mode=mode)
    if mode != "raise" or any(e.kind == "f" for e in places.values.flat):
        raise Untraceable("np.choose with other arguments")
    places = mapped_cells(places, graph.integer)
    for e in places.values.flat:
        low, high = integer_range(e)
        if low < 0:
            graph.guard(graph.op("ge", e, graph.const(0)), ValueError)
        if high >= len(choices):
            graph.guard(graph.op("lt", e, graph.const(len(choices))), ValueError)
    *others, chosen = choices
    for k, choice in reversed(list(enumerate(others))):
        chosen = elementwise(graph, "select", elementwise(graph, "eq", places, k), choice, chosen)
    return traced(graph, chosen)


def _ignoring_nan(name: str, instead: float) -> Callable[..., Any]:
    def written(np: Facade, values: object, axis: Any = None) -> Any:
        array = traced(np.graph, values)
        if axis is not None:
            raise Untraceable(f"{name} along an axis")
        some = np.any(np.equal(array, array)).only
        if some.op != "const":
            np.graph.guard(some, ValueError)
        return getattr(np, name)(np.where(np.equal(array, array), array, instead))

    return written


formula(np.nanargmax)(_ignoring_nan("argmax", -math.inf))
formula(np.nanargmin)(_ignoring_nan("argmin", math.inf))


# -- bits ------------------------------------------------------------------------------------------

for _name, _function in {"and": np.bitwise_and, "or": np.bitwise_or, "xor": np.bitwise_xor}.items():
    of(_function)(lambda graph, a, b, name=_name: bits(graph, name, a, b))
of(np.left_shift)(lambda graph, a, places: moved_bits(graph, a, places, 1))
of(np.right_shift)(lambda graph, a, places: moved_bits(graph, a, places, -1))
of(np.invert)(lambda graph, a: ~traced(graph, a))  # pyright: ignore[reportOperatorIssue]
