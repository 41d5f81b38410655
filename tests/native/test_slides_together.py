"""Runs along several conditions, in turn or at once, and where several solutions leave them."""

import math
from dataclasses import replace

import control as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nlctl
from nlctl.native.slid import compare_sides, slides_at, with_modes, with_relays

WIDTH = 1e-5
methods = pytest.mark.parametrize("method", [None, "tsit5", "rodas5p", "taylor"])


def plain(update, states):
    """A system of one block that outputs its states."""
    return ct.nlsys(update, None, states=states, inputs=0, outputs=states, name="plant")


def push(t):
    """-3 from 1 to 2 s."""
    return -3.0 if 1 < t < 2 else 0.0


def of_a_square(t, x, u, params):
    return [push(t) - np.sign(x[0] ** 2 - 0.25) * np.sign(x[0])]


def of_three_factors(t, x, u, params):
    return [push(t) - np.sign(x[0] - 0.5) * np.sign(x[0]) * np.sign(x[0] + 0.5)]


def of_one_product(t, x, u, params):
    return [push(t) - np.sign(x[0] * (x[0] - 0.5) * (x[0] + 0.5))]


@methods
@pytest.mark.parametrize("update", [of_a_square, of_three_factors, of_one_product])
def test_products_of_signs_slide_at_each_of_their_zeros(update, method):
    """At 1/2 until it is pushed, by -2, -4 and -2, and then back at 1 to -1/2."""
    times = np.linspace(0, 5, 41)
    run = nlctl.input_output_response(plain(update, 1), times, 0, 1.0, method=method)
    right = np.interp(
        times, [0, 0.5, 1, 1.25, 1.375, 2, 3.25, 5], [1, 0.5, 0.5, 0, -0.5, -1.75, -0.5, -0.5]
    )
    np.testing.assert_allclose(run.states[0], right, rtol=0, atol=1e-6)
    assert len(run.statistics.slides) == 2
    assert run.statistics.forks == ()


def by_its_own_sine(t, x, u, params):
    sides = np.sign(x[0] - 0.5) + np.sign(x[0] + 0.5)
    return [0.75 * math.sin(t) - 0.5 * sides]


@methods
def test_two_conditions_of_one_rate_with_a_sine_of_math(method):
    """It slides at 1/2 while the sine is above 0, and at -1/2 while it is below."""
    times = np.linspace(0, 2 * np.pi + 0.5, 61)
    run = nlctl.input_output_response(plain(by_its_own_sine, 1), times, 0, 0.5, method=method)
    meets = np.pi + np.arccos(1 - 1 / 0.75)
    right = np.select(
        [times < np.pi, times < meets, times < 2 * np.pi],
        [0.5, 0.5 - 0.75 * (1 + np.cos(times)), -0.5],
        -0.5 + 0.75 * (1 - np.cos(times)),
    )
    np.testing.assert_allclose(run.states[0], right, rtol=0, atol=1e-6)


def counts_and_signs(t, x, u, params):
    return [0.3 * math.sin(t) - np.floor(4 * x[0] + 0.5) / 4 - 0.5 * np.sign(x[0] - 0.5)]


@methods
def test_steps_and_a_sign_of_one_rate(method):
    """From 1.2 down to 1/2, where both jump: there they keep it, and so does a steep ramp."""
    times = np.linspace(0, 6, 61)
    run = nlctl.input_output_response(plain(counts_and_signs, 1), times, 0, 1.2, method=method)

    def smoothed(t, x):
        part = 4 * x + 0.5 - np.round(4 * x + 0.5)
        steps = np.round(4 * x + 0.5) - 0.5 + 0.5 * np.tanh(part / WIDTH)
        return 0.3 * np.sin(t) - steps / 4 - 0.5 * np.tanh((x - 0.5) / WIDTH)

    smooth = solve_ivp(smoothed, (0, 6), [1.2], method="LSODA", t_eval=times, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(run.states[0], smooth.y[0], rtol=0, atol=20 * WIDTH)


def turned_by_the_other(t, x, u, params):
    return [0.4 * np.cos(t) - np.sign(x[0]) * np.sign(2.0 + x[1]), -1.5 * np.sign(x[1] - np.sin(t))]


@methods
def test_what_is_multiplied_slides_next_to_what_multiplies_it(method):
    """x rests at 0 and y follows a sine; the factor sign(2 + y) is 1."""
    times = np.linspace(0, 7, 29)
    run = nlctl.input_output_response(
        plain(turned_by_the_other, 2), times, 0, [0.5, 1.0], method=method
    )
    late = times > 2
    np.testing.assert_allclose(run.states[0, late], 0, rtol=0, atol=1e-6)
    np.testing.assert_allclose(run.states[1, late], np.sin(times[late]), rtol=0, atol=1e-6)


def both_at_once(t, x, u, params):
    both = np.sign(x[0]) * np.sign(x[1])
    return [0.2 - np.sign(x[0]) - 0.3 * both, 0.1 - np.sign(x[1]) - 0.3 * both]


@methods
def test_a_product_of_which_both_slide_has_no_one_answer(method):
    """Filippov's field at the meeting of both is not one: it ends with the reason."""
    with pytest.raises(nlctl.errors.ChatteringError, match="is chattering"):
        nlctl.input_output_response(
            plain(both_at_once, 2), np.linspace(0, 5, 11), 0, [0.5, 0.8], method=method,
            max_steps=100_000,
        )  # fmt: skip


def test_sides_are_compared_with_the_equations():
    """Relays on their sides have the rates of the diagram; with its sides exchanged one has not."""
    compiled = nlctl.compile(plain(lambda t, x, u, p: [-1.0 if x[0] > 0.5 else 1.0], 1))
    jump = nlctl.input_output_response(
        compiled, [0, 2.0], 0, 1.0, slide=False, ignore_errors=True
    ).statistics.jump
    p = compiled.parameter_vector(None)
    ((slide, _),) = slides_at(compiled, p, jump, np.full(1, 1e-6))[0]
    low, high = slide.sides[0]
    for sides, fits in (((low, high), True), ((high, low), False)):
        slid = with_relays(compiled, (replace(slide, sides=(sides,)),), p)
        whole = np.append(p, np.ones(8))[: slid.parameter_vector(None).size]
        if fits:
            compare_sides(compiled, slid, p, whole, jump)
        else:
            with pytest.raises(nlctl.errors.CompileError, match="do not stand for"):
                compare_sides(compiled, slid, p, whole, jump)


def test_relays_slide_at_first_and_no_side_has_led_away():
    assert with_modes(np.ones(1), 2, np.array([1.0, 3.0])).tolist() == [1, 0, -1, 0, -1]


@methods
def test_where_both_sides_lead_away_the_run_says_so(method):
    """x' = -(1 - t) sign(x) rests until t = 1; then x = 0 and x = +-(t - 1)^2 / 2 are solutions."""
    times = np.linspace(0, 3, 13)
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: [-(1 - t) * np.sign(x[0])], 1), times, 0, 0.2, method=method
    )
    assert run.statistics.forks == pytest.approx((1.0,), abs=1e-6)
    assert "forks    at 1 s both sides lead away: there are several solutions" in str(run)
    late = times > 1.1
    assert np.abs(run.states[0, late]) == pytest.approx((times[late] - 1) ** 2 / 2, abs=1e-6)


