"""Linear equations of the stiff method: their structure is sound, their solution LAPACK's."""

from dataclasses import replace
from typing import NamedTuple

import control as ct
import numba
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import special
from stiff_problems import PROBLEMS

import nlctl
from nlctl.expressions.dependence import structure
from nlctl.native.along import Along, derivatives
from nlctl.native.integrate.methods.lu import (
    WHOLE,
    cost,
    elimination,
    factorise,
    jacobian_place,
    multiply,
    solve,
)
from nlctl.native.integrate.state import DIRECTIONS

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them


class Work(NamedTuple):
    """What the linear equations read and write."""

    jacobian_flat: np.ndarray
    columns: np.ndarray
    factors: np.ndarray
    pivots: np.ndarray


@numba.njit(error_model="numpy")
def both(order, diagonal, w, x):
    """Factorise and solve; return whether entries alone were used."""
    only_entries = factorise(order, diagonal, w)
    solve(order, only_entries, w, x)
    return only_entries


@numba.njit(error_model="numpy")
def times(order, jacobian, v, product):
    """Multiply, called from Python."""
    multiply(order, jacobian, v, product)


def arrow(n, full=2):
    """A network's weights, each of which meets a few signals."""
    found = np.eye(n, dtype=bool)
    found[-full:] = found[:, -full:] = True
    return found


def banded(n, width=1):
    i = np.arange(n)
    return abs(i[:, None] - i) <= width


