"""Eigenvalues and pseudoinverses of small matrices, by formulas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import traced
from ..graph import Graph, Untraceable
from .complex_numbers import ComplexPair
from .table import Facade, constant_value, of

__all__: list[str] = []


def _matrix(graph: Graph, a: object) -> Any:
    array = traced(graph, a)
    if array.ndim != 2:
        raise Untraceable("many matrices at once")
    return array.short()


@of(np.linalg.eigvals)
def eigvals(graph: Graph, a: object) -> Any:
    """Return the eigenvalues of a matrix of two rows, in the order that LAPACK has them."""
    matrix, np_ = _matrix(graph, a), Facade(graph)
    if isinstance(numbers := constant_value(matrix), np.ndarray):
        return np.linalg.eigvals(numbers)
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
def pinv(graph: Graph, a: object, rcond: float = 1e-15) -> Any:
    """Return the pseudoinverse of a matrix of at most two rows or columns."""
    matrix = _matrix(graph, a)
    if isinstance(numbers := constant_value(matrix), np.ndarray):
        return traced(graph, np.linalg.pinv(numbers, rcond))
    wide = matrix.shape[0] < matrix.shape[1]
    columns = list(matrix if wide else matrix.T)
    if len(columns) > 2:
        raise Untraceable("a pseudoinverse of a matrix of more than two rows and columns")
    np_ = Facade(graph)
    rows = _of_lines(np_, columns)
    if len(columns) == 2:
        rows = _of_two(np_, columns[0], columns[1], rows, rcond)
    result = traced(graph, rows)
    return result.T if wide else result


def _of_lines(np_: Facade, columns: Sequence[Any]) -> list[Any]:
    """Return the pseudoinverse of columns that are parallel."""
    square = sum(np_.sum(c * c) for c in columns)
    weight = np_.where(square == 0.0, 0.0, 1.0 / np_.where(square == 0.0, 1.0, square))
    return [c * weight for c in columns]


def _of_two(
    np_: Facade, a: Arithmetic, b: object, parallel: Sequence[Any], rcond: float
) -> list[Any]:
    """Return the pseudoinverse of two columns, by an orthogonal one for each."""
    size = np_.sqrt(np_.sum(a * a))
    first = a / np_.where(size == 0.0, 1.0, size)
    share = np_.sum(first * b)
    apart = b - share * first
    more = np_.sum(first * apart)  # what rounding has left
    share, apart = share + more, apart - more * first
    height = np_.sqrt(np_.sum(apart * apart))
    # of the singular values: their product, and the sum of their squares
    both, squares = size * height, size * size + share * share + height * height
    half = 0.5 * squares
    largest = half + np_.sqrt(np_.maximum(half * half - both * both, 0.0))
    regular = both > rcond * largest
    second = apart / np_.where(regular, height * height, 1.0)
    lines = [(first - share * second) / np_.where(regular, size, 1.0), second]
    return [np_.where(regular, one, other) for one, other in zip(lines, parallel, strict=True)]
