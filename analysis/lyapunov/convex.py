"""Convex programs (Clarabel): quadratic costs, linear limits, and matrices >= 0."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

_SOLVED = ("Solved", "AlmostSolved")


@dataclass(frozen=True)
class ConeLimit:
    """A x + s = b with s in a cone: numbers from 0 on, or matrices without negative eigenvalues.

    Shapes: `A` (k, n), `b` (k,); `cone` makes Clarabel's of its module.
    """

    A: np.ndarray
    b: np.ndarray
    cone: Callable[[Any], Any]


def at_most(A: np.ndarray, b: np.ndarray) -> ConeLimit:
    """Return A x <= b, row by row; shapes: `A` (k, n), `b` (k,)."""
    return ConeLimit(A, b, lambda clarabel: clarabel.NonnegativeConeT(len(b)))


def equal(A: np.ndarray, b: np.ndarray) -> ConeLimit:
    """Return A x = b, row by row."""
    # Shapes: `A` (k, n), `b` (k,).
    return ConeLimit(A, b, lambda clarabel: clarabel.ZeroConeT(len(b)))


def semidefinite(A: np.ndarray, b: np.ndarray, size: int) -> ConeLimit:
    """Return that b - A x, a matrix as a vector with its norm, has no negative eigenvalue."""
    # Shapes: `A` (m (m + 1)/2, n), `b` (m (m + 1)/2,), for m = `size`.
    return ConeLimit(A, b, lambda clarabel: clarabel.PSDTriangleConeT(size))


def at_least(parts: Sequence[np.ndarray], low: np.ndarray) -> ConeLimit:
    """Return sum x_i M_i >= low, of symmetric matrices."""
    # Shapes: `parts` n of (m, m), `low` (m, m).
    A = np.column_stack([-upper_triangle(part) for part in parts])
    return semidefinite(A, -upper_triangle(low), len(low))


def upper_triangle(M: np.ndarray) -> np.ndarray:
    """Return a symmetric matrix as a vector with its norm: columns, sqrt(2) off the diagonal."""
    # Shapes: `M` (m, m), result (m (m + 1)/2,).
    column, row = np.tril_indices(len(M))
    return np.where(row == column, 1.0, np.sqrt(2.0)) * M[row, column]


def symmetric_basis(m: int) -> list[np.ndarray]:
    """Return the m (m + 1)/2 matrices with a 1 in one place, and in the one across the diagonal."""
    basis = []
    for column, row in zip(*np.tril_indices(m), strict=True):
        E = np.zeros((m, m))
        E[row, column] = E[column, row] = 1.0
        basis.append(E)
    return basis


def minimizer(
    P: np.ndarray, q: np.ndarray, limits: Sequence[ConeLimit]
) -> tuple[np.ndarray | None, str]:
    """Return the x of the smallest x^T P x / 2 + q^T x, None without one, and the status."""
    # Shapes: `P` (n, n), not negative, `q` and x (n,).
    import clarabel as untyped
    from scipy import sparse

    clarabel: Any = untyped
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    A = sparse.csc_matrix(np.vstack([limit.A for limit in limits]))
    b = np.concatenate([limit.b for limit in limits])
    cones = [limit.cone(clarabel) for limit in limits]
    upper = sparse.csc_matrix(np.triu(P))
    solution = clarabel.DefaultSolver(upper, q, A, b, cones, settings).solve()
    status = str(solution.status)
    return (np.array(solution.x) if status in _SOLVED else None), status
