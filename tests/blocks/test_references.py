"""References: every delivered derivative is the derivative of the one before, and noise."""

import math

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.params import equation_arguments

times = st.floats(-20, 20)
seeds = st.integers(0, 10_000)


def value(spec, t, x=(), u=()):
    """Return the reference and its derivatives at time t."""
    return np.array(spec.output(t, np.array(x), np.array(u), equation_arguments(spec)))


def derivative(function, t, h):
    """Return a central difference of order 8."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    return sum(w * (function(t + k * h) - function(t - k * h)) for k, w in weights.items()) / h


@st.composite
def sums_of_sines(draw):
    count = draw(st.integers(1, 3))

    def numbers(low, high):
        return draw(st.lists(st.floats(low, high), min_size=count, max_size=count))

    return nlctl.SumOfSines(
        order=5, amplitudes=numbers(-3, 3), frequencies=numbers(0, 4), phases=numbers(-4, 4)
    )


class TestSumOfSines:
    @given(spec=sums_of_sines(), t=times)
    def test_each_output_is_the_derivative_of_the_one_before(self, spec, t):
        """Orders 1 to 5, by differences of order 8."""
        slopes = derivative(lambda s: value(spec, s)[:-1], t, 0.05)
        np.testing.assert_allclose(slopes, value(spec, t)[1:], rtol=1e-6, atol=1e-6)

    @given(t=times)
    def test_the_papers_reference(self, t):
        """yd = 0.5 (sin t + sin 0.5 t) and its derivatives, written out."""
        s, c, s2, c2 = np.sin(t), np.cos(t), np.sin(t / 2), np.cos(t / 2)
        expected = [(s + s2) / 2, c / 2 + c2 / 4, -s / 2 - s2 / 8, -c / 2 - c2 / 16]
        np.testing.assert_allclose(value(nlctl.SumOfSines(order=3), t), expected, atol=1e-14)

    @pytest.mark.parametrize("order", range(6))
    def test_the_order_is_the_number_of_derivatives(self, order):
        """Lower orders deliver the first entries of higher ones."""
        spec = nlctl.SumOfSines(order=order)
        assert spec.outputs == ("yd", "yd1", "yd2", "yd3", "yd4", "yd5")[: order + 1]
        both = value(spec, 1.3), value(nlctl.SumOfSines(order=5), 1.3)[: order + 1]
        np.testing.assert_array_equal(*both)

    def test_frequency_0_is_a_constant(self):
        """sin(phi) has derivatives 0, and no 0^0 trouble."""
        spec = nlctl.SumOfSines(amplitudes=2, frequencies=0, phases=np.pi / 2)
        np.testing.assert_array_equal(value(spec, 5.0), [2, 0, 0])

    @each_row("field", ["amplitudes", "frequencies", "phases"])
    def test_as_many_of_each(self, field):
        """One amplitude, frequency and phase per sine."""
        with pytest.raises(nlctl.errors.ParameterError, match=r"SumOfSines needs as many .* 1"):
            nlctl.SumOfSines(**{field: (1.0,)})


def filtered_step(spec, t):
    """Return the closed form: height (1 - e^(-s) sum_k s^k / k!), s = omega (t - t_step)."""
    s = spec.omega * np.maximum(t - spec.t_step, 0.0)
    partial = sum(s**k / math.factorial(k) for k in range(spec.order + 1))
    return spec.height * (1 - np.exp(-s) * partial)


class TestFilteredStep:
    @pytest.mark.parted
    @pytest.mark.parametrize("order", range(4))
    def test_it_is_the_step_response_of_the_filter(self, order):
        """Simulated, in closed form and by python-control's transfer function."""
        spec = nlctl.FilteredStep(order=order, height=-1.5, omega=3.0)
        block, t = nlctl.block(spec, "reference"), np.linspace(0, 4, 41)
        run = ct.input_output_response(
            block, t, 0, nlctl.initial_state(block), solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-11}
        )
        yd = run.outputs.reshape(order + 1, -1)[0]
        np.testing.assert_allclose(yd, filtered_step(spec, t), atol=1e-7)
        transfer = ct.tf([3.0 ** (order + 1)], np.poly([-3.0] * (order + 1)))
        exact = -1.5 * ct.step_response(transfer, t).outputs
        np.testing.assert_allclose(yd, exact, atol=1e-7)

    @given(
        order=st.integers(0, 4),
        omega=st.floats(0.5, 4),
        height=st.floats(-3, 3),
        t_step=st.floats(-2, 2),
        after=st.floats(0.5, 5),
    )
    def test_the_chain_of_derivatives_solves_the_filter(self, order, omega, height, t_step, after):
        """With the exact derivatives of the closed form the update equation returns their own."""
        spec = nlctl.FilteredStep(order=order, omega=omega, height=height, t_step=t_step)
        p, t = equation_arguments(spec), t_step + after
        s = np.polynomial.Polynomial([0, omega])
        polynomial = sum(s**k / math.factorial(k) for k in range(order + 1))
        chain, decay = [height * (1 - np.exp(-omega * after) * polynomial(after))], polynomial
        for _ in range(order + 1):
            decay = decay.deriv() - omega * decay
            chain.append(-height * np.exp(-omega * after) * decay(after))
        update = spec.update(t, np.array(chain[:-1]), np.array([]), p)
        scale = (1 + abs(height)) * (1 + omega) ** (order + 1)
        np.testing.assert_allclose(update, chain[1:], atol=1e-12 * scale)

    def test_the_last_derivative_is_continuous_at_the_step(self):
        """Only the derivative of yd^(n) jumps, by height omega^(n+1)."""
        spec = nlctl.FilteredStep(order=2, height=2.0, t_step=1.0, omega=3.0)
        p, x = equation_arguments(spec), np.array([0.1, -0.2, 0.3])
        jump = spec.update(1.0, x, (), p) - spec.update(np.nextafter(1.0, 0.0), x, (), p)
        np.testing.assert_allclose(jump, [0, 0, 2.0 * 3.0**3], rtol=1e-14)

    def test_it_rests_before_the_step_and_settles_on_its_height(self):
        """0 is at rest before, (height, 0, ..., 0) after."""
        spec = nlctl.FilteredStep(order=2, height=-1.5, t_step=1.0)
        p = equation_arguments(spec)
        np.testing.assert_array_equal(spec.update(0.5, np.zeros(3), (), p), 0.0)
        rest = spec.update(9.0, np.array([-1.5, 0.0, 0.0]), (), p)
        np.testing.assert_allclose(rest, 0.0, atol=1e-14)


