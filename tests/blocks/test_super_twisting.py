"""Super-twisting: the reaching time in closed form, and what the layer leaves of a ramp."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.params import equation_arguments

numbers, positive = st.floats(-50, 50), st.floats(0.1, 20)


@nlctl.record
class Surface:
    """Sliding variable with a disturbance: r' = v + slope t + a sin(omega t)."""

    slope: float = nlctl.param(0.0, unit="1/s", meaning="slope of the disturbance")
    a: float = nlctl.param(0.0, unit="1", meaning="amplitude of the disturbance")
    omega: float = nlctl.param(1.0, unit="rad/s", meaning="frequency of the disturbance")
    inputs, outputs, states, feedthrough = ("v",), ("r",), ("r",), False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (u[0] + p.slope * t + p.a * np.sin(p.omega * t),)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def loop_of(law, **disturbance):
    blocks = {"surface": Surface(**disturbance), "law": law, "actuator": nlctl.Gain()}
    return nlctl.interconnect(blocks, outputs=["r", "u"])


def reaching_time(w_0, k_1, k_2):
    """The time from r = 0, w = w_0 to r = w = 0, without a layer.

    z = |r|^(1/2) sign(r) and w obey dz = -k_1 z + w, dw = -2 k_2 z in the time s with
    dt = 2 |z| ds; t is the integral of 2 |z|, a geometric series of half waves.
    """
    square = 2 * k_2 - k_1**2 / 4
    q = np.exp(-np.pi * k_1 / 2 / np.sqrt(square)) if square > 0 else 0.0
    return abs(w_0) / k_2 * (1 + q) / (1 - q)


@each_row(("k_1", "k_2"), [(1.0, 2.0), (2.0, 1.1), (1.5, 1.1), (4.0, 1.0)])
def test_it_reaches_the_surface_when_the_closed_form_says(k_1, k_2):
    """Three with half waves that shrink, one that creeps onto r = 0 from one side."""
    law, w_0 = nlctl.controllers.SuperTwistingLaw(k_1=k_1, k_2=k_2, phi=1e-6), 1.0
    loop, expected = loop_of(law), reaching_time(1.0, k_1, k_2)
    times = np.linspace(0, 1.3 * expected, 2601)
    start = nlctl.initial_state(loop, {"law.w": w_0})
    response = nlctl.input_output_response(loop, times, 0, start, rtol=1e-8, atol=1e-10)
    w = response.states[nlctl.state_names(loop).index("law.w")]
    moving = np.abs(w) > 0.01 * w_0  # of what is left to come, a hundredth
    assert times[moving].max() == pytest.approx(expected, rel=0.03)
    assert np.abs(response.outputs[0][times > 1.1 * expected]).max() < 1e-5


@each_row(("slope", "phi"), [(1.0, 0.01), (-3.0, 0.1)])
def test_behind_a_ramp_the_layer_leaves_phi_times_slope_over_k_2(slope, phi):
    """w' = -slope: r = phi slope / k_2 within the layer; the ramp itself grows without bound."""
    law = nlctl.controllers.SuperTwistingLaw(k_1=3.0, k_2=4.0, phi=phi)
    response = nlctl.input_output_response(
        loop_of(law, slope=slope), np.linspace(0, 30, 301), rtol=1e-9, atol=1e-12
    )
    assert response.outputs[0][-1] == pytest.approx(phi * slope / 4.0, rel=1e-5)
    assert abs(response.outputs[1][-1]) > 25 * abs(slope)


def test_levants_gains_hold_every_disturbance_of_their_rate():
    """k_1 = 1.5 sqrt(L), k_2 = 1.1 L: |d'| <= L leaves |r| of the layer's size, whatever |d|."""
    L, size, rng = 5.0, 24, np.random.default_rng(2)
    law = nlctl.controllers.SuperTwistingLaw(k_1=1.5 * np.sqrt(L), k_2=1.1 * L, phi=1e-3)
    omega = rng.uniform(0.2, 5, size)
    params = {"surface.omega": omega, "surface.a": L / omega}  # |d'| = L, |d| up to 25
    many = nlctl.ensemble_response(
        loop_of(law), np.linspace(0, 30, 3001), 0, {"surface.r": rng.uniform(-1, 1, size)},
        params=params, keep=["r"],
    )  # fmt: skip
    assert set(many.table["status"]) == {"OK"}
    assert np.abs(many.signals["r"][:, 2000:]).max() < 3e-3


@given(numbers, numbers, positive, positive, st.floats(1e-3, 1))
def test_the_law_is_odd_continuous_and_the_authors_outside_of_the_layer(r, w, k_1, k_2, phi):
    """Against the printed formula where |r| >= phi; (-r, -w) gives -u; no jump at the edges."""
    law = nlctl.controllers.SuperTwistingLaw(k_1=k_1, k_2=k_2, phi=phi)
    p = equation_arguments(law)
    u, rate = law.output(0.0, (w,), (r,), p)[0], law.update(0.0, (w,), (r,), p)[0]
    assert law.output(0.0, (-w,), (-r,), p)[0] == -u
    assert abs(rate) <= k_2 * (1 + 1e-12)
    if abs(r) >= phi:
        assert u == pytest.approx(-k_1 * abs(r) ** 0.5 * np.sign(r) + w, rel=1e-9, abs=1e-9)
        assert rate == pytest.approx(-k_2 * np.sign(r), rel=1e-12)
    edges = [law.output(0.0, (w,), (phi * (1 + s),), p)[0] for s in (-1e-9, 1e-9)]
    assert edges[0] == pytest.approx(edges[1], abs=1e-7 * (1 + k_1))


def test_it_stands_in_the_place_of_the_sliding_mode_law():
    """Example 1 behind its dead zone: the error stays, the input no longer jumps."""
    times = np.linspace(0, 20, 4001)
    found = {}
    for law in (
        nlctl.controllers.SlidingModeLaw(K=12.0, phi=0.01),
        nlctl.controllers.SuperTwistingLaw(),
    ):
        loop = nlctl.paper.example_1(controller=nlctl.sliding_mode(law=law), actuator=nlctl.Gain())
        response = nlctl.input_output_response(loop, times)
        e, u = (response.outputs[loop.output_index[name]] for name in ("e", "u"))
        late = times > 10
        found[type(law)] = np.abs(e[late]).max(), np.abs(np.diff(u[times < 3])).max()
    plain, twisting = found.values()
    assert twisting[0] < 0.05
    assert twisting[1] < plain[1]
