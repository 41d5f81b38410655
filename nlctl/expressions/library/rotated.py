"""Eigenvalues of symmetric matrices and singular values, by Jacobi's rotations.

After a sweep through all pairs of rows what is left off the diagonal is about the square of what
there was before, so that a few sweeps are enough for every matrix of so few rows.

Source: G. H. Golub and C. F. Van Loan, Matrix Computations (4th ed., 2013), 8.5.2 and 8.6.3.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from .table import Facade

__all__: list[str] = []

_SWEEPS, _MOST = 6, 5


@contextmanager
def in_passes(graph: Graph) -> Iterator[None]:
    """Note that nothing inside is located: whichever way a rotation goes, the values are equal."""
    place, computed = len(graph.passing), set[Any]()
    graph.passing.append(computed)
    yield
    del graph.passing[place:]
    graph.of_passes |= computed


def _rotation(np_: Facade, apart: Any, common: Any) -> tuple[Any, Any]:
    """Return sine and cosine of the smaller angle that makes `common` of two rows 0."""
    root = np_.sqrt(apart * apart + 4.0 * common * common)
    below = apart + np_.copysign(root, apart)
    tangent = 2.0 * common / np_.where(below == 0.0, 1.0, below)
    cosine = 1.0 / np_.sqrt(tangent * tangent + 1.0)
    return tangent * cosine, cosine


def _pairs(count: int) -> Iterator[tuple[int, int]]:
    if count > _MOST:
        raise Untraceable(f"eigenvalues or singular values of a matrix of more than {_MOST} rows")
    for _ in range(_SWEEPS):
        yield from itertools.combinations(range(count), 2)


def symmetric_by_rotations(graph: Graph, matrix: Any) -> Tracer:
    """Return the eigenvalues of a symmetric matrix, of which the lower half is read, in order."""
    count, np_ = len(matrix), Facade(graph)
    a = {(i, j): matrix[max(i, j), min(i, j)] for i in range(count) for j in range(count)}
    with in_passes(graph):
        for p, q in _pairs(count):
            sine, cosine = _rotation(np_, a[q, q] - a[p, p], a[p, q])
            moved = sine / cosine * a[p, q]
            a[p, p], a[q, q] = a[p, p] - moved, a[q, q] + moved
            a[p, q] = a[q, p] = traced(graph, 0.0)
            for r in set(range(count)) - {p, q}:
                one, other = a[r, p], a[r, q]
                a[r, p] = a[p, r] = cosine * one - sine * other
                a[r, q] = a[q, r] = sine * one + cosine * other
    return np_.sort(traced(graph, [a[k, k] for k in range(count)]))


def singular_by_rotations(graph: Graph, matrix: Any) -> Tracer:
    """Return the singular values of a matrix, the largest one first."""
    columns, np_ = list(matrix.T if matrix.shape[0] >= matrix.shape[1] else matrix), Facade(graph)
    with in_passes(graph):
        for p, q in _pairs(len(columns)):
            one, other = columns[p], columns[q]
            apart = np_.sum(other * other) - np_.sum(one * one)
            sine, cosine = _rotation(np_, apart, np_.sum(one * other))
            columns[p] = cosine * one - sine * other
            columns[q] = sine * one + cosine * other
    sizes = [np_.sqrt(np_.sum(column * column)) for column in columns]
    return np_.sort(traced(graph, sizes))[::-1]
