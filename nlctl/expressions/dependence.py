"""Which results depend on what, and how: the structure of a Jacobian matrix, what is affine."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence

import numpy as np

from .graph import LINEAR, OF_FACTORS, Expr, needed

# each element of the result depends on all that goes in
_WHOLE = ("sum", "call", "solve", *LINEAR, *OF_FACTORS)
ADDITIVE = ("add", "sub", "neg", "sum", "item", "slice", "concat")  # in what they are made of


def rows_read(leaf: Expr) -> list[int]:
    """Return the rows of its array that a leaf reads."""
    _, start, step = leaf.data
    return [start + step * i for i in range(leaf.size or 1)]


def reads(exprs: Iterable[Expr], array: str, rows: Collection[int]) -> bool:
    """Whether expressions are made of some rows of an array."""
    leaves = (node for node in needed(exprs) if node.op == "leaf" and node.data[0] == array)
    return any(row in rows for leaf in leaves for row in rows_read(leaf))


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


def affine(expr: Expr, leaf: Expr) -> bool:
    """Whether an expression is a + b v for all values, as it is written."""
    for node, by in dependent_nodes(expr, leaf):
        linear = (
            node.op in ADDITIVE
            or (node.op == "mul" and sum(by) == 1)
            or (node.op == "div" and not by[1])
            or (node.op == "lu_solve" and not by[0])
            or (node.op == "select" and not by[0])
        )
        if not linear:
            return False
    return True


def dependent_nodes(expr: Expr, leaf: Expr) -> Iterator[tuple[Expr, list[bool]]]:
    """Yield what depends on a leaf, inner parts first, and by which arguments it does."""
    depends = {leaf}
    for node in needed([expr]):
        by = [arg in depends for arg in node.args]
        if any(by):
            depends.add(node)
            yield node, by
