"""Which entries of an array results depend on, and whether they may jump with them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import numpy as np

from .conditions import JUMPING
from .graph import LINEAR, OF_FACTORS, ORDERS, Expr, needed

_WHOLE = (
    "sum",
    "call",
    "solve",
    *LINEAR,
    *OF_FACTORS,
)  # each element of the result depends on all that goes in


def structure(results: Sequence[tuple[Expr, int]], array: str, count: int) -> np.ndarray:
    """Return which results are made of which entries of an array, whatever the values are."""
    # returns (rows, count).
    depends: dict[Expr, np.ndarray] = {}
    for node in needed([expr for expr, _ in results]):
        depends[node] = _of_node(node, [depends[arg] for arg in node.args], array, count)
    rows = [np.broadcast_to(depends[expr], (size, count)) for expr, size in results]
    return np.concatenate([np.zeros((0, count), dtype=bool), *rows])


def _of_node(node: Expr, parts: list[np.ndarray], array: str, count: int) -> np.ndarray:
    """Return a row for each element of an expression, or one for all of them."""
    nothing = np.zeros((1, count), dtype=bool)
    if node.op == "leaf" and node.data[0] == array:
        _, start, step = node.data
        return np.eye(count, dtype=bool)[start + step * np.arange(node.size or 1)]
    if node.op in _WHOLE:
        return np.any(np.concatenate([nothing, *parts]), axis=0).reshape(1, count)
    if node.op in ("item", "slice"):
        start, step = (node.data, 1) if node.op == "item" else node.data
        whole = np.broadcast_to(parts[0], (node.args[0].size or 1, count))
        return whole[start + step * np.arange(node.size or 1)]
    if node.op == "concat":
        return np.concatenate(
            [np.broadcast_to(p, (n, count)) for p, n in zip(parts, node.data, strict=True)]
        )
    for part in parts:
        nothing = nothing | part
    return nothing


_UNKNOWN = ("call", "solve")  # what they do is not written in the expression


def may_jump(exprs: Iterable[Expr], known: Collection[Expr] = ()) -> bool:
    """Whether expressions have jumps of their own, as far as can be read off."""
    inside = [node for node in needed(exprs, known) if node not in known]
    return any(
        node.op in JUMPING
        or node.op in _UNKNOWN
        or (node.op == "select" and not is_an_extreme(node))
        for node in inside
    )


def is_an_extreme(choice: Expr) -> bool:
    """Whether a choice between two values is by which of them is larger."""
    condition, *values = choice.args
    return condition.op in ORDERS and set(condition.args) == set(values)
