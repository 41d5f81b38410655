"""Plants: against linear theory, hand-written right-hand sides, invariants and sector bounds."""

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row
from scipy.integrate import quad

import nlctl
from nlctl.params import equation_arguments

numbers = st.floats(-3, 3)
times = st.floats(0, 30)


def vectors(size):
    return st.lists(numbers, min_size=size, max_size=size).map(np.array)


def slope(plant, t, x, v, params=None):
    """Return the last right-hand side, x_n', after checking that the others are x_2, ..., x_n."""
    derivative = plant.dynamics(t, x, [v], params=params)
    np.testing.assert_array_equal(derivative[:-1], x[1:])
    return derivative[-1]


class TestPureFeedback:
    @pytest.mark.parted
    @pytest.mark.slow
    @pytest.mark.parametrize("order", range(1, 6))
    def test_a_linear_plant_is_a_state_space_system(self, order):
        """With linear f the response is that of the companion form, to the solver's tolerance."""
        roots = -np.arange(1, order + 1) / 2
        a, b = np.poly(roots)[:0:-1], 1.5  # coefficients of x_1, ..., x_n

        def f(x, v):
            return b * v - sum(a[i] * x[i] for i in range(order))

        plant = nlctl.block(nlctl.PureFeedback(order=order, f=f), "plant")
        A = np.vstack([np.eye(order)[1:], -a])
        B, C = b * np.eye(order)[:, -1:], np.vstack([np.eye(order)[:1], np.eye(order)])
        linear = ct.ss(A, B, C, 0)
        t, x0 = np.linspace(0, 4, 21), np.linspace(1, -1, order)
        v = np.sin(2 * t)
        exact = ct.forced_response(linear, t, v, x0)
        run = ct.input_output_response(
            plant, t, v, x0, solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12}
        )
        np.testing.assert_allclose(run.outputs, exact.outputs, atol=1e-7)
        np.testing.assert_allclose(ct.linearize(plant, x0, 0.0).A, A, atol=1e-8)

    @given(x=vectors(3), v=numbers, t=times)
    def test_functions_of_ones_own(self, x, v, t):
        """x_n' = f(x, v) + d(x, t), where x is the whole state; d is 0 unless given."""

        def f(x, v):
            return np.sin(x[0]) * x[1] - x[2] ** 3 + (2 + np.cos(v)) * v

        def d(x, t):
            return x[2] * np.cos(t)

        for given_d, expected in (({}, f(x, v)), ({"d": d}, f(x, v) + d(x, t))):
            plant = nlctl.block(nlctl.PureFeedback(order=3, f=f, **given_d), "plant")
            assert slope(plant, t, x, v) == pytest.approx(expected, rel=1e-12, abs=1e-12)
            np.testing.assert_array_equal(plant.output(t, x, [v]), [x[0], *x])

    def test_initial_state(self):
        """Named states start where they are told, the others from 0."""
        plant = nlctl.PureFeedback(order=3, f=lambda x, v: v, initial={"x2": -0.5, "x3": 2})
        np.testing.assert_array_equal(nlctl.initial_state(nlctl.block(plant, "p")), [0, -0.5, 2])

    def test_states_renamed_by_python_control_keep_their_initial_values(self):
        """`update_names` changes labels, not where a plant starts from."""
        plant = nlctl.block(nlctl.plants.Genesio(), "plant")
        plant.update_names(states=["position", "speed", "acceleration"])
        np.testing.assert_array_equal(nlctl.initial_state(plant), [1, 0, 0])

    @each_row(
        ("changed", "error", "told"),
        [
            (
                {"initial": {"x4": 1.0}},
                nlctl.errors.UnknownNameError,
                "'x4' in initial of PureFeedback",
            ),
            ({"initial": {"y": 1.0}}, nlctl.errors.UnknownNameError, "known: 'x1', 'x2', 'x3'"),
            (
                {"initial": {"x1": np.nan}},
                nlctl.errors.ParameterError,
                "finite initial x1, got nan",
            ),
            ({"order": 0}, nlctl.errors.ParameterError, "PureFeedback needs an order >= 1, got 0"),
            ({"order": 2.0}, nlctl.errors.ParameterError, "order >= 1, got 2.0"),
        ],
    )
    def test_bad_orders_and_initial_states_are_refused(self, changed, error, told):
        """The message names the plant, the state and the value."""
        with pytest.raises(error, match=told):
            nlctl.PureFeedback(**{"order": 3, "f": lambda x, v: v} | changed)


