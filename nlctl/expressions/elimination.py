"""Gaussian elimination without a branch: of numbers, and of what stands for them in tracing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

SINGULAR = 1e-7  # relative to the largest entry: a solution would have lost half of its digits


def largest_magnitude(values: Sequence[Any]) -> Any:
    """Return the largest magnitude; NaN stays NaN."""
    largest = abs(values[0])
    for value in values[1:]:
        largest = np.maximum(largest, abs(value))
    return largest


def linear_solution(matrix: Sequence[Sequence[Any]], b: Sequence[Any]) -> tuple[list[Any], Any]:
    """Return the solution of ``matrix @ x = b``, and whether the matrix is regular."""
    # Gaussian elimination with partial pivoting: rows are exchanged by choosing their numbers.
    n = len(b)
    rows = [[*row, value] for row, value in zip(matrix, b, strict=True)]
    scale = largest_magnitude([1.0, *(entry for row in matrix for entry in row)])
    is_regular = scale < np.inf
    for i in range(n):
        for k in range(i + 1, n):
            swapped = abs(rows[k][i]) > abs(rows[i][i])
            upper = [np.where(swapped, rows[k][j], rows[i][j]) for j in range(i, n + 1)]
            lower = [np.where(swapped, rows[i][j], rows[k][j]) for j in range(i, n + 1)]
            rows[i], rows[k] = [*rows[i][:i], *upper], [*rows[k][:i], *lower]
        is_regular = np.logical_and(is_regular, abs(rows[i][i]) > SINGULAR * scale)
        for k in range(i + 1, n):
            factor = rows[k][i] / rows[i][i]
            below = [rows[k][j] - factor * rows[i][j] for j in range(i + 1, n + 1)]
            rows[k] = [*rows[k][: i + 1], *below]
    x: list[Any] = [0.0] * n
    for i in range(n - 1, -1, -1):
        rest = rows[i][n]
        for j in range(i + 1, n):
            rest = rest - rows[i][j] * x[j]
        x[i] = rest / rows[i][i]
    return x, is_regular


def eliminated(
    np: Any, rows: list[list[Any]], exchanges: list[Any] | None = None
) -> tuple[list[list[Any]], list[Any]]:
    """Return an augmented matrix in upper triangular form, and its pivots, as LAPACK has them."""
    # Partial pivoting: of each column the first of the largest entries comes up, by choosing
    # numbers where the state decides. Conditions under which rows were exchanged are added to
    # `exchanges`.
    n = len(rows)
    for i in range(n):
        _bring_up(np, rows, i, exchanges)
        for k in range(i + 1, n):
            if _is_zero(rows[k][i]):
                continue
            factor = rows[k][i] / rows[i][i]
            below = [
                b if _is_zero(a) else b - factor * a
                for a, b in zip(rows[i][i + 1 :], rows[k][i + 1 :], strict=True)
            ]
            rows[k] = [*rows[k][: i + 1], *below]
    return rows, [rows[i][i] for i in range(n)]


def _bring_up(np: Any, rows: list[list[Any]], i: int, exchanges: list[Any] | None) -> None:
    """Exchange row i with the one that has the first of the largest entries in column i."""
    for k in range(i + 1, len(rows)):
        if _is_zero(rows[k][i]):
            continue
        larger = np.abs(rows[k][i]) > np.abs(rows[i][i])
        pairs = list(zip(rows[i][i:], rows[k][i:], strict=True))
        upper = [np.where(larger, b, a) for a, b in pairs]
        lower = [np.where(larger, a, b) for a, b in pairs]
        rows[i], rows[k] = [*rows[i][:i], *upper], [*rows[k][:i], *lower]
        if exchanges is not None:
            exchanges.append(larger)


def _is_zero(value: object) -> bool:
    """Whether an entry is known to be 0."""
    entry = getattr(value, "only", None)
    return entry is not None and entry.op == "const" and entry.data == 0.0


def substituted(rows: list[list[Any]]) -> list[list[Any]]:
    """Return the solution, a column for each right-hand side, of a matrix in triangular form."""
    n = len(rows)
    x: list[list[Any]] = [[] for _ in range(n)]
    for i in range(n - 1, -1, -1):
        rest = rows[i][n:]
        for j in range(i + 1, n):
            if not _is_zero(rows[i][j]):
                rest = [r - rows[i][j] * v for r, v in zip(rest, x[j], strict=True)]
        x[i] = [r / rows[i][i] for r in rest]
    return x
