"""Convex programs against closed forms."""

import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

from nlctl.analysis.lyapunov.convex import (
    at_least,
    at_most,
    minimizer,
    symmetric_basis,
    upper_triangle,
)

NUMBERS = st.lists(st.floats(-3, 3), min_size=6, max_size=6)


def symmetric(numbers):
    """The symmetric 3 x 3 matrix of six numbers."""
    return np.tensordot(numbers, np.array(symmetric_basis(3)), 1)


@given(NUMBERS, NUMBERS)
def test_the_vector_of_a_matrix_has_its_inner_product(a, b):
    """<A, B> = trace(A B)."""
    A, B = symmetric(a), symmetric(b)
    assert upper_triangle(A) @ upper_triangle(B) == pytest.approx(np.trace(A @ B), abs=1e-9)


@given(NUMBERS)
@settings(max_examples=many(20, part=4))
def test_the_least_trace_above_a_matrix_is_the_sum_of_its_positive_eigenvalues(numbers):
    """Of X >= M and X >= 0 it is that of the positive part of M."""
    M, basis = symmetric(numbers), symmetric_basis(3)
    traces = np.array([np.trace(E) for E in basis])
    limits = [at_least(basis, M), at_least(basis, np.zeros((3, 3)))]
    x, status = minimizer(np.zeros((6, 6)), traces, limits)
    eigenvalues = np.linalg.eigvalsh(M)
    assert status == "Solved"
    assert traces @ x == pytest.approx(eigenvalues[eigenvalues > 0].sum(), abs=1e-5)


@given(st.lists(st.floats(-3, 3), min_size=2, max_size=2))
@settings(max_examples=many(20, part=4))
def test_the_nearest_point_of_a_quadrant_is_cut_off_at_its_edges(point):
    """min |x - p|^2 over x <= 1; a gap of 1e-8 of the cost is 1e-4 of x."""
    p = np.array(point)
    x, _ = minimizer(2 * np.eye(2), -2 * p, [at_most(np.eye(2), np.ones(2))])
    np.testing.assert_allclose(x, np.minimum(p, 1.0), atol=1e-3)


def test_limits_that_exclude_each_other_have_no_minimizer():
    """x <= -1 and -x <= -1."""
    x, status = minimizer(
        np.zeros((1, 1)), np.ones(1), [at_most(np.array([[1.0], [-1.0]]), -np.ones(2))]
    )
    assert x is None
    assert "Infeasible" in status
