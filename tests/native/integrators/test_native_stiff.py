"""The stiff method and the choice of the method: order conditions, exact solutions, Radau."""

import functools
from typing import Any

import control as ct
import numpy as np
import pytest
from numba.core import config
from scipy.integrate import solve_ivp
from stiff_problems import hires, robertson, van_der_pol

import nlctl
from nlctl.native.integrate.methods.rodas5p import GAMMA, NODES, A, C, D, H

run: Any = nlctl.input_output_response
needs_jit = pytest.mark.skipif(getattr(config, "DISABLE_JIT", False), reason="thousands of steps")


def system(update, states, **params):
    """Return x' = update(t, x, u, params), compiled, with the states as outputs."""
    return nlctl.compile(
        ct.nlsys(
            update,
            lambda t, x, u, params: x,
            inputs=0,
            outputs=states,
            states=states,
            params=params,
            name="ode",
        )
    )


def attempts(made):
    """Return the number of steps tried."""
    return made.statistics.accepted + made.statistics.rejected


class TestTableau:
    """Rosenbrock conditions (Hairer, Wanner, Solving ODEs II, IV.7) in the usual coefficients."""

    Gamma = np.linalg.inv(np.eye(8) / GAMMA - C)
    alpha = A @ Gamma
    beta = alpha + Gamma
    b = (A[7] + np.eye(8)[7]) @ Gamma

    @classmethod
    def conditions(cls, b):
        """Yield (order, value, wanted) of every tree up to order five."""
        alpha, beta = cls.alpha, cls.beta
        one = np.ones(8)
        a, c = alpha @ one, beta @ one
        yield 1, b @ one, 1
        yield 2, b @ c, 1 / 2
        yield from ((3, b @ a**2, 1 / 3), (3, b @ beta @ c, 1 / 6))
        yield from ((4, b @ a**3, 1 / 4), (4, b @ (a * (alpha @ c)), 1 / 8))
        yield from ((4, b @ beta @ a**2, 1 / 12), (4, b @ beta @ beta @ c, 1 / 24))
        yield from ((5, b @ a**4, 1 / 5), (5, b @ (a**2 * (alpha @ c)), 1 / 10))
        yield from ((5, b @ (alpha @ c) ** 2, 1 / 20), (5, b @ (a * (alpha @ a**2)), 1 / 15))
        yield from ((5, b @ (a * (alpha @ beta @ c)), 1 / 30), (5, b @ beta @ a**3, 1 / 20))
        yield 5, b @ beta @ (a * (alpha @ c)), 1 / 40
        yield 5, b @ beta @ beta @ a**2, 1 / 60
        yield 5, b @ beta @ beta @ beta @ c, 1 / 120

    def test_nodes_and_time_weights_are_row_sums(self):
        """c_i = sum_j alpha_ij and d_i = sum_j gamma_ij."""
        np.testing.assert_allclose(self.alpha.sum(axis=1), NODES, atol=1e-13)
        np.testing.assert_allclose(self.Gamma.sum(axis=1), D, atol=1e-13)

    def test_the_solution_has_order_five(self):
        """All seventeen conditions."""
        for _, value, wanted in self.conditions(self.b):
            assert value == pytest.approx(wanted, abs=1e-12)

    def test_the_embedded_solution_has_order_four_and_not_five(self):
        """U_8 is the difference; a condition of order five must fail."""
        residuals = {order: [] for order in range(1, 6)}
        for order, value, wanted in self.conditions(A[7] @ self.Gamma):
            residuals[order].append(abs(value - wanted))
        assert max(max(residuals[order]) for order in range(1, 5)) < 1e-12
        assert max(residuals[5]) > 1e-4

    @pytest.mark.parametrize("theta", [0.0, 0.2, 0.5, 0.9, 1.0])
    def test_the_dense_output_has_order_four(self, theta):
        """The conditions hold for b(theta) with theta^order on their right."""
        rest = theta * (1 - theta) * (H[0] + theta * H[1] + theta**2 * H[2])
        b = theta * self.b + rest @ self.Gamma
        for order, value, wanted in self.conditions(b):
            if order < 5:
                assert value == pytest.approx(wanted * theta**order, abs=2e-12)

    def test_infinitely_stiff_components_vanish_in_one_step(self):
        """R(infinity) = 1 - b beta^-1 1 = 0: L-stable, for both solutions."""
        for b in (self.b, A[7] @ self.Gamma):
            assert 1 - b @ np.linalg.solve(self.beta, np.ones(8)) == pytest.approx(0, abs=1e-11)


