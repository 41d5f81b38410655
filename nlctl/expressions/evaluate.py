"""The values of expressions, by NumPy: for single points, and as the reference of other readers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from .graph import LINEAR, OF_FACTORS, Expr, Untraceable, needed, numpy_function
from .linear_systems import values as of_linear_system


def evaluate_expressions(
    results: Iterable[Expr],
    arrays: Mapping[str, np.ndarray],
    searches: Mapping[str, Callable[[np.ndarray], np.ndarray]] | None = None,
) -> list[np.ndarray]:
    """Return the values of expressions."""
    values: dict[Expr, np.ndarray] = {}
    results = list(results)
    nodes, kept = needed(results), set(results)
    last = {arg: node for node in nodes for arg in node.args}  # where it is read last
    with np.errstate(all="ignore"):  # infinity and NaN travel, as they do in machine code
        for node in nodes:
            values[node] = value_of(node, [values[arg] for arg in node.args], arrays, searches)
            for arg in node.args:
                if last[arg] is node and arg not in kept:
                    values.pop(arg, None)
    return [values[expr] for expr in results]


def value_of(
    node: Expr,
    parts: list[np.ndarray],
    arrays: Mapping[str, np.ndarray],
    searches: Mapping[str, Callable[[np.ndarray], np.ndarray]] | None = None,
) -> np.ndarray:
    """Return the value of one expression from those of its parts."""
    # As `evaluate_expressions`; among `searches` there may be opaque functions as well.
    if node.op in ("call", "solve") and searches and node.data[0] in searches:
        return searches[node.data[0]](_joined(parts, node.data[1]))
    if node.op == "const":
        return np.asarray(node.data)
    if node.op == "table":
        return np.asarray(node.data)[:, None]
    if node.op == "leaf":
        array, start, step = node.data
        rows = [start + step * i for i in range(node.size)] if node.size else start
        return arrays[array][rows]
    if node.op in ("item", *OF_FACTORS):
        return parts[0][node.data]
    if node.op == "slice":
        start, step = node.data
        return parts[0][[start + step * i for i in range(node.size or 1)]]
    if node.op == "concat":
        return _joined(parts, node.data)
    if node.op in LINEAR:
        return of_linear_system(node, _joined(parts, node.data[1]))
    if node.op == "sum":
        return parts[0].sum(axis=0)
    if node.op in ("call", "solve"):
        raise Untraceable(f"{node.data[0]} is not an expression: it has no value by NumPy alone")
    return numpy_function(node.op)(*parts)


def _joined(parts: list[np.ndarray], lengths: Iterable[int]) -> np.ndarray:
    points = np.broadcast_shapes((1,), *(part.shape[-1:] for part in parts))
    rows = [np.broadcast_to(p, (n, *points)) for p, n in zip(parts, lengths, strict=True)]
    return np.concatenate([np.zeros((0, *points)), *rows])