def work(matrix):
    """Return the arrays that hold a Jacobian matrix."""
    n = len(matrix)
    flat = np.zeros((n // DIRECTIONS + 1) * n * DIRECTIONS)
    for i in range(n):
        for j in range(n):
            flat[jacobian_place(i, j, n)] = matrix[i, j]
    return Work(flat, np.zeros((n, n)), np.zeros(n * n), np.zeros(n, dtype=np.int64))


def solved(order, diagonal, matrix, b):
    """Return the solution of (diagonal I - matrix) x = b, and whether entries alone were used."""
    x = b.copy()
    with np.errstate(all="ignore"):
        only_entries = both(order, diagonal, work(matrix), x)
    return x, only_entries


class TestElimination:
    @settings(max_examples=many(60))
    @given(st.integers(1, 12), st.floats(0.0, 0.6), st.integers(0, 10**6))
    def test_it_covers_the_factors_of_any_matrix_of_its_structure(self, n, density, seed):
        """Without pivoting L and U of the permuted matrix have no entry elsewhere."""
        rng = np.random.default_rng(seed)
        where = rng.random((n, n)) < density
        order = elimination(where)
        if not order.order.size:
            return
        assert sorted(order.order) == list(range(n))
        matrix = np.where(where, rng.normal(size=(n, n)), 0.0) + (n + 1.0) * np.eye(n)
        factors = matrix[np.ix_(order.order, order.order)]
        for k in range(n):
            factors[k + 1 :, k] /= factors[k, k]
            factors[k + 1 :, k + 1 :] -= np.outer(factors[k + 1 :, k], factors[k, k + 1 :])
        for k in range(n):
            row, middle = order.column[order.start[k] : order.start[k + 1]], order.pivot[k]
            left, right = np.split(row, [middle - order.start[k]])
            before, now, after = np.split(order.order, [k, k + 1])
            assert right[:1] == now
            assert set(before[factors[k, :k] != 0]) <= set(left) <= set(before)
            assert set(after[factors[k, k + 1 :] != 0]) <= set(right[1:]) <= set(after)
            assert list(order.rank[left]) == sorted(order.rank[left])

    @pytest.mark.parametrize("n", [20, 40, 200])
    def test_arrows_and_bands_are_not_filled(self, n):
        """Markowitz' order creates no entry: there are as many as the matrix has."""
        for where in (arrow(n), banded(n)):
            assert elimination(where).source.size == where.sum()
            assert cost(n, elimination(where)) < cost(n, WHOLE)

    def test_a_full_matrix_is_eliminated_as_a_whole(self):
        assert elimination(np.ones((6, 6), dtype=bool)) is WHOLE


class TestSolution:
    @settings(max_examples=many(60))
    @given(st.sampled_from([arrow, banded]), st.integers(16, 24), st.integers(0, 10**6))
    def test_it_is_lapacks(self, shape, n, seed):
        rng = np.random.default_rng(seed)
        where = shape(n)
        matrix = np.where(where, rng.normal(size=(n, n)), 0.0)
        b, diagonal = rng.normal(size=n), 3.0 * n
        exact = np.linalg.solve(diagonal * np.eye(n) - matrix, b)
        for order in (elimination(where), WHOLE):
            x, only_entries = solved(order, diagonal, matrix, b)
            assert only_entries == (order is not WHOLE)
            np.testing.assert_allclose(x, exact, rtol=1e-12, atol=1e-14)

    @pytest.mark.parametrize("shape", [arrow, banded])
    def test_its_products_are_numpys(self, shape):
        """J v, by entries and as a whole."""
        n, rng = 20, np.random.default_rng(2)
        where = shape(n)
        matrix, v = np.where(where, rng.normal(size=(n, n)), 0.0), rng.normal(size=n)
        for order in (elimination(where), WHOLE):
            found = np.full(n, np.nan)
            times(order, work(matrix).jacobian_flat, v, found)
            np.testing.assert_allclose(found, matrix @ v, rtol=1e-13, atol=1e-14)

    def test_a_small_pivot_is_exchanged(self):
        """1 / h - J has a zero on its diagonal: solved as a whole, with partial pivoting."""
        n = 20
        where, rng = arrow(n), np.random.default_rng(1)
        matrix = np.where(where, rng.normal(size=(n, n)), 0.0)
        matrix[0, 0] = 5.0
        x, only_entries = solved(elimination(where), 5.0, matrix, np.ones(n))
        assert not only_entries
        np.testing.assert_allclose(x, np.linalg.solve(5.0 * np.eye(n) - matrix, np.ones(n)))

    def test_nan_travels(self):
        """Into the solution, wherever it stands."""
        n, order = 20, elimination(arrow(20))
        assert order is not WHOLE
        for i, j in np.argwhere(arrow(n)):
            matrix = np.where(arrow(n), 1.0, 0.0)
            matrix[i, j] = np.nan
            assert np.isnan(solved(order, 50.0, matrix, np.ones(n))[0]).any()


def heat(n):
    """The heat equation with a cubic sink, as users write it."""

    def update(t, x, u, p):
        dx = np.zeros(n)
        dx[1:-1] = x[2:] - 2 * x[1:-1] + x[:-2] - x[1:-1] ** 3
        dx[0], dx[-1] = x[1] - 2 * x[0] + u[0], x[-2] - 2 * x[-1]
        return dx * n**2

    return ct.nlsys(update, lambda t, x, u, p: x, states=n, inputs=1, outputs=n, name="heat")


class TestStructure:
    @pytest.mark.parted
    @pytest.mark.parametrize("name", ["example_1", "example_2", "heat", *PROBLEMS])
    def test_it_holds_every_derivative_that_is_not_0(self, name):
        """At random points; of the two examples most entries are known to be 0."""
        if name == "heat":
            system = heat(40)
        elif name in PROBLEMS:
            update, _, x0 = PROBLEMS[name]
            n = len(x0)
            system = ct.nlsys(update, lambda t, x, u, p: x, states=n, inputs=1, outputs=n)
        else:
            system = nlctl.paper.EXAMPLES[name]()
        compiled = nlctl.compile(system)
        n, m = compiled.system.nstates, compiled.system.ninputs
        where = structure(compiled.equations.pieces("dx"), "x", n)
        rng = np.random.default_rng(0)
        for _ in range(20):
            x, u = rng.normal(size=n), rng.normal(size=m) if m else None
            found = compiled.linearize(x, u, float(rng.random())).A
            assert not np.any((found != 0) & ~where)
        if name == "heat":
            assert np.array_equal(where, banded(40))
        if name.startswith("example"):
            assert where.mean() < 0.3

    def test_a_sum_and_an_opaque_call_depend_on_all(self):
        def update(t, x, u, p):
            return np.concatenate([x[:9] * np.sum(x), [special.ber(x[9])]])

        compiled = nlctl.compile(
            ct.nlsys(update, lambda t, x, u, p: x, states=10, inputs=0, outputs=10)
        )
        assert structure(compiled.equations.pieces("dx"), "x", 10).all()


def test_steps_are_those_of_elimination_as_a_whole():
    """To rounding, of the heat equation and of Example 2."""
    for system, x0 in ((heat(40), np.sin(np.arange(40))), (nlctl.paper.example_2(), None)):
        compiled = nlctl.compile(system)
        made = derivatives(compiled, compiled.parameter_vector())
        assert made is not None
        assert made.elimination.order.size
        x0 = np.asarray(nlctl.initial_state(system), dtype=float) if x0 is None else x0
        runs = []
        for order in (made.elimination, WHOLE):
            kept = compiled.cache.of(Along)
            kept[:] = [replace(kept[0], elimination=order)]
            runs.append(
                nlctl.input_output_response(
                    compiled, [0.0, 0.02], 0, x0, method="rodas5p", step=1e-3, audit=False
                ).states
            )
        np.testing.assert_allclose(*runs, rtol=1e-11, atol=1e-13)