@pytest.fixture(scope="module")
def hyperbola():
    """x' = -x^2 and z' = -2 t z^2 from 1: x = 1 / (1 + t), z = 1 / (1 + t^2)."""
    return system(lambda t, x, u, p: np.array([-x[0] * x[0], -2 * t * x[1] * x[1]]), 2)


class TestOrder:
    """Fixed steps on exact solutions, autonomous and not."""

    @pytest.mark.parametrize(("method", "finest"), [("rodas5p", 64), ("tsit5", 64)])
    def test_the_error_falls_with_the_fifth_power_of_the_step(self, hyperbola, method, finest):
        """At the end of the run."""
        errors = []
        for steps in (finest // 4, finest // 2, finest):
            made = run(hyperbola, [0, 2], 0, [1, 1], method=method, step=2 / steps)
            assert made.statistics.accepted == steps
            errors.append(abs(made.states[:, -1] - [1 / 3, 1 / 5]))
        orders = np.log2(errors[:-1]) - np.log2(errors[1:])
        assert np.all(orders > 4.5), orders

    @pytest.mark.parametrize("method", ["rodas5p", "tsit5"])
    def test_the_dense_output_has_order_four(self, hyperbola, method):
        """Between the steps, the largest error."""
        t, errors = np.linspace(0, 2, 301), []
        for steps in (8, 16, 32):
            made = run(hyperbola, t, 0, [1, 1], method=method, step=2 / steps)
            errors.append(abs(made.states - [1 / (1 + t), 1 / (1 + t**2)]).max(axis=1))
        orders = np.log2(errors[:-1]) - np.log2(errors[1:])
        assert np.all(orders > 3.5), orders

    def test_the_error_follows_the_tolerance(self, hyperbola):
        """Six decades of tolerance, with a margin of ten, by the stiff method."""
        for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
            made = run(hyperbola, [0, 2], 0, [1, 1], method="rodas5p", rtol=rtol, atol=rtol)
            np.testing.assert_allclose(made.states[:, -1], [1 / 3, 1 / 5], atol=10 * rtol)

    def test_steps_grow_as_the_order_says(self, hyperbola):
        """A tolerance 1e5 times tighter takes ten times the steps, not more than 16 times."""
        loose, tight = (
            run(hyperbola, [0, 2], 0, [1, 1], method="rodas5p", rtol=r, atol=r)
            for r in (1e-5, 1e-10)
        )
        assert attempts(tight) < 16 * attempts(loose)


@pytest.fixture(scope="module")
def forced():
    """x' = -k (x - cos t) with a k that falls from `k` to 1 about t = `until`."""

    def update(t, x, u, p):
        k = 1.0 + p["k"] / (1.0 + np.exp(4.0 * (t - p["until"])))
        return np.array([-k * (x[0] - np.cos(t)), x[0] - x[1]])

    return system(update, 2, k=1e6, until=1e3)


class TestStiffness:
    """x' = -k (x - cos t): the solution is smooth, the method must not mind k."""

    @pytest.mark.parametrize("k", [1e2, 1e4, 1e6, 1e9, 1e12])
    def test_the_number_of_steps_does_not_grow_with_k(self, forced, k):
        """And x = (k^2 cos t + k sin t) / (1 + k^2) once the transient is over."""
        made = run(forced, [0, 10.0], 0, [2.0, 0.0], params={"k": k}, method="rodas5p", rtol=1e-7)
        k = k + 1
        exact = (k * k * np.cos(10.0) + k * np.sin(10.0)) / (1 + k * k)
        assert made.states[0, -1] == pytest.approx(exact, abs=1e-6)
        assert attempts(made) < 400

    def test_one_large_step_forgets_a_fast_transient(self, forced):
        """L-stability: an error of 1 is gone after one step of h k = 1e5."""
        made = run(forced, [0, 0.1, 0.2], 0, [2.0, 0.0], method="rodas5p", step=0.1)
        np.testing.assert_allclose(made.states[0, 1:], np.cos([0.1, 0.2]), atol=1e-3)

    def test_the_choice_is_the_stiff_method(self, forced):
        """Auto goes over to it, and needs a small part of the explicit steps."""
        settings = {"params": {"k": 2e4}, "rtol": 1e-6, "atol": 1e-8}
        auto = run(forced, [0, 2.0], 0, [1, 0], **settings)
        assert auto.statistics.stiff
        assert auto.states[0, -1] == pytest.approx(np.cos(2), abs=1e-4)
        explicit = run(
            forced,
            [0, 2.0],
            0,
            [1, 0],
            method="tsit5",
            max_steps=3000,
            ignore_errors=True,
            **settings,
        )
        assert explicit.statistics.status.name == "STEP_LIMIT"
        assert explicit.statistics.time < 1
        assert attempts(auto) < 300

    def test_the_choice_returns_when_stiffness_ends(self, forced):
        """After t = 5 nothing is stiff any more."""
        params = {"k": 1e5, "until": 5.0}
        part = run(forced, [0, 2.0], 0, [1, 0], params=params, rtol=1e-6)
        assert part.statistics.stiff
        whole = run(forced, [0, 40.0], 0, [1, 0], params=params, rtol=1e-6)
        assert not whole.statistics.stiff
        x = (np.cos(40) + np.sin(40)) / 2
        assert whole.states[0, -1] == pytest.approx(x, abs=1e-5)

    def test_a_mild_problem_stays_explicit(self, forced):
        """Nothing is stiff at k = 1."""
        made = run(forced, [0, 10.0], 0, [1, 0], params={"k": 1.0})
        assert not made.statistics.stiff

    def test_rows_that_sum_to_zero_hide_no_stiffness(self):
        """Two tanks with a fast exchange: J (1, 1) = 0, the difference dies with 2 k."""

        def tanks(t, x, u, p):
            flow = 1e5 * (x[0] - x[1])
            return np.array([np.cos(t) - flow, flow])

        made = run(system(tanks, 2), [0, 10.0], 0, [1.0, 0.0], rtol=1e-7)
        assert made.statistics.stiff
        assert attempts(made) < 2000
        assert made.states[:, -1].sum() == pytest.approx(1 + np.sin(10), abs=1e-6)


@functools.cache  # for every method of ours
def radau(update, end, x0):
    """Return the state at the end by SciPy's Radau at a tight tolerance."""
    solution = solve_ivp(
        lambda t, x: update(t, x, None, None), (0, end), x0, "Radau", rtol=1e-11, atol=1e-14
    )
    return solution.y[:, -1]


class TestKnownProblems:
    """Against an implicit Runge-Kutta method of another kind."""

    @pytest.mark.weekly
    @needs_jit
    @pytest.mark.parametrize("method", [pytest.param("rodas5p", marks=pytest.mark.ci), "auto"])
    def test_van_der_pol(self, method):
        """Over a period and more, with its jumps."""
        made = run(
            system(van_der_pol, 2), [0, 2.0], 0, [2.0, 0.0], method=method, rtol=1e-8, atol=1e-10
        )
        np.testing.assert_allclose(
            made.states[:, -1], radau(van_der_pol, 2.0, (2.0, 0.0)), rtol=1e-5
        )
        assert made.statistics.stiff
        assert attempts(made) < 5000

    @pytest.mark.slow
    def test_robertson(self):
        """Mass is conserved, and all three concentrations agree."""
        made = run(
            system(robertson, 3), [0, 4e4], 0, [1, 0, 0], method="rodas5p", rtol=1e-8, atol=1e-13
        )
        np.testing.assert_allclose(made.states[:, -1], radau(robertson, 4e4, (1, 0, 0)), rtol=1e-6)
        np.testing.assert_allclose(made.states.sum(axis=0), 1, atol=1e-11)
        assert attempts(made) < 600

    @pytest.mark.slow
    def test_hires(self):
        """The classic end time, 321.8122."""
        start = [1, 0, 0, 0, 0, 0, 0, 0.0057]
        made = run(
            system(hires, 8), [0, 321.8122], 0, start, method="rodas5p", rtol=1e-8, atol=1e-12
        )
        np.testing.assert_allclose(
            made.states[:, -1], radau(hires, 321.8122, tuple(start)), rtol=2e-6
        )
        assert made.states[6:, -1].sum() == pytest.approx(0.0057, abs=1e-11)
        assert attempts(made) < 2000
