"""What nlctl relies on of SciPy and nobody documents: what its laws are written with."""

import math

import numpy as np
import pytest

from nlctl.upstream import scipy_internals

X = np.array([-1.0, 0.0, 0.25, 2.0])


def test_apply_where_is_a_choice_between_formulas():
    """The first where the condition holds, elsewhere the second one or a number."""
    chosen = scipy_internals.apply_where()
    if chosen is None:
        pytest.skip("this SciPy has none")
    root = chosen(X > 0, X, np.sqrt, fill_value=-1.0)
    np.testing.assert_array_equal(root, [-1.0, -1.0, 0.5, math.sqrt(2.0)])
    both = chosen(X > 0, (X, X), lambda a, b: a + b, lambda a, b: a * b)
    np.testing.assert_array_equal(both, np.where(X > 0, 2 * X, X * X))


def test_lazy_select_takes_the_first_condition_that_holds():
    chosen = scipy_internals.lazy_select()
    if chosen is None:
        pytest.skip("this SciPy has none")
    conditions = [X < 0, X > 1]
    formulas = [lambda a: -a, lambda a: a * a]
    np.testing.assert_array_equal(chosen(conditions, formulas, [X]), [1.0, 0.0, 0.0, 4.0])


def test_the_density_of_beta_is_a_polynomial_for_integers():
    density = scipy_internals.beta_density()
    if density is None:
        pytest.skip("this SciPy has none")
    x = np.array([0.1, 0.5, 0.9])
    np.testing.assert_allclose(density(x, 2.0, 3.0), 12 * x * (1 - x) ** 2, rtol=1e-14)
