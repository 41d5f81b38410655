"""Conditions with poles, and switches right behind the end of a step, against closed forms."""

from __future__ import annotations

import control as ct
import numpy as np
import pytest

import nlctl

METHODS = [{"method": "tsit5"}, {"method": "rodas5p"}, {"method": "taylor"}]
METHODS.append({"engine": "python-control"})
PI = np.pi


def tangent(t, x, u, params):
    return [1.0, np.where(2.0 * np.tan(x[0]) > 2.0, 1.0, 0.0)]


def shifted(t, x, u, params):
    return [1.0, np.where(1.0 / (x[0] - 1.0) + 0.5 > 1.0, 1.0, 0.0)]


def between(t, x, u, params):
    return [1.0, np.where(1.0 / (x[0] - 1.0) < 1.0 / (3.0 - x[0]), 1.0, 0.0)]


# where each is 1: x from 0.05 to 5
WINDOWS = {
    tangent: [(PI / 4, PI / 2), (5 * PI / 4, 3 * PI / 2)],
    shifted: [(1.0, 3.0)],
    between: [(0.05, 1.0), (2.0, 3.0)],
}


@pytest.mark.parted
@pytest.mark.parametrize("how", METHODS, ids=lambda how: "-".join(how.values()))
@pytest.mark.parametrize("rates", WINDOWS, ids=lambda rates: rates.__name__)
def test_a_pole_of_what_is_compared_is_a_switch(rates, how):
    system = ct.nlsys(rates, None, states=2, inputs=0, outputs=2, name="s")
    run = nlctl.input_output_response(system, [0.05, 5.0], 0, [0.05, 0.0], **how)
    edges = [edge for window in WINDOWS[rates] for edge in window if edge > 0.05]
    assert np.allclose(run.events["time"], edges, rtol=0, atol=1e-6)
    width = sum(b - a for a, b in WINDOWS[rates])
    assert abs(run.states[1, -1] - width) < 1e-6


@pytest.mark.parametrize("how", [{}, {"engine": "python-control"}], ids=["native", "reference"])
def test_a_relay_that_only_a_delay_sees_switches_next_to_a_break_that_arrives(how):
    # y' = w is the output of the relay 0.1 s ago: a triangle, of amplitude 0.25 + 0.1.  The break
    # that arrives ends a step right before the next threshold.
    plant = ct.ss(0, 1, 1, 0, inputs="w", outputs="y", name="plant")
    law = ct.summing_junction(["-y"], "u", name="law")
    relay = nlctl.Relay(v0=1.0, on=0.25, off=-0.25)
    delay = nlctl.TransportDelay(inputs=("v",), outputs=("w",), delay=0.1, before=1.0)
    loop = nlctl.interconnect(
        {"plant": plant, "law": law, "relay": relay, "delay": delay}, outputs=["y"]
    )
    times = np.linspace(0, 3, 31)
    y = nlctl.input_output_response(loop, times, squeeze=True, **how).outputs
    phase = (times + 0.35) % 1.4
    assert np.allclose(y, np.where(phase < 0.7, phase - 0.35, 1.05 - phase), rtol=0, atol=1e-6)


@pytest.mark.parametrize("how", [{}, {"engine": "python-control"}], ids=["native", "reference"])
def test_what_begins_within_rounding_of_a_threshold_goes_on_behind_a_delay(how):
    # the sign switches 1e-20 s behind the start: its piece of the past is no shortest step
    rate = ct.nlsys(
        None, lambda t, x, u, p: [-np.sign(u[0] - 1e-20)], inputs=["y"], outputs=["v"], name="rate"
    )
    plant = ct.ss(0, 1, 1, 0, inputs="w", outputs="y", name="plant")
    delay = nlctl.TransportDelay(inputs=("v",), outputs=("w",), delay=0.5, before=1.0)
    loop = nlctl.interconnect({"plant": plant, "rate": rate, "delay": delay}, outputs=["y"])
    times = np.linspace(0, 4, 9)
    y = nlctl.input_output_response(loop, times, squeeze=True, **how).outputs
    phase = times % 2.0  # a triangle: 0.5 s after each passage through 0 it turns
    triangle = np.where(phase < 0.5, phase, np.where(phase < 1.5, 1.0 - phase, phase - 2.0))
    assert np.allclose(y, triangle, rtol=0, atol=1e-6)


