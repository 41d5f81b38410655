"""Extremum seeking against its average, which is linear where the performance is a parabola."""

import control as ct
import numpy as np
import pytest
from scipy.linalg import expm

import nlctl


def seeking_of(performance, **fields):
    """A static performance of theta, and what seeks its extremum."""
    block = ct.nlsys(
        None, lambda t, x, u, params: performance(u[0]), inputs=["theta"], outputs=["y"], name="map"
    )
    parts = {"map": block, "seeking": nlctl.controllers.ExtremumSeeking(**fields)}
    return nlctl.interconnect(parts, outputs=["theta", "y"])


def estimate_of(loop, times, start):
    states = nlctl.initial_state(loop, {f"seeking.{k}": v for k, v in start.items()})
    run = nlctl.input_output_response(loop, times, 0, states, rtol=1e-9, atol=1e-11)
    return run.states[nlctl.state_names(loop).index("seeking.theta_hat")]


@pytest.mark.slow
@pytest.mark.parametrize("k", [6.0, -6.0])
def test_the_estimate_comes_to_its_average_as_the_perturbation_gets_faster(k):
    """Averaging is of first order: the distance halves as omega doubles.  Maximum and minimum."""
    a, omega_l, h = 0.25, 1.2, -2.0 * np.sign(k)
    times = np.linspace(0, 6, 1201)
    rates = np.array([[0.0, k], [omega_l * a**2 * h / 2, -omega_l]])
    average = np.array([(expm(rates * t) @ [0.5, 0.0])[0] for t in times])
    errors = []
    for omega in (50.0, 100.0, 200.0, 400.0):
        loop = seeking_of(
            lambda theta: 3.0 + h / 2 * (theta - 1.0) ** 2, k=k, a=a, omega=omega, omega_l=omega_l
        )
        found = estimate_of(loop, times, {"theta_hat": 1.5, "eta": 3.0 + h / 2 * 0.25})
        errors.append(np.abs(found - 1.0 - average).max())
    orders = np.diff(np.log(errors)) / -np.log(2.0)
    np.testing.assert_allclose(orders, 1.0, atol=0.1)


@pytest.mark.slow
def test_it_ends_where_the_published_formula_says():
    """At -a^2 y''' / (8 y'') beside the maximum, to the fourth order of a (Krstic and Wang)."""
    h, third = -2.0, 3.0
    missed = []
    for a in (0.1, 0.2):
        loop = seeking_of(
            lambda theta: h / 2 * theta**2 + third / 6 * theta**3,
            k=1.0 / a**2, a=a, omega=400.0, omega_l=2.0,
        )  # fmt: skip
        times = np.linspace(0, 24, 2401)
        found = estimate_of(loop, times, {"theta_hat": 0.0})
        period = times > 24 - 2 * np.pi
        missed.append(abs(found[period].mean() + a**2 * third / (8 * h)))
        assert missed[-1] < 0.15 * a**2 * abs(third / (8 * h))
    assert missed[1] > missed[0]


def test_without_a_slope_it_stays():
    """A constant performance moves the estimate by nothing but what the washout leaves."""
    loop = seeking_of(lambda theta: 0.0 * theta + 2.0, k=5.0)
    found = estimate_of(loop, np.linspace(0, 5, 51), {"theta_hat": 0.7, "eta": 2.0})
    np.testing.assert_allclose(found, 0.7, rtol=0, atol=1e-9)
