"""Products of sparse matrices of SciPy's: what is not kept is not multiplied, in SciPy's order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from ..operators import elementwise

_SPELLINGS = ("__matmul__", "dot", "__mul__")


def is_sparse(thing: object) -> bool:
    """Whether an object is a sparse matrix."""
    return type(thing).__module__.startswith("scipy.sparse") and hasattr(thing, "tocoo")


def product_of(graph: Graph, matrix: Any, name: str, other: object) -> Tracer:
    """Return what an operator or method makes of a matrix that is known and of an array."""
    by_elements = name == "__mul__" and "array" in type(matrix).__name__
    if name == "__rmatmul__":
        return sparse_product(graph, matrix.T, traced(graph, other).T).T
    if name not in _SPELLINGS or by_elements or not traced(graph, other).shape:
        raise Untraceable(f"{name} of an object of {type(matrix).__name__}")
    return sparse_product(graph, matrix, traced(graph, other))


def sparse_product(graph: Graph, matrix: Any, array: Tracer) -> Tracer:
    """Return a matrix times a vector, or times the columns of another matrix."""
    if array.ndim > 2 or array.shape[0] != matrix.shape[1]:
        raise Untraceable(f"a product of shapes {matrix.shape} and {array.shape}")
    zero = traced(graph, 0.0) if array.ndim == 1 else traced(graph, np.zeros(array.shape[1]))
    rows = [zero] * matrix.shape[0]
    for i, j, number in _terms(matrix):
        rows[i] = elementwise(graph, "add", rows[i], elementwise(graph, "mul", number, array[j]))
    return traced(graph, rows)


def _terms(matrix: Any) -> Iterator[tuple[int, int, float]]:
    """Yield row, column and number of what a matrix keeps, in the order in which it is added."""
    if matrix.format == "dia":  # (zeros among them: those of NaN are NaN)
        for offset, diagonal in zip(matrix.offsets, matrix.data, strict=True):
            for j in range(max(0, offset), min(len(diagonal), matrix.shape[0] + offset)):
                if j < matrix.shape[1]:
                    yield int(j - offset), j, float(diagonal[j])
        return
    kept = matrix if matrix.format in ("csr", "csc", "coo") else matrix.tocsr()
    places = kept.tocoo()
    yield from zip(map(int, places.row), map(int, places.col), map(float, places.data), strict=True)