FORKING = {
    "a state": lambda t, x, u, p: [1.0, 0.7 * x[0] * np.sign(x[1])],
    "a sign of a state": lambda t, x, u, p: [1.0, 0.7 * np.sign(x[0]) * np.sign(x[1])],
    "time": lambda t, x, u, p: [1.0, 0.7 * (t - 1) * np.sign(x[1])],
    "a sign of time": lambda t, x, u, p: [1.0, 0.7 * np.sign(t - 1) * np.sign(x[1])],
}


@pytest.mark.parametrize("last", [3.0, 2.9])  # there are samples at 1 s, and none
@pytest.mark.parametrize("gain", FORKING)
@methods
def test_whatever_turns_a_gain_says_where_both_sides_lead_away(method, gain, last):
    """y' = 0.7 g sign(y) with g = t - 1, or its sign: y = 0 attracts until 1 s, and then repels."""
    times = np.linspace(0, last, 31)
    run = nlctl.input_output_response(plain(FORKING[gain], 2), times, 0, [-1.0, 0.3], method=method)
    late = times - 1 if "sign" in gain else (times - 1) ** 2 / 2
    right = np.where(times > 1, 0.7 * late, 0.0)
    assert run.statistics.forks == pytest.approx((1.0,), abs=1e-6)
    behind = times > 0.7
    np.testing.assert_allclose(np.abs(run.states[1])[behind], right[behind], atol=1e-6)


@methods
def test_a_gain_that_touches_zero_is_no_fork(method):
    """y' = -(t - 1)^2 sign(y) stays at 0: behind 1 s it attracts as before."""
    times = np.linspace(0, 3, 31)
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: [-((t - 1) ** 2) * np.sign(x[0])], 1), times, 0, 0.2, method=method
    )
    assert run.statistics.forks == ()
    np.testing.assert_allclose(run.states[0, times > 0.5], 0.0, atol=1e-6)


def test_where_one_side_leads_away_there_is_one_way():
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: [0.2 - (1 - t) * np.sign(x[0])], 1), [0, 1, 3], 0, 0.2
    )
    assert run.statistics.slides
    assert run.statistics.forks == ()
    assert "forks" not in str(run)


def drawn_to_zero(t, x, u, params):
    return [-1.2 * x[0] - np.sign(x[0]), u[0] - x[1]]


@methods
@pytest.mark.parametrize("start", [-0.65, 0.4, 1.0])
def test_it_slides_where_a_sign_jumps_and_not_where_a_play_turns(method, start):
    """The play is in contact where x comes to rest: both change together there alone."""
    plant = ct.nlsys(
        drawn_to_zero, lambda t, x, u, p: x, states=2, inputs=["v"], outputs=["u", "z"],
        name="plant",
    )  # fmt: skip
    gap = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.2, c_l=-0.1)
    loop = nlctl.interconnect({"gap": gap, "plant": plant}, outputs=["u", "v", "z"])
    times = np.linspace(0, 3, 31)
    run = nlctl.input_output_response(loop, times, 0, {"plant.x[0]": start}, method=method)
    size = np.maximum((abs(start) + 1 / 1.2) * np.exp(-1.2 * times) - 1 / 1.2, 0.0)
    np.testing.assert_allclose(run.outputs[0], np.sign(start) * size, rtol=0, atol=1e-6)
    right = max(start - 0.2, 0.0) if start > 0 else min(start + 0.1, 0.0)
    right = min(max(right, -0.2), 0.1)  # what it is left at by u = 0
    np.testing.assert_allclose(run.outputs[1, -1], right, rtol=0, atol=1e-6)