class TestForcedDuffing:
    PLANT = nlctl.block(nlctl.plants.ForcedDuffing(), "plant")

    @given(x=vectors(2), v=numbers, t=times, p1=numbers)
    def test_the_equation_written_out(self, x, v, t, p1):
        """Section 5 of the paper, Example 1."""
        x1, x2 = x
        p, q, w = 0.2 + 0.2 * np.cos(5 * x1), 5 + 0.1 * np.cos(t), 0.5 + 0.1 * np.sin(t)
        h = (1 + 0.1 * np.cos(x1)) * (1 + 0.2 * np.cos(v)) * v
        d = 0.1 * (x1**2 + x2**2) * np.sin(t)
        expected = -p1 * x1 - p * x2 - x1**3 + q * np.cos(w * t) + h + d
        got = slope(self.PLANT, t, x, v, {"plant.p1": p1})
        assert got == pytest.approx(expected, rel=1e-12, abs=1e-11)

    @given(t=times, mean=st.floats(0, 2), ripple=st.floats(-1, 1))
    @settings(max_examples=many(20, part=4))
    def test_the_integral_phase_is_the_integral_of_w(self, t, mean, ripple):
        """Forcing q cos(int_0^t w), by quadrature."""
        phase, _ = quad(lambda s: mean + ripple * np.sin(s), 0, t, epsabs=1e-12, limit=200)
        spec = nlctl.plants.ForcedDuffing(
            integrate_w=True, w_mean=mean, w_ripple=ripple, q_ripple=0
        )
        got = nlctl.block(spec, "plant").dynamics(t, [0, 0], [0.0])[1]
        assert got == pytest.approx(5 * np.cos(phase), abs=1e-9)

    def test_energy_is_conserved_without_damping_and_forcing(self):
        """x2^2 / 2 + p1 x1^2 / 2 + x1^4 / 4 is a constant of the free motion."""
        off = dict.fromkeys(["p_mean", "p_ripple", "q_mean", "q_ripple", "d_amplitude"], 0.0)
        plant = nlctl.block(nlctl.plants.ForcedDuffing(**off, p1=0.7), "plant")
        run = ct.input_output_response(
            plant,
            np.linspace(0, 10, 41),
            0,
            [1.0, 0.5],
            solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12},
        )
        x1, x2 = run.states
        energy = x2**2 / 2 + 0.7 * x1**2 / 2 + x1**4 / 4
        np.testing.assert_allclose(energy, energy[0], rtol=1e-6)
        assert np.ptp(x1) > 1  # it moves

    @given(x=vectors(2), v=st.floats(-60, 60))
    def test_assumption_3(self, x, v):
        """F(x, v) v lies between 0.9 0.8 v^2 and 1.1 1.2 v^2, by the ripples of the gain."""
        check_sector(nlctl.plants.ForcedDuffing(), x, v, 0.9 * 0.8, 1.1 * 1.2)


class TestGenesio:
    PLANT = nlctl.block(nlctl.plants.Genesio(), "plant")

    @given(x=vectors(3), v=numbers, t=times, a=numbers)
    def test_the_equation_written_out(self, x, v, t, a):
        """Section 5 of the paper, Example 2."""
        x1, x2, x3 = x
        h = (2 + np.cos(x1)) * (1 + 0.2 * np.sin(v) ** 2) * v
        expected = -6 * x1 - 3 * x2 - a * x3 + x1**2 + h + np.sin(0.1 * t)
        got = slope(self.PLANT, t, x, v, {"plant.a": a})
        assert got == pytest.approx(expected, rel=1e-12, abs=1e-12)

    def test_linearisation_at_the_origin(self):
        """s^3 + a s^2 + b s + c and an input gain of 2 + cos 0 = 3."""
        for params, c in ((None, 6.0), ({"plant.c": 2.5}, 2.5)):
            linear = ct.linearize(self.PLANT, [0, 0, 0], 0.0, params=params)
            np.testing.assert_allclose(linear.A, [[0, 1, 0], [0, 0, 1], [-c, -3, -1.6]], atol=1e-5)
            np.testing.assert_allclose(linear.B, [[0], [0], [3]], atol=1e-6)
            np.testing.assert_allclose(linear.C, [[1, 0, 0], *np.eye(3)], atol=1e-9)
            np.testing.assert_array_equal(linear.D, np.zeros((4, 1)))

    def test_equilibria_of_the_free_system(self):
        """Without input and disturbance x1^2 = c x1: the origin and (6, 0, 0)."""
        for x1 in (0.0, 6.0):
            rest = self.PLANT.dynamics(3.0, [x1, 0, 0], [0.0], params={"plant.d_amplitude": 0.0})
            np.testing.assert_array_equal(rest, 0.0)

    @given(x=vectors(3), v=st.floats(-60, 60))
    def test_assumption_3(self, x, v):
        """F(x, v) v lies between v^2 and 3 1.2 v^2."""
        check_sector(nlctl.plants.Genesio(), x, v, 1.0, 3 * 1.2)


def check_sector(spec, x, v, low, high):
    """Check low v^2 <= v F(x, v) <= high v^2, (4), for F(x, v) = f(x, v) - f(x, 0)."""
    p, x = equation_arguments(spec), tuple(x)
    work = v * (spec.f(x, v, p) - spec.f(x, 0.0, p))
    rounding = 1e-12 * (1 + abs(v)) * (1 + abs(spec.f(x, 0.0, p)))
    assert low * v**2 - rounding <= work <= high * v**2 + rounding


@pytest.mark.parametrize("spec", [nlctl.plants.ForcedDuffing(), nlctl.plants.Genesio()])
def test_the_update_is_f_plus_d(spec):
    """The two terms of (1) that the analysis takes apart are those that are simulated."""
    x, p = tuple(0.3 * (i + 1) for i in range(len(spec.states))), equation_arguments(spec)
    together = spec.update(1.7, x, (0.8,), p)
    assert together[-1] == spec.f(x, 0.8, p) + spec.d(x, 1.7, p)
    assert spec.d(x, 1.7, p) != 0.0
