"""Linear equations of more rows than are written out: one operation for factors, one a solution.

    "lu"          the factors of P A = L U with partial pivoting, of an n x n matrix, row by row:
                  n^2 entries of L and U, the order of the rows, the determinant, and whether no
                  pivot is 0
    "lu_solve"    X of A X = B, from the factors and n x m right-hand sides, row by row
    "lu_det"      the determinant, read from the factors
    "lu_regular"  1 where no pivot is 0, otherwise 0, read from the factors

They are all that a graph knows of a matrix as a whole.  As derivative of the factors stands that of
the matrix: X' = A^-1 (B' - A' X) needs no other one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .graph import Expr, Graph

_Pieces = Sequence[tuple[Expr, int]]


def factors(graph: Graph, matrix: _Pieces, n: int) -> Expr:
    """Return the factors of a matrix whose entries are given row by row."""
    args, sizes = zip(*_joined_constants(graph, matrix), strict=True)
    return graph.node("lu", *args, data=(n, sizes), size=n * n + n + 2)


def solution(graph: Graph, lu: Expr, n: int, right: _Pieces) -> Expr:
    """Return the solution for right-hand sides that are given row by row: a vector of n m."""
    count = sum(size for _, size in right)
    args, sizes = zip((lu, lu.size), *_joined_constants(graph, right), strict=True)
    return graph.node("lu_solve", *args, data=((n, count // n), sizes), size=count)


def determinant(graph: Graph, lu: Expr) -> Expr:
    """Return the determinant."""
    return graph.node("lu_det", lu, data=(lu.size or 0) - 2)


def regular(graph: Graph, lu: Expr) -> Expr:
    """Return the condition that no pivot is 0, without which NumPy raises an error."""
    flag = graph.node("lu_regular", lu, data=(lu.size or 0) - 1)
    return graph.op("ne", flag, graph.const(0.0))


def _joined_constants(graph: Graph, pieces: _Pieces) -> list[tuple[Expr, int]]:
    """Return pieces with neighbours that are constant as one table."""
    joined: list[tuple[Expr, int]] = []
    run: list[float] = []
    for expr, size in [*pieces, (None, 0)]:
        if expr is not None and expr.op == "const" and size == 1:
            run.append(float(expr.data))
            continue
        if run:
            one = graph.const(run[0]) if len(run) == 1 else graph.table(run)
            joined.append((one, len(run)))
            run = []
        if expr is not None:
            joined.append((graph.number(expr), size))
    return joined


def changed_solution(graph: Graph, node: Expr, matrix: Expr | None, right: _Pieces) -> Expr:
    """Return A^-1 (B' - A' X) of a solution X, for changes A' and B'."""
    lu, (n, m) = node.args[0], node.data[0]
    if matrix is None:
        return solution(graph, lu, n, right)
    change, rows = graph.joined(list(right)), []
    for i in range(n):
        for j in range(m):
            moved = entry_of_product(graph, matrix, node, (i, j))
            given = graph.item(change, i * m + j)
            rows.append((given if moved is None else graph.op("sub", given, moved), 1))
    return solution(graph, lu, n, rows)


def entry_of_product(graph: Graph, matrix: Expr, node: Expr, place: tuple[int, int]) -> Expr | None:
    """Return an entry of the product of a matrix and a solution; None for 0."""
    (n, m), (i, j) = node.data[0], place
    row = [graph.item(matrix, i * n + k) for k in range(n)]
    there = [k for k, e in enumerate(row) if not (e.op == "const" and e.data == 0.0)]
    if len(there) > _WRITTEN:
        products = graph.op("mul", graph.part(matrix, i * n, 1, n), graph.part(node, j, m, n))
        return graph.sum(products, n)
    total: Expr | None = None
    for k in there:
        term = graph.op("mul", row[k], graph.item(node, k * m + j))
        total = graph.op("add", total, term) if total else term
    return total


_WRITTEN = 8  # entries of a row, other than 0, beyond which their products are a loop


def values(node: Expr, given: np.ndarray) -> np.ndarray:
    """Return the factors or the solution by NumPy, a column for each point."""
    if node.op == "lu":
        return _factors(given, node.data[0])
    n, m = node.data[0]
    count = n * n + n + 2
    lu, order = given[: n * n].reshape(n, n, -1), np.rint(given[n * n : count - 2]).astype(int)
    x = given[count:].reshape(n, m, -1)
    x = np.take_along_axis(x, order[:, None, :], axis=0)
    for i in range(n):
        x[i + 1 :] -= lu[i + 1 :, i, None] * x[None, i]
    for i in reversed(range(n)):
        x[i] /= lu[i, i]
        x[:i] -= lu[:i, i, None] * x[None, i]
    return x.reshape(n * m, -1)


def _factors(given: np.ndarray, n: int) -> np.ndarray:
    points = given.shape[1]
    lu, every = given.reshape(n, n, points).copy(), np.arange(points)
    order = np.repeat(np.arange(n)[:, None], points, axis=1)
    sign, is_regular = np.ones(points), np.ones(points)
    for i in range(n):
        best = i + np.argmax(np.abs(lu[i:, i]), axis=0)
        lu[i], lu[best, :, every] = lu[best, :, every].T, lu[i].T.copy()
        order[i], order[best, every] = order[best, every], order[i].copy()
        sign = np.where(best == i, sign, -sign)
        pivot = lu[i, i]
        is_regular = np.where(pivot == 0.0, 0.0, is_regular)
        lu[i + 1 :, i] /= np.where(pivot == 0.0, 1.0, pivot)
        lu[i + 1 :, i + 1 :] -= lu[i + 1 :, i, None] * lu[None, i, i + 1 :]
    det = sign * np.prod(lu[np.arange(n), np.arange(n)], axis=0)
    return np.concatenate([lu.reshape(n * n, points), order, [det], [is_regular]])
