"""The adaptive inverse of a dead zone: an inverse, a gradient, and a Lyapunov function."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.params import equation_arguments

numbers = st.floats(-20, 20)
slopes, widths = st.floats(0.3, 3.0), st.floats(0.05, 2.0)
BETA = 1.0


def at(spec, x, u):
    return spec.output(0.0, x, u, equation_arguments(spec))


@given(numbers, slopes, slopes, widths, widths)
def test_with_the_true_values_the_dead_zone_disappears(wanted, m_r, m_l, b_r, b_l):
    """Estimates that are right make actuator and inverse the identity, as `DeadZoneInverse`."""
    x = (m_r, m_r * b_r, m_l, -m_l * b_l)
    u, right, left = at(nlctl.controllers.AdaptiveDeadZoneInverse(), x, (wanted, 0.3))
    values = {"slope_r": m_r, "slope_l": m_l, "b_r": b_r, "b_l": -b_l}
    zone = nlctl.DeadZone(**values, ripple_r=0.0, ripple_l=0.0)
    assert at(zone, (), (u,))[0] == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    assert u == pytest.approx(
        at(nlctl.actuators.DeadZoneInverse(**values), (), (wanted,))[0], abs=1e-9
    )
    assert (right, left) == (pytest.approx(b_r), pytest.approx(-b_l))


@given(numbers, numbers, slopes, slopes, widths, widths, st.floats(0.1, 10))
def test_projection_only_takes_away_what_leaves_the_bounds(wanted, r, m_r, m_l, b_r, b_l, gamma):
    """At a bound the rates point inwards; elsewhere they are the gradient's."""
    spec = nlctl.controllers.AdaptiveDeadZoneInverse(gamma=gamma)
    p = equation_arguments(spec)
    at_bounds = (spec.m_min, 0.0, spec.m_min, 0.0)
    m_r1, mb_r1, m_l1, mb_l1 = spec.update(0.0, at_bounds, (wanted, r), p)
    assert min(m_r1, mb_r1, m_l1) >= 0 >= mb_l1
    inside = (m_r, m_r * b_r, m_l, -m_l * b_l)
    rates = np.array(spec.update(0.0, inside, (wanted, r), p))
    u = at(spec, inside, (wanted, r))[0]
    side = np.array([wanted > 0, wanted > 0, wanted < 0, wanted < 0])
    np.testing.assert_array_equal(rates, side * np.array([gamma * r * u, -gamma * r] * 2))


def regulated(inverse, zone):
    """Return r' = -beta r + v - u_d with u_d = 2 sin t, v the dead zone's output."""

    @nlctl.record
    class Known:
        """A plant that is known but for its actuator, and what it wants of that: r, u_d.

        r' = -beta r + v - u_d,   u_d = 2 sin t
        """

        beta: float = nlctl.param(BETA, unit="1/s", meaning="rate of decay", above=0)
        inputs, outputs, states, feedthrough = ("v",), ("r", "u_d"), ("r",), False

        @staticmethod
        @nlctl.equation
        def update(t, x, u, p):
            return (-p.beta * x[0] + u[0] - 2 * np.sin(t),)

        @staticmethod
        @nlctl.equation
        def output(t, x, u, p):
            return x[0], 2 * np.sin(t)

    return nlctl.interconnect(
        {"plant": Known(), "inverse": inverse, "actuator": zone},
        outputs=["r", "u_d", "u", "v", "b_r_hat", "b_l_hat"],
    )


def test_its_lyapunov_function_falls_by_beta_r_squared():
    """From estimates that are too wide: V(T) - V(0) is minus the integral of beta r^2."""
    zone = nlctl.DeadZone(b_r=0.5, b_l=-0.4, ripple_r=0.0, ripple_l=0.0, slope_r=1.2, slope_l=0.9)
    inverse = nlctl.controllers.AdaptiveDeadZoneInverse(gamma=0.5, b_0=1.5)
    times = np.linspace(0, 10, 20_001)
    loop = regulated(inverse, zone)
    response = nlctl.input_output_response(loop, times, rtol=1e-10, atol=1e-12)
    r, wanted, _, v, right, left = response.outputs
    states = dict(zip(nlctl.state_names(loop), response.states, strict=True))
    true = {"m_r": 1.2, "mb_r": 0.6, "m_l": 0.9, "mb_l": -0.36}
    off = sum((states[f"inverse.{key}"] - value) ** 2 for key, value in true.items())
    V = r**2 / 2 + off / (2 * 0.5)
    wide = (right >= 0.5) & (left <= -0.4)
    assert wide.all()  # so that u never falls into the true dead zone
    assert np.all(np.abs(v[np.abs(wanted) > 0.01]) > 0)
    spent = np.trapezoid(BETA * r**2, times)
    assert V[-1] - V[0] == pytest.approx(-spent, abs=1e-6)
    assert spent > 0.1


def test_it_beats_the_actuator_without_it():
    """Break points that are unknown at first: a fifth of the error that the dead zone makes."""
    zone = nlctl.DeadZone(b_r=0.5, b_l=-0.4, ripple_r=0.0, ripple_l=0.0, slope_r=1.2, slope_l=0.9)
    times = np.linspace(0, 60, 6001)
    still = nlctl.controllers.AdaptiveDeadZoneInverse(gamma=1e-9)
    late = {}
    for label, inverse in (
        ("still", still),
        ("adaptive", nlctl.controllers.AdaptiveDeadZoneInverse()),
    ):
        r = nlctl.input_output_response(regulated(inverse, zone), times).outputs[0]
        late[label] = np.abs(r[times > 50]).max()
    assert late["adaptive"] < 0.2 * late["still"]
