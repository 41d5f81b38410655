"""Prescribed performance and funnel control: the bound holds, and at the bound there is no law."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy.integrate import quad

import nlctl
from nlctl.params import equation_arguments

fractions = st.floats(-0.99, 0.99)
beyond = st.floats(1.0, 50.0) | st.floats(-50.0, -1.0)
gains = st.floats(0.1, 20.0)
T = np.linspace(0, 20, 2001)
CONTROLLERS = {
    "prescribed performance": (
        nlctl.controllers.PrescribedPerformance(),
        nlctl.controllers.PrescribedPerformance(
            k=(0.5, 2.0, 3.0), rho_0=(3.0, 3.0, 6.0), rho_inf=(0.15, 0.7, 2.0), decay=3 * (0.5,)
        ),
    ),
    "funnel": (
        nlctl.controllers.FunnelControl(k=5.0),
        nlctl.controllers.FunnelControl(order=3, k=5.0, decay=1.0),
    ),
}


def at(spec, t, u):
    """Return e, u and rho of a controller."""
    return spec.output(t, np.empty(0), np.array(u), equation_arguments(spec))


def single(k, rho):
    """Return prescribed performance control of one state with a constant bound."""
    return nlctl.controllers.PrescribedPerformance(
        k=(k,), rho_0=(rho,), rho_inf=(rho,), decay=(0.0,)
    )


def integrator_loop(controller, x1):
    """Return x1' = u + 0 with the reference 0."""

    @nlctl.equation
    def f(x, v):
        return v

    still = nlctl.SumOfSines(order=1, amplitudes=0.0, frequencies=1.0, phases=0.0)
    plant = nlctl.PureFeedback(order=1, f=f, initial={"x1": x1})
    blocks = {"reference": still, "plant": plant, "controller": controller, "a": nlctl.Gain()}
    return nlctl.interconnect(blocks, outputs=["e", "u", "rho"])


@given(fractions, fractions, gains, gains, st.floats(0, 10))
def test_prescribed_performance_is_the_inverse_of_tanh(xi_1, xi_2, k_1, k_2, t):
    """ln((1 + xi) / (1 - xi)) = 2 artanh xi: chosen xi_1, xi_2 give u = -2 k_2 artanh xi_2."""
    spec = nlctl.controllers.PrescribedPerformance(
        k=(k_1, k_2), rho_0=(3.0, 7.0), rho_inf=(0.5, 2.0), decay=(1.0, 0.2)
    )
    rho_1, rho_2 = 2.5 * np.exp(-t) + 0.5, 5 * np.exp(-0.2 * t) + 2
    a_1 = -2 * k_1 * np.arctanh(xi_1)
    e, u, rho = at(spec, t, [0.3 + xi_1 * rho_1, a_1 + xi_2 * rho_2, 0.3])
    assert rho == pytest.approx(rho_1, rel=1e-12)
    assert e == pytest.approx(xi_1 * rho_1, abs=1e-12)
    slack = 1e-9 * (1 + k_1) * (1 + k_2)  # what 1 - xi loses to rounding, times the slope there
    assert u == pytest.approx(-2 * k_2 * np.arctanh(xi_2), rel=1e-9, abs=slack)


@given(fractions, fractions, gains, st.floats(0, 10))
def test_funnel_control_in_its_own_coordinates(w_1, w_2, k, t):
    """From w_1, w_2 back to e, e': the law is -k w_2 / (1 - w_2^2)."""
    spec = nlctl.controllers.FunnelControl(k=k, rho_0=4.0, rho_inf=0.2, decay=1.5)
    width = 3.8 * np.exp(-1.5 * t) + 0.2
    slope = width * (w_2 - w_1 / (1 - w_1**2))
    e, u, rho = at(spec, t, [0.7 + width * w_1, -0.4 + slope, 0.7, -0.4])
    assert (e, rho) == (pytest.approx(width * w_1, abs=1e-12), pytest.approx(width))
    expected = -k * w_2 / (1 - w_2**2)
    assert u == pytest.approx(expected, rel=1e-6, abs=1e-6 * (1 + k))


@given(beyond, st.floats(-3, 3))
def test_at_the_bound_and_beyond_it_there_is_no_law(factor, x2):
    """|e| >= rho_1: u is NaN, whatever the other states; the error and the bound are told."""
    for spec, signals in (
        (nlctl.controllers.PrescribedPerformance(), [3.0 * factor, x2, 0.0]),
        (nlctl.controllers.FunnelControl(rho_0=3.0), [3.0 * factor, x2, 0.0, 0.0]),
    ):
        e, u, rho = at(spec, 0.0, signals)
        assert (e, rho) == (3.0 * factor, 3.0)
        assert np.isnan(u)


