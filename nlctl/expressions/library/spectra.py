"""Eigenvalues and pseudoinverses of small matrices, by formulas and rotations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import traced
from ..graph import Graph, Untraceable
from .complex_numbers import ComplexPair
from .table import Facade, of

__all__: list[str] = []

_SWEEPS = {1: 0, 2: 2, 3: 6}  # of rotations, by the number of columns


def _matrix(graph: Graph, a: Any) -> Any:
    array = traced(graph, a)
    if array.ndim != 2:
        raise Untraceable("many matrices at once")
    return array.short()


@of(np.linalg.eigvals)
def eigvals(graph: Graph, a: Any) -> Any:
    """Return the eigenvalues of a matrix of two rows, in the order that LAPACK has them."""
    matrix, np_ = _matrix(graph, a), Facade(graph)
    if matrix.shape != (2, 2):
        raise Untraceable("eigenvalues of a matrix of more than two rows")
    (p, q), (r, s) = matrix
    half = 0.5 * (p - s)
    square = half * half + q * r
    root = np_.sqrt(np_.abs(square))
    first = np_.copysign(root, half) + half  # the larger one in size: nothing cancels
    far = s + first
    near = s - np_.where(first == 0.0, 0.0, q * r / np_.where(first == 0.0, 1.0, first))
    far, near = np_.where(q == 0.0, s, far), np_.where(q == 0.0, p, near)  # of a triangle: its own
    far, near = np_.where(r == 0.0, p, far), np_.where(r == 0.0, s, near)
    is_real = np_.logical_or(square >= 0.0, q * r == 0.0)
    imag = np_.where(is_real, 0.0, root)
    middle = s + half
    real = [np_.where(is_real, far, middle), np_.where(is_real, near, middle)]
    return ComplexPair(graph, traced(graph, real), traced(graph, [imag, -imag]))


@of(np.linalg.pinv)
def pinv(graph: Graph, a: Any, rcond: float = 1e-15) -> Any:
    """Return the pseudoinverse of a matrix of at most three rows or columns."""
    # Its columns are rotated until they are orthogonal; their lengths are the singular values.
    matrix = _matrix(graph, a)
    wide = matrix.shape[0] < matrix.shape[1]
    columns = [list(c) for c in (matrix if wide else matrix.T)]
    if len(columns) not in _SWEEPS:
        raise Untraceable("a pseudoinverse of a matrix of more than three rows and columns")
    np_ = Facade(graph)
    turned, turns = _orthogonal(np_, columns)
    squares = [_product(c, c) for c in turned]
    largest = squares[0]
    for square in squares[1:]:
        largest = np_.maximum(largest, square)
    weights = [np_.where(v > rcond * rcond * largest, 1.0 / v, 0.0 * v) for v in squares]
    rows = [[_product([w * v[i] for w, v in zip(weights, turns, strict=True)],
                      [c[k] for c in turned]) for k in range(len(columns[0]))]
            for i in range(len(columns))]  # fmt: skip
    result = traced(graph, rows)
    return result.T if wide else result


def _orthogonal(np_: Facade, columns: list[list[Any]]) -> tuple[list[list[Any]], list[list[Any]]]:
    """Return columns turned until they are orthogonal, and what the unit vectors turn to."""
    n = len(columns)
    turns = [[1.0 if i == k else 0.0 for i in range(n)] for k in range(n)]
    for _ in range(_SWEEPS[n]):
        for i in range(n):
            for k in range(i + 1, n):
                a, b = columns[i], columns[k]
                c, s = _rotation(np_, _product(a, a), _product(a, b), _product(b, b))
                for kept in (columns, turns):
                    kept[i], kept[k] = (
                        [c * x - s * y for x, y in zip(kept[i], kept[k], strict=True)],
                        [s * x + c * y for x, y in zip(kept[i], kept[k], strict=True)],
                    )
    return columns, turns


def _rotation(np_: Facade, p: Any, q: Any, r: Any) -> tuple[Any, Any]:
    """Return cosine and sine of the smaller rotation that makes [[p, q], [q, r]] diagonal."""
    is_diagonal = q == 0.0
    slope = (r - p) / (2.0 * np_.where(is_diagonal, 1.0, q))
    tangent = np_.copysign(1.0, slope) / (np_.abs(slope) + np_.sqrt(1.0 + slope * slope))
    tangent = np_.where(is_diagonal, 0.0, tangent)
    cosine = 1.0 / np_.sqrt(1.0 + tangent * tangent)
    return cosine, tangent * cosine


def _product(a: Sequence[Any], b: Sequence[Any]) -> Any:
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:], strict=True):
        total = total + x * y
    return total
