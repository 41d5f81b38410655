"""Conditions that a state hardly moves over: what short steps add to it is lost in rounding."""

import control as ct
import numpy as np
import pytest

import nlctl

METHODS = ["tsit5", "rodas5p", "taylor", "auto"]


def oscillator(t, x, u, params):
    """sin t, and how long it is above 1 - eps."""
    return [x[1], -x[0], 1.0 if x[0] > 1.0 - params["eps"] else 0.0]


def drift(t, x, u, params):
    """1 + d - s t, and how long it is above 1."""
    return [-params["s"], 1.0 if x[0] > 1.0 else 0.0]


def compiled(function, states, **params):
    return nlctl.compile(
        ct.nlsys(function, None, inputs=0, outputs=states, states=states, params=params, name="g")
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("eps", [1e-3, 1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("rtol", [1e-8, 1e-9, 1e-10])
def test_a_peak_just_above_a_level(method, eps, rtol):
    """Twice in ten seconds; an error of x moves both ends by its part of the slope there."""
    if 30.0 * rtol > eps:
        pytest.skip("the peak is no higher than the error")
    z = nlctl.input_output_response(
        compiled(oscillator, 3, eps=eps), [0, 10], initial_state=[0, 1, 0], method=method,
        rtol=rtol, atol=1e-2 * rtol,
    ).states[2, -1]  # fmt: skip
    assert z == pytest.approx(4.0 * np.arccos(1.0 - eps), abs=20.0 * rtol / np.sqrt(2.0 * eps))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("s", [1.0, 1e-3, 1e-6, 1e-9])
def test_a_slow_drift_over_a_level(method, s):
    z = nlctl.input_output_response(
        compiled(drift, 2, s=s), [0, 2], initial_state=[1.0 + s, 0], method=method,
        rtol=1e-9, atol=1e-11,
    ).states[1, -1]  # fmt: skip
    assert z == pytest.approx(1.0, abs=1e-8 + 4e-15 / s)


def closing(t, x, u, params):
    """Falls to 600 at about 88 a second, and stays there."""
    return [np.where(x[0] <= 600, 0.0, -88.0 + 0.01 * (x[0] - 600) + np.sin(3 * t))]


@pytest.mark.parted
@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "auto"])
def test_a_state_that_stops_where_its_rate_ends(method, rtol):
    """No stage of a step that ends before the level has seen the rate behind it."""
    diagram = compiled(closing, 1)
    for start in np.linspace(700.0, 1500.0, 25):
        x = nlctl.input_output_response(
            diagram, [0, 20], 0, [start], method=method, rtol=rtol, atol=1e-2 * rtol, audit=False
        ).states[0, -1]
        assert x == pytest.approx(600.0, abs=600.0 * rtol)


def next_to_what_is_always_zero(t, x, u, params):
    """A staircase that holds x[0], cut twice: the second cut has a function that stays 0."""
    steps = np.trunc((x[0] + 0.3189 * np.tanh(x[1])) / 0.1088).astype(int) * 0.1088
    pulses = 1.466 * (np.trunc(t / 0.1153).astype(int) % 2)
    sides = np.sign(x[1] - 0.2513 * np.sin(1.028 * t)) * np.sign(1.438 * x[0] + 0.2588 * x[1])
    return [
        -1.978 * x[0] - 0.3626 * x[1] - 0.3818 * steps,
        -0.9219 * x[1] - 0.07964 * x[2] + pulses,
        -1.517 * x[2] - 0.3621 * x[0] + 0.9022 * np.sin(1.923 * t) - 0.9476 * sides,
    ]


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8])
@pytest.mark.parametrize("method", ["tsit5", "auto", "taylor"])
def test_a_condition_that_stays_zero_widens_no_step_across_another(method, rtol):
    """The stiff method is the reference: a step across was 0.07 s long."""
    loop, times = compiled(next_to_what_is_always_zero, 3), np.linspace(0, 8, 41)
    start = [0.6647856352638082, -0.06674310019151375, 0.8535402135207752]
    run, reference = (
        nlctl.input_output_response(loop, times, 0, start, method=name, rtol=tol, atol=1e-2 * tol)
        for name, tol in ((method, rtol), ("rodas5p", 1e-10))
    )
    np.testing.assert_allclose(run.states, reference.states, rtol=0, atol=10 * rtol)
