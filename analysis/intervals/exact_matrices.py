"""Matrices of floats as matrices of rational numbers, of which everything follows exactly."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from flint import fmpq, fmpq_mat

from .normal_form import exact

__all__ = ["exact_matrix", "is_positive_definite", "rational"]


def rational(x: object) -> fmpq:
    """Return a finite number as a rational one of flint."""
    if isinstance(x, fmpq):
        return x
    fraction: Fraction = exact(x)
    return fmpq(fraction.numerator, fraction.denominator)


def exact_matrix(M: np.ndarray) -> fmpq_mat:
    """Return a matrix of finite floats, as it is."""
    rows, columns = M.shape
    return fmpq_mat(rows, columns, [rational(v) for v in M.ravel()])


def is_positive_definite(M: fmpq_mat) -> bool:
    """Whether a symmetric matrix is, by its leading minors."""
    rows = M.tolist()
    return all(
        fmpq_mat(k, k, [v for row in rows[:k] for v in row[:k]]).det() > 0
        for k in range(1, len(rows) + 1)
    )
