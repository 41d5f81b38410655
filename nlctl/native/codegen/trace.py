"""A block's functions on symbols: its time, states, inputs and parameters as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from ...blocks import Block
from ...expressions.arrays import Tracer, leaf_vector, scalar
from ...expressions.graph import Expr, Graph, Untraceable
from ...expressions.operators import elementwise
from ...expressions.trace import trace
from ...upstream.control_internals import current_parameters
from ..parameters import Slot, current_values


def time(graph: Graph) -> Tracer:
    """Return the time."""
    return scalar(graph, graph.leaf("t", 0, None))


def traced_parameters(
    graph: Graph, system: Any, slots: Mapping[str, Slot], p: np.ndarray | None = None
) -> Any:
    """Return the record or dict that a block's functions take, with arrays for the numbers.

    Integers have the values that they have in the parameter vector `p`, or in the block now.
    """
    values = {
        name: _parameter(graph, slots[name], value, p) if name in slots else value
        for name, value in current_values(system).items()
    }
    return type(current_parameters(system))(**values) if isinstance(system, Block) else values


def traced_arguments(graph: Graph, system: Any, slots: Mapping[str, Slot]) -> tuple[Any, ...]:
    """Return what a block's functions take: its time, states, inputs and parameters."""
    x = leaf_vector(graph, "x", 0, (system.nstates or 0,))
    u = leaf_vector(graph, "u", 0, (system.ninputs or 0,))
    return time(graph), x, u, traced_parameters(graph, system, slots)


def _parameter(graph: Graph, slot: Slot, value: Any, p: np.ndarray | None) -> Tracer:
    if slot.kind in "ib" and not slot.shape:  # Python's True is an integer, too
        now = int(value if p is None else p[slot.offset])
        leaf = graph.leaf("p", slot.offset, None, kind="i", value=now)
        return scalar(graph, leaf)
    whole = leaf_vector(graph, "p", slot.offset, slot.shape)
    return elementwise(graph, "ne", whole, 0.0) if slot.kind == "b" else whole


def dependence(system: Any, function: Callable[..., Any], slots: Mapping[str, Slot]) -> np.ndarray:
    """Return which results of a block's function depend on which of its inputs.

    What cannot be traced, or holds for some values of a parameter only, depends on all of them.

    Returns
    -------
    ndarray of bool, shape (noutputs, ninputs)
    """
    found = np.ones((system.noutputs or 0, system.ninputs or 0), dtype=bool)
    graph = Graph()

    try:
        with np.errstate(all="ignore"):
            result = trace(graph, function, lambda: traced_arguments(graph, system, slots))
    except Untraceable:
        return found
    if result.size != system.noutputs or graph.assumptions:
        return found
    long = result.axis is not None
    if long:
        exprs = [(result.only, k if result.only.size else None) for k in range(result.size)]
    else:
        exprs = [(expr, None) for expr in result.cells.flat]
    for row, expr in zip(found, exprs, strict=True):
        row[:] = False
        row[list(_inputs(*expr))] = True
    return found


def _inputs(expr: Expr, element: int | None) -> set[int]:
    """Return the inputs that an element of a vector, or a whole expression, is made of."""
    found: set[int] = set()
    seen: set[tuple[Expr, int | None]] = set()
    waiting = [(expr, element)]
    while waiting:
        part, k = waiting.pop()
        if (part, k) in seen:
            continue
        seen.add((part, k))
        waiting.extend(_parts(part, k))
        if part.op == "leaf" and part.data[0] == "u":
            _, start, step = part.data
            places = range(part.size or 1) if k is None else [k]
            found.update(start + step * i for i in places)
    return found


def _parts(part: Expr, k: int | None) -> Iterator[tuple[Expr, int | None]]:
    """Yield what element k of an expression is made of, or all of it."""
    if part.op == "concat" and k is not None:
        for piece, length in zip(part.args, part.data, strict=True):
            if k < length:
                yield piece, k if piece.size else None
                return
            k -= length
    elif part.op == "item":
        yield part.args[0], part.data
    elif part.op == "slice" and k is not None:
        yield part.args[0], part.data[0] + k * part.data[1]
    else:
        whole = part.op in ("sum", "call")
        yield from ((arg, k if arg.size and not whole else None) for arg in part.args)
