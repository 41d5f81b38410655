"""Matrices by reflections: QR, least squares of full rank; roots of matrices, Lyapunov's equation.

Source: LAPACK's ``dgeqr2`` and ``dlarfg`` for the signs of reflections.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Tracer, traced
from ..constants import constant_value
from ..graph import Graph, Untraceable
from .linear_algebra import solved
from .table import Facade

__all__: list[str] = []

_LARGEST = 6  # rows or columns of what is written out
_DEPENDENT = 1e-10  # part of a column that is left by the others, below which its sign is noise
_WORST = 1e-12  # reciprocal condition number below which a rank is a question of rounding

_Columns = list[list[Any]]


def _limited(graph: Graph, condition: Any) -> None:
    graph.limited(traced(graph, condition).only)


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return functools.reduce(lambda s, pair: s + pair[0] * pair[1], zip(a[1:], b[1:], strict=True),
                            a[0] * b[0])  # fmt: skip


def _columns(graph: Graph, matrix: object) -> _Columns:
    array = traced(graph, matrix).short()
    if array.ndim != 2 or not array.size or max(array.shape) > _LARGEST:
        raise Untraceable("a factorization of many matrices, or of a large one")
    return [list(column) for column in array.T]


def _reflection(np_: Facade, column: Sequence[Any]) -> tuple[Any, Any, list[Any]]:
    """Return LAPACK's reflection that leaves of a column its first entry: that, tau and v."""
    first, *rest = column
    if not rest:
        return first, 0.0, [1.0]
    size = functools.reduce(np_.hypot, rest, np_.abs(0.0 * first))
    is_nothing = size == 0.0
    signed = -np_.copysign(np_.hypot(first, size), first)
    left = np_.where(is_nothing, first, signed)
    tau = np_.where(is_nothing, 0.0, (signed - first) / np_.where(is_nothing, 1.0, signed))
    scale = np_.where(is_nothing, 1.0, first - signed)
    return left, tau, [1.0, *(v / scale for v in rest)]


def _reflected(column: Sequence[Any], tau: Any, v: Sequence[Any], at: int) -> list[Any]:
    share = tau * _dot(v, column[at:])
    return [*column[:at], *(c - share * w for c, w in zip(column[at:], v, strict=True))]


def factored(graph: Graph, matrix: object) -> tuple[_Columns, _Columns]:
    """Return the columns of Q, as many as there are of R, and those of R."""
    np_, columns = Facade(graph), _columns(graph, matrix)
    rows, count = len(columns[0]), min(len(columns), len(columns[0]))
    sizes, turns = [np_.sqrt(_dot(c, c)) for c in columns], []
    for i in range(count):
        left, tau, v = _reflection(np_, columns[i][i:])
        if len(v) > 1:  # of what rounding has left no sign is known
            _limited(graph, np_.abs(left) >= _DEPENDENT * sizes[i])
        columns[i] = [*columns[i][:i], left, *([0.0] * (rows - i - 1))]
        columns[i + 1 :] = [_reflected(c, tau, v, i) for c in columns[i + 1 :]]
        turns.append((i, tau, v))
    q: _Columns = [[1.0 if k == i else 0.0 for k in range(rows)] for i in range(count)]
    for i, tau, v in reversed(turns):
        q = [_reflected([traced(graph, e) for e in c], tau, v, i) for c in q]
    return q, [c[:count] for c in columns]


def qr(graph: Graph, a: object, mode: str = "reduced") -> Any:
    """Return NumPy's factors: orthogonal columns, and a triangle."""
    if mode not in ("reduced", "r"):
        raise Untraceable(f"a factorization of mode {mode!r}")
    q, r = factored(graph, a)
    triangle = traced(graph, r).T
    if mode == "r":
        return triangle
    pair: Any = type(np.linalg.qr(np.eye(1)))
    return pair(traced(graph, q).T, triangle)


def scipys_qr(
    graph: Graph, a: Any, overwrite_a: bool = False, lwork: object = None, mode: str = "full",
    pivoting: bool = False, check_finite: bool = True,
) -> Any:  # fmt: skip
    """Return SciPy's factors."""
    shape = traced(graph, a).shape
    is_reduced = mode == "economic" or (mode == "full" and len(set(shape)) == 1)
    if pivoting or not (is_reduced or mode == "r"):
        raise Untraceable("a factorization with pivots, or of a matrix that is not square")
    q, r = factored(graph, a)
    triangle = traced(graph, r).T
    return (triangle,) if mode == "r" else (traced(graph, q).T, triangle)


def pseudoinverse(graph: Graph, matrix: Tracer) -> Any:
    """Return the pseudoinverse of a matrix of full rank; any other is to be called."""
    wide = matrix.shape[0] < matrix.shape[1]
    q, r = factored(graph, matrix.T if wide else matrix)
    np_, n = Facade(graph), len(r)
    inverse: _Columns = [[0.0] * n for _ in range(n)]  # columns of the inverse triangle
    for j in range(n):
        for i in range(j, -1, -1):
            rest = 1.0 if i == j else 0.0
            for k in range(i + 1, j + 1):
                rest = rest - r[k][i] * inverse[j][k]
            inverse[j][i] = rest / r[i][i]
    sizes = [np_.sqrt(sum(e * e for c in m for e in c)) for m in (r, inverse)]
    _limited(graph, sizes[0] * sizes[1] * _WORST < 1.0)
    lines, across = list(zip(*inverse, strict=True)), list(zip(*q, strict=True))
    whole = traced(graph, [[_dot(line, row) for row in across] for line in lines])
    return whole.T if wide else whole


def root_of_matrix(graph: Graph, a: object) -> Tracer:
    """Return the square root of a matrix of two rows with eigenvalues to the right of 0."""
    if (shape := traced(graph, a).shape) != (2, 2):
        raise Untraceable(f"the square root of a matrix of shape {shape}")
    (p, q), (r, s) = _columns(graph, a)
    np_ = Facade(graph)
    _limited(graph, np_.isfinite(0.0 * p + 0.0 * q + 0.0 * r + 0.0 * s))
    determinant = p * s - q * r
    _limited(graph, np_.logical_and(determinant > 0.0, p + s > 0.0))
    product = np_.sqrt(determinant)
    size = np_.sqrt(p + s + 2.0 * product)
    return traced(graph, [[(p + product) / size, r / size], [q / size, (s + product) / size]])


def lyapunov(graph: Graph, a: object, q: object, discrete: bool = False) -> Any:
    """Return x with a x + x a' = q, or with a x a' - x + q = 0, as one system of equations."""
    matrix = traced(graph, a)
    if not discrete:
        return sylvester(graph, matrix, matrix.T, q)
    whole = traced(graph, np.eye(len(matrix) ** 2)) - Facade(graph).kron(matrix, matrix)
    return _unfolded(graph, whole, traced(graph, q))


def sylvester(graph: Graph, a: object, b: object, q: object) -> Any:
    """Return x with a x + x b = q, as one system of equations."""
    np_, left, right = Facade(graph), traced(graph, a), traced(graph, b)
    ones = [traced(graph, np.eye(len(m))) for m in (right, left)]
    whole = np_.kron(left, ones[0]) + np_.kron(ones[1], right.T)
    return _unfolded(graph, whole, traced(graph, q))


def _unfolded(graph: Graph, whole: Any, q: Tracer) -> Any:
    known, right = constant_value(whole), q.reshape(-1)
    if isinstance(known, np.ndarray):
        return Facade(graph).dot(np.linalg.inv(known), right).reshape(*q.shape)
    return solved(graph, whole, right).reshape(*q.shape)