class TestFunctionReference:
    @given(t=times)
    def test_it_delivers_what_the_function_returns(self, t):
        """A plain function of time is enough."""
        spec = nlctl.FunctionReference(order=1, function=lambda t: (t**2, 2 * t))
        np.testing.assert_array_equal(value(spec, t), [t**2, 2 * t])
        assert spec.outputs == ("yd", "yd1")

    @each_row(
        ("order", "function", "told"),
        [
            (2, lambda t: (t, 1.0), r"3 values \(yd, yd1, yd2\), got 2"),
            (1, lambda t: (t, 1.0, 0.0), "2 values .*, got 3"),
            (1, lambda t: t, "2 values .*, got 1"),
            (-1, lambda t: (), "order >= 0, got -1"),
            (1.0, lambda t: (t, 1.0), "an integer order >= 0, got 1.0"),
        ],
    )
    def test_too_few_or_too_many_values_are_refused(self, order, function, told):
        """When the record is made, not in the middle of a run."""
        with pytest.raises(
            nlctl.errors.ParameterError, match=rf"FunctionReference .*needs .*{told}"
        ):
            nlctl.FunctionReference(order=order, function=function)


class TestBandLimitedNoise:
    @given(seed=seeds, t=times, u=st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
    def test_it_adds_its_own_noise_to_each_signal(self, seed, t, u):
        """out_i = in_i + n_i(t); n_i is `band_limited` with the seed (seed, i)."""
        spec = nlctl.references.BandLimitedNoise(seed=seed, rms=0.3, high=20.0)
        noise = [
            nlctl.functions.band_limited(0.3, low=0.0, high=20.0, seed=[seed, i])(t) for i in (0, 1)
        ]
        got = value(spec, t, u=u)
        np.testing.assert_allclose(got - np.array(u), noise, atol=1e-14)
        assert noise[0] != noise[1]

    @given(seed=seeds, rms=st.floats(0.01, 2))
    @settings(max_examples=5)
    def test_noises_of_two_signals_are_uncorrelated(self, seed, rms):
        """Over a long window each has its rms, and their product averages out."""
        spec = nlctl.references.BandLimitedNoise(seed=seed, rms=rms, low=10.0, high=40.0)
        p, zero = equation_arguments(spec), np.zeros(2)
        n = np.array([spec.output(t, zero, zero, p) for t in np.arange(0, 300, 0.05)]) / rms
        np.testing.assert_allclose(n.T @ n / len(n), np.eye(2), atol=0.1)

    def test_every_solver_sees_the_same_noise(self):
        """An integral of the noise does not depend on method and step, but on the tolerance."""
        spec = nlctl.references.BandLimitedNoise(
            inputs=("a",), outputs=("b",), rms=1.0, high=10.0, seed=2
        )
        integral = ct.tf(1, [1, 0], inputs="b", outputs="y", name="integral")
        diagram = ct.interconnect([nlctl.block(spec, "n"), integral], inputs=["a"], outputs=["y"])
        ends = [
            ct.input_output_response(
                diagram,
                np.linspace(0, 3, 4),
                0,
                0,
                solve_ivp_method=method,
                solve_ivp_kwargs={"rtol": 1e-8, "atol": 1e-10, "max_step": step},
            ).outputs[-1]
            for method, step in (("RK45", 0.1), ("RK45", 0.037), ("LSODA", 0.1), ("DOP853", 0.5))
        ]
        p = equation_arguments(spec)
        omega, phase = p.spectrum[0], p.angles[0]
        sines = (np.cos(phase) - np.cos(omega * 3 + phase)) / omega
        np.testing.assert_allclose(ends, np.sqrt(2 / omega.size) * sines.sum(), atol=1e-6)

    @each_row(
        ("changed", "told"),
        [
            ({"inputs": ("x1",)}, "as many inputs as outputs"),
            ({"inputs": (), "outputs": ()}, "as many inputs as outputs"),
            ({"low": 50.0}, "low < high, got 50 and 50"),
            ({"high": 0.0}, "high > 0, got 0"),
            ({"low": -1.0}, "low >= 0, got -1"),
            ({"components": 0}, "components >= 1, got 0"),
            ({"rms": -1e-9}, "rms >= 0, got -1e-09"),
            ({"seed": -1}, "seed >= 0, got -1"),
        ],
    )
    def test_bad_bands_and_signals_are_refused(self, changed, told):
        """The message names rule and value."""
        with pytest.raises(nlctl.errors.ParameterError, match=f"BandLimitedNoise needs {told}"):
            nlctl.references.BandLimitedNoise(**changed)
