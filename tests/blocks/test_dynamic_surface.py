"""Dynamic surface control: surfaces by hand, the price of the filter, the network's proof."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.params import equation_arguments

numbers, positive = st.floats(-5, 5), st.floats(0.1, 10)
NO_NETWORK = {"weights": nlctl.controllers.Zero(outputs=("W_psi", "W_norm"))}


@nlctl.equation
def double_integrator(x, v):
    return v


@nlctl.equation
def wing(x, v):
    """The weights of wing rock, of which the controller knows the regressors and the gain 3."""
    x1, x2 = x
    known = 0.8 + 0.2314 * x1 + 0.6918 * x2 - 0.6245 * np.absolute(x1) * x2
    return known + 0.0095 * np.absolute(x2) * x2 + 0.0214 * x1 * x1 * x1 + 3.0 * v


def loop_of(controller, f, **initial):
    plant = nlctl.PureFeedback(order=2, f=f, initial=initial)
    reference = nlctl.SumOfSines(order=1, amplitudes=1.0, frequencies=1.3, phases=0.0)
    blocks = {"reference": reference, "plant": plant, "controller": controller}
    return nlctl.interconnect({**blocks, "a": nlctl.Gain()}, outputs=["e", "r", "u"])


@given(
    st.lists(numbers, min_size=7, max_size=7),
    st.lists(positive, min_size=3, max_size=3),
    st.lists(positive, min_size=2, max_size=2),
)
def test_three_surfaces_by_hand(values, c, tau):
    """s_1, alpha_1, a_2', s_2, alpha_2, a_3', s_3, one after the other."""
    x1, x2, x3, a2, a3, yd, yd1 = values
    spec = nlctl.controllers.DynamicSurface(c=tuple(c), tau=tuple(tau))
    x, u, p = np.array([a2, a3]), np.array([x1, x2, x3, yd, yd1]), equation_arguments(spec)
    alpha_1 = -c[0] * (x1 - yd) + yd1
    rate_2 = (alpha_1 - a2) / tau[0]
    alpha_2 = -c[1] * (x2 - a2) + rate_2
    rate_3 = (alpha_2 - a3) / tau[1]
    close = {"rel": 1e-9, "abs": 1e-9}
    assert list(spec.update(0.0, x, u, p)) == pytest.approx([rate_2, rate_3], **close)
    expected = x1 - yd, x3 - a3, rate_3, -c[2] * (x3 - a3)
    assert list(spec.output(0.0, x, u, p)) == pytest.approx(expected, **close)


@each_row("tau", [0.1, 0.02])
def test_the_price_of_the_filter_is_its_time_constant(tau):
    """tau e'' + e' + c_1 e = -tau yd'': of a sine, a tau w^2 / |c_1 - tau w^2 + j w| at last."""
    surface = nlctl.controllers.DynamicSurface(c=(2.0, 4.0), tau=(tau,))
    controller = nlctl.dynamic_surface_control(surface, **NO_NETWORK)
    times = np.linspace(0, 30, 6001)
    response = nlctl.input_output_response(
        loop_of(controller, double_integrator, x1=0.5), times, rtol=1e-9, atol=1e-12
    )
    late = np.abs(response.outputs[0][times > 20]).max()
    assert late == pytest.approx(tau * 1.69 / abs(2.0 - tau * 1.69 + 1.3j), rel=1e-4)


def test_the_lyapunov_function_of_the_network_falls_by_the_last_surface():
    """V = s_n^2 + |W_hat - W|^2 / Gamma has V' = -2 c_n s_n^2, whatever the filters do."""
    Gamma, W = 4.0, np.array([0.8, 0.2314, 0.6918, -0.6245, 0.0095, 0.0214])
    controller = nlctl.dynamic_surface_control(
        basis=nlctl.controllers.WingRockRegressor(),
        weights=nlctl.controllers.AdaptiveWeights(nodes=6, Gamma=Gamma, sigma_1=0.0),
        law=nlctl.controllers.ModelReferenceLaw(gain=3.0),
    )
    loop, times = loop_of(controller, wing, x1=1.2, x2=1.0), np.linspace(0, 20, 20_001)
    response = nlctl.input_output_response(loop, times, rtol=1e-10, atol=1e-12)
    states = dict(zip(nlctl.state_names(loop), response.states, strict=True))
    s_n = response.outputs[1]
    off = [states[f"controller.weights.W_hat[{i}]"] - W[i] for i in range(6)]
    V = s_n**2 + np.sum(np.square(off), axis=0) / Gamma
    assert np.all(np.diff(V) <= 1e-10)
    assert V[-1] - V[0] == pytest.approx(-np.trapezoid(2 * 4.0 * s_n**2, times), abs=1e-5)


def test_the_network_pays_behind_the_dead_zone_of_example_1():
    """The paper's plant and actuator, unknown to both: half the error, or less."""
    times, late = np.linspace(0, 30, 3001), {}
    grid = nlctl.controllers.GaussianBasis(
        centres=nlctl.controllers.grid_centres([7, 7], -3, 3), widths=(1.0,)
    )
    learning = nlctl.controllers.AdaptiveWeights(nodes=49, Gamma=20.0, sigma_1=0.01)
    for label, weights in (("with", learning), ("without", NO_NETWORK["weights"])):
        surface = nlctl.controllers.DynamicSurface(c=(2.0, 4.0), tau=(0.02,))
        controller = nlctl.dynamic_surface_control(surface, basis=grid, weights=weights)
        loop = nlctl.paper.example_1(controller=controller)
        response = nlctl.input_output_response(loop, times)
        late[label] = np.sqrt(np.mean(response.outputs[loop.output_index["e"], 1500:] ** 2))
    assert late["with"] < 0.5 * late["without"], late


def test_a_filter_that_starts_from_0_costs_a_large_input_at_first():
    """Example 1 at t = 0: u is alpha_1 / tau, or c_2 alpha_1 from a_2 = alpha_1."""
    surface = nlctl.controllers.DynamicSurface(c=(5.0, 10.0), tau=(0.02,))
    alpha_1 = -5.0 * 0.5 + 0.75
    spec, u = equation_arguments(surface), np.array([0.5, 0.0, 0.0, 0.75])
    wanted = [sum(surface.output(0.0, np.array([a]), u, spec)[2:]) for a in (0.0, alpha_1)]
    assert wanted == pytest.approx([alpha_1 / 0.02, 10.0 * alpha_1])


@each_row(
    ("make", "told"),
    [
        (
            lambda: nlctl.controllers.DynamicSurface(tau=(0.1, 0.1)),
            "one tau less than c.* got 2 of tau and 2",
        ),
        (lambda: nlctl.controllers.DynamicSurface(c=(1.0,)), "got 1 of tau and 1 of c"),
        (
            lambda: nlctl.dynamic_surface_control(
                weights=nlctl.controllers.AdaptiveWeights(nodes=4)
            ),
            "got nodes=4 for 27",
        ),
    ],
)
def test_pieces_of_dynamic_surface_control_that_do_not_fit_are_refused(make, told):
    """The culprit, the rule and the values."""
    with pytest.raises(nlctl.errors.ParameterError, match=told):
        make()
