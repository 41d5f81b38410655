"""A block's functions on symbols: its time, states, inputs and parameters as arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .._block import Block
from ._parameters import Slot, current_values
from ._trace import trace
from ._trace_array import Tracer, number, vector
from ._trace_graph import Expr, Graph, Untraceable
from ._trace_operators import elementwise


def time(graph: Graph) -> Tracer:
    """Return the time."""
    return number(graph, graph.leaf("t", 0, None))


def parameters(graph: Graph, system: Any, slots: Mapping[str, Slot]) -> Any:
    """Return the record or dict that a block's functions take, with arrays for the numbers."""
    values = {
        name: _parameter(graph, slots[name], value) if name in slots else value
        for name, value in current_values(system).items()
    }
    return type(system._current_params)(**values) if isinstance(system, Block) else values


def _parameter(graph: Graph, slot: Slot, value: Any) -> Tracer:
    if slot.kind in "ib" and not slot.shape:  # Python's True is an integer, too
        leaf = graph.leaf("p", slot.offset, None, kind="i", value=int(value))
        return number(graph, leaf)
    whole = vector(graph, "p", slot.offset, slot.shape)
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

    def arguments() -> tuple[Any, ...]:
        x = vector(graph, "x", 0, (system.nstates or 0,))
        u = vector(graph, "u", 0, (system.ninputs or 0,))
        return time(graph), x, u, parameters(graph, system, slots)

    try:
        with np.errstate(all="ignore"):
            result = trace(graph, function, arguments)
    except Untraceable:
        return found
    if result.size != system.noutputs or graph.assumptions:
        return found
    exprs = [result.only] * result.size if result.axis is not None else list(result.cells.flat)
    for row, expr in zip(found, exprs, strict=True):
        row[:] = False
        row[list(_inputs(expr))] = True
    return found


def _inputs(expr: Expr) -> set[int]:
    """Return the indices of the inputs that an expression is made of."""
    found: set[int] = set()
    seen: set[Expr] = set()
    waiting = [expr]
    while waiting:
        part = waiting.pop()
        if part in seen:
            continue
        seen.add(part)
        waiting.extend(part.args)
        if part.op == "leaf" and part.data[0] == "u":
            _, start, step = part.data
            found.update(start + step * k for k in range(part.size or 1))
    return found