def test_prescribed_performance_of_an_integrator_takes_the_time_of_its_quadrature():
    """x' = -k ln((1 + xi) / (1 - xi)): the time from xi_0 to xi is an integral over xi."""
    k, rho, start = 2.0, 1.5, 0.9
    response = nlctl.input_output_response(
        integrator_loop(single(k, rho), rho * start),
        np.linspace(0, 1, 11),
        0,
        rtol=1e-11,
        atol=1e-13,
    )
    for t, x in zip(response.time[1:], response.states[0][1:], strict=True):
        taken = quad(lambda xi: rho / (2 * k * np.arctanh(xi)), x / rho, start)[0]
        assert taken == pytest.approx(t, rel=1e-7)


def test_funnel_control_of_an_integrator_is_known_in_closed_form():
    """x' = -k w / (1 - w^2), w = x / rho: ln w - w^2 / 2 falls with the slope k / rho."""
    spec = nlctl.controllers.FunnelControl(order=1, k=2.0, rho_0=1.5, rho_inf=1.5, decay=0.0)
    response = nlctl.input_output_response(
        integrator_loop(spec, 1.5 * 0.95), np.linspace(0, 2, 21), 0, rtol=1e-11, atol=1e-13
    )
    w = response.states[0] / 1.5
    invariant = np.log(w) - w**2 / 2 + (2.0 / 1.5) * response.time
    assert np.ptp(invariant) < 1e-8


@pytest.mark.slow
@each_row(("label", "number"), [(label, i) for label in CONTROLLERS for i in (0, 1)])
def test_the_bound_holds_for_every_member_of_an_ensemble(label, number):
    """Other plants, actuators and starts: no member leaves its bound, and none is tuned for it."""
    size, rng = 32, np.random.default_rng(number)
    loop = (nlctl.paper.example_1, nlctl.paper.example_2)[number](
        controller=CONTROLLERS[label][number]
    )
    varied = (
        {"plant.p1": (-0.5, 0.5), "plant.q_mean": (2.0, 8.0), "plant.d_amplitude": (0.0, 0.3)}
        | {"actuator.b_r": (0.1, 1.0), "actuator.b_l": (-1.0, -0.1)},
        {"plant.a": (1.0, 2.5), "plant.b": (2.0, 4.0), "plant.c": (4.0, 8.0)}
        | {"plant.d_amplitude": (0.0, 2.0)},
    )[number]
    params = {name: rng.uniform(*bounds, size) for name, bounds in varied.items()}
    own = CONTROLLERS[label][number]
    ensemble = nlctl.ensemble_response(nlctl.compile(loop), T, params=params, keep=("e",))
    assert set(ensemble.table["status"]) == {"OK"}
    widths = [at(own, t, np.zeros(len(own.inputs)))[2] for t in T]
    assert np.all(np.abs(ensemble.signals["e"]) < widths)


@each_row("label", list(CONTROLLERS))
def test_no_run_is_calm_where_the_promise_has_no_ground(label):
    """Outside of the bound at t = 0, or with the other sign of the input gain: refused."""
    spec = CONTROLLERS[label][0]
    far = nlctl.paper.example_1(controller=spec, plant=nlctl.plants.ForcedDuffing())
    with pytest.raises(nlctl.errors.DivergedError, match="after t = 0 s"):
        nlctl.input_output_response(far, T, 0, nlctl.initial_state(far, {"plant.x1": 6.0}))
    reversed_gain = nlctl.paper.example_1(controller=spec, actuator=nlctl.Gain(k=-1.0))
    with pytest.raises(nlctl.errors.DivergedError):
        nlctl.input_output_response(reversed_gain, T)


def test_bounds_and_gains_of_equal_length():
    """One value for each state of the plant."""
    with pytest.raises(nlctl.errors.ParameterError, match=r"one value .*got 2 of k, 3 of rho_0"):
        nlctl.controllers.PrescribedPerformance(rho_0=(1.0, 2.0, 3.0))
    with pytest.raises(nlctl.errors.ParameterError, match=r"FunnelControl needs an order .*0"):
        nlctl.controllers.FunnelControl(order=0)