@nlctl.record
class Megahertz:
    """A saw tooth of 1 MHz."""

    inputs, outputs, states, feedthrough = (), ("saw",), ("saw",), False

    @nlctl.equation
    def update(t, x, u, p):
        return (1e6,)

    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)

    @nlctl.equation
    def guard(t, x, u, p):
        return (1.0 - x[0],)

    @nlctl.equation
    def reset(t, x, u, p):
        return (x[0] - 1.0,)


@pytest.mark.parted
@pytest.mark.parametrize("how", METHODS, ids=lambda how: "-".join(how.values()))
def test_fast_jumps_late_in_time_are_no_accumulation(how):
    # a period of 1e-6 s is a thousand roundings of a time of 1e5 s and more
    block = nlctl.block(Megahertz(), "saw")
    run = nlctl.input_output_response(block, [1e5, 1e5 + 3.005e-4], 0, **how)
    assert len(run.events) == 300
    assert np.allclose(np.diff(run.events["time"]), 1e-6, rtol=0, atol=1e-9)


def bell(t, x, u, params):
    return [1.0, np.where(1 / (1 + 4000 * (x[0] - 1) ** 2) > 0.5, 1.0, 0.0)]


def sign_of_bell(t, x, u, params):
    return [1.0, 0.5 + 0.5 * np.sign(1 / (1 + 4000 * (x[0] - 1) ** 2) - 0.5)]


def sign_of_gauss(t, x, u, params):
    return [1.0, 0.5 + 0.5 * np.sign(np.exp(-4000 * (x[0] - 1) ** 2) - 0.5)]


def by_a_root(t, x, u, params):
    return [1.0, np.heaviside(0.5 / np.sqrt(1 + 4000 * (x[0] - 1) ** 2) - 0.25, 0.5)]


def bell_less_bell(t, x, u, params):
    q = 1 + 4000 * (x[0] - 1) ** 2
    return [1.0, np.where(3 / q > 1 + 1 / q, 1.0, 0.0)]


# half of the width of each window, in sqrt(4000) |x - 1|
BELLS = {
    bell: 1.0, sign_of_bell: 1.0, sign_of_gauss: np.sqrt(np.log(2)), by_a_root: np.sqrt(3),
    bell_less_bell: 1.0,
}  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("how", METHODS, ids=lambda how: "-".join(how.values()))
@pytest.mark.parametrize("rates", BELLS, ids=lambda rates: rates.__name__)
def test_a_narrow_window_of_a_bell_is_not_stepped_over(rates, how):
    system = ct.nlsys(rates, None, states=2, inputs=0, outputs=2, name="s")
    run = nlctl.input_output_response(system, [0.05, 5.0], 0, [0.05, 0.0], **how)
    width = 2 * BELLS[rates] / np.sqrt(4000)
    assert run.states[1, -1] == pytest.approx(width, abs=1e-6)


def test_long_chains_of_quotients_and_products_stay_short():
    """Each divisor that is cleared makes products longer: in a chain of 30 there are few."""

    def chain(t, x, u, params):
        y, z = x[0], x[0] + 1.0
        for _ in range(30):
            y, z = (1 / y + y) / (y + 2), y * z
        return [np.where((y > 0.4) & (z * y * z > 0.0), -x[0], 0.0)]  # y tends to 0.618

    system = ct.nlsys(chain, None, states=1, inputs=0, outputs=1, name="s")
    run = nlctl.input_output_response(system, [0.0, 1.0], 0, [1.0], rtol=1e-9)
    assert run.states[0, -1] == pytest.approx(np.exp(-1), abs=1e-8)
