"""Rate limiter, lags, quantiser, saturation with two limits: closed forms."""

import control as ct
import numpy as np
import pytest
from actuator_rig import along, compiled, drive, values
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.params import equation_arguments

positive = st.floats(0.1, 5).map(lambda v: round(v, 4))
inputs = st.floats(-5, 5)
times = np.linspace(0, 4, 41)


class TestRateLimiter:
    """In machine code, with the ends of the limits located."""

    @given(rise=positive, K=st.floats(2, 50), step=positive)
    @settings(max_examples=many(20, part=4))
    def test_a_step_is_a_ramp_and_then_an_exponential(self, rise, K, step):
        """At rate `rise` up to step - rise / K, then with the time constant 1 / K."""
        spec = nlctl.RateLimiter(rise=rise, fall=-2 * rise, K=K)
        for sign, rate in ((1, rise), (-1, 2 * rise)):
            run = drive(spec, times, np.full(times.size, sign * step), rtol=1e-10, atol=1e-12)
            leaves = max(0.0, (step - rate / K) / rate)
            left = min(step, rate / K)
            late = step - left * np.exp(-K * np.maximum(times - leaves, 0))
            exact = np.where(times < leaves, rate * times, late)
            np.testing.assert_allclose(run.outputs[0], sign * exact, atol=1e-8)

    @given(slope=st.floats(-0.9, 0.9), K=st.floats(5, 50))
    @settings(max_examples=many(20, part=4))
    def test_a_slow_ramp_is_followed_at_a_distance(self, slope, K):
        """u - v = slope (1 - exp(-K t)) / K."""
        run = drive(nlctl.RateLimiter(K=K), times, slope * times, rtol=1e-10, atol=1e-12)
        exact = slope * (times - (1 - np.exp(-K * times)) / K)
        np.testing.assert_allclose(run.outputs[0], exact, atol=1e-9)

    @given(path=st.lists(inputs, min_size=3, max_size=8), rise=positive, fall=positive)
    @settings(max_examples=many(20, part=4))
    def test_the_rate_never_leaves_its_limits(self, path, rise, fall):
        """Between any two samples."""
        spec = nlctl.RateLimiter(rise=rise, fall=-fall, K=20.0)
        grid = np.linspace(0, len(path) - 1, 101)
        v = drive(spec, grid, np.interp(grid, np.arange(len(path)), path)).outputs[0]
        rates = np.diff(v) / np.diff(grid)
        assert np.all(rates <= rise + 1e-6)
        assert np.all(rates >= -fall - 1e-6)


class TestLags:
    """Against python-control's transfer functions."""

    @given(k=positive, T=positive)
    @settings(max_examples=many(10, part=2))
    def test_a_first_order_lag_is_its_transfer_function(self, k, T):
        """k / (T s + 1)."""
        made = compiled(nlctl.Lag).linearize(0, 0, params=values(nlctl.Lag(k=k, T=T)))
        omega = np.array([0.1, 1.0, 10.0])
        np.testing.assert_allclose(made(1j * omega), k / (1 + 1j * omega * T), rtol=1e-12)

    @given(k=positive, omega=positive, zeta=positive)
    @settings(max_examples=many(10, part=2))
    def test_a_second_order_lag_is_its_transfer_function(self, k, omega, zeta):
        """k omega^2 / (s^2 + 2 zeta omega s + omega^2)."""
        spec = nlctl.actuators.SecondOrderLag(k=k, omega=omega, zeta=zeta)
        made = compiled(nlctl.actuators.SecondOrderLag).linearize(0, 0, params=values(spec))
        wanted = ct.tf([k * omega**2], [1, 2 * zeta * omega, omega**2])
        s = 1j * omega * np.array([0.1, 1.0, 10.0])
        np.testing.assert_allclose(made(s), wanted(s), rtol=1e-11)

    @given(zeta=st.floats(0.05, 0.9))
    @settings(max_examples=many(10, part=2))
    def test_a_step_overshoots_as_the_damping_ratio_says(self, zeta):
        """By exp(-pi zeta / sqrt(1 - zeta^2)) at half a period of the damped oscillation."""
        damped = np.sqrt(1 - zeta**2)
        spec = nlctl.actuators.SecondOrderLag(omega=1.0, zeta=zeta, v0=0.0)
        run = drive(spec, [0, np.pi / damped], [1.0, 1.0], rtol=1e-10, atol=1e-12)
        assert run.outputs[0, -1] == pytest.approx(1 + np.exp(-np.pi * zeta / damped), abs=1e-8)


