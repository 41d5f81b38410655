"""Gaussian elimination without a branch: of numbers, and of what stands for them in tracing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

__all__ = ["SINGULAR", "largest_magnitude", "linear_solution"]

SINGULAR = 1e-7  # relative to the largest entry: a solution would have lost half of its digits


def largest_magnitude(values: Sequence[Any]) -> Any:
    """Return the largest magnitude; NaN stays NaN."""
    largest = abs(values[0])
    for value in values[1:]:
        largest = np.maximum(largest, abs(value))
    return largest


def linear_solution(matrix: Sequence[Sequence[Any]], b: Sequence[Any]) -> tuple[list[Any], Any]:
    """Return the solution of ``matrix @ x = b``, and whether the matrix is regular.

    Gaussian elimination with partial pivoting: rows are exchanged by choosing their numbers.
    """
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