class TestQuantiser:
    """The characteristic, and jumps that are located."""

    @given(u=inputs, q=positive, riser=st.booleans())
    def test_the_nearest_level(self, u, q, riser):
        """Levels are q apart, at most q / 2 away, and k q or (k + 1/2) q; levels stay."""
        spec = nlctl.Quantiser(q=q, riser=riser)
        v = along(spec, [u, u])[0]
        assert abs(v - u) <= q / 2 * (1 + 1e-12)
        level = v / q - 0.5 * riser
        assert level == pytest.approx(round(level), abs=1e-9)
        assert along(spec, [v, v])[0] == pytest.approx(v, abs=1e-12)
        low, high = spec.band(0.0, u, equation_arguments(spec))
        assert low - 1e-12 <= v <= high + 1e-12

    @given(q=st.sampled_from((0.25, 0.5, 1.0, 0.375)), riser=st.booleans(), k=st.integers(-9, 9))
    def test_machine_code_equals_python_control_at_the_jumps(self, q, riser, k):
        """On a jump, and a bit beside it."""
        spec = nlctl.Quantiser(q=q, riser=riser)
        block, jump = nlctl.block(spec, "b"), q * (k + 0.5 * (not riser))
        for u in (jump, np.nextafter(jump, 99), np.nextafter(jump, -99)):
            assert along(spec, [u, u])[0] == block.output(0.0, [], [u])[0]

    @pytest.mark.parametrize("riser", [False, True])
    def test_the_area_below_the_staircase_is_exact(self, riser):
        """The integral of v for u = t from 0 to 1, q = 0.1: 1/2, jumps located."""
        hold = ct.nlsys(
            lambda t, x, u, p: [u[0]], lambda t, x, u, p: [x[0]], inputs=["v"], outputs=["y"],
            states=1, name="sum",
        )  # fmt: skip
        rounded = nlctl.block(nlctl.Quantiser(riser=riser), "actuator")
        loop = nlctl.compile(nlctl.interconnect([rounded, hold], inputs=["u"], outputs=["y"]))
        run = nlctl.input_output_response(loop, [0.0, 1.0], [0.0, 1.0], rtol=1e-9)
        assert run.outputs[-1] == pytest.approx(0.5, abs=1e-7)
        assert run.statistics.events >= 9


class TestAsymmetricSaturation:
    """Two slopes, two limits."""

    @given(u=st.floats(-30, 30), m_r=positive, m_l=positive, high=positive, low=positive)
    def test_the_characteristic(self, u, m_r, m_l, high, low):
        """A slope up to a limit on either side; with equal ones it is `Saturation`."""
        spec = nlctl.actuators.AsymmetricSaturation(
            slope_r=m_r, slope_l=m_l, limit_r=high, limit_l=-low
        )
        v = along(spec, [u, u])[0]
        assert v == (min(m_r * u, high) if u >= 0 else max(m_l * u, -low))
        same = nlctl.actuators.AsymmetricSaturation(
            slope_r=1, slope_l=1, limit_r=high, limit_l=-high
        )
        assert along(same, [u, u])[0] == along(nlctl.Saturation(limit=high), [u, u])[0]

    def test_its_break_points_are_corners(self):
        """Where the slope changes, and at either limit."""
        spec = nlctl.actuators.AsymmetricSaturation()
        p = equation_arguments(spec)
        for k, point in enumerate((0.0, p.limit_l / p.slope_l, p.limit_r / p.slope_r)):
            assert spec.switching(0, (), (point,), p)[k] == 0.0


@each_row(
    ("make", "told"),
    [
        (lambda: nlctl.RateLimiter(fall=0.5), "RateLimiter needs fall < 0, got 0.5"),
        (lambda: nlctl.RateLimiter(v0="x"), "RateLimiter needs a number for v0, got 'x'"),
        (lambda: nlctl.Lag(T=0.0), "Lag needs T > 0, got 0"),
        (
            lambda: nlctl.actuators.SecondOrderLag(zeta=-0.1),
            "SecondOrderLag needs zeta >= 0, got -0.1",
        ),
        (lambda: nlctl.Quantiser(q=0.0), "Quantiser needs q > 0, got 0"),
        (lambda: nlctl.Quantiser(riser=1.0), "Quantiser needs riser to be True or False"),
        (lambda: nlctl.actuators.AsymmetricSaturation(limit_l=1.0), "needs limit_l < 0, got 1"),
    ],
)
def test_what_is_out_of_bounds_is_refused(make, told):
    """With record, rule and value."""
    with pytest.raises(nlctl.errors.ParameterError, match=told):
        make()
