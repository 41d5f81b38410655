"""Intermediate values that overflow where the rate does not, and rates whose coefficients are not
finite: Taylor's method has closed forms all the same, and what diverges diverges."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import DivergedError

CATALAN = 0.915965594177219  # the integral of arctan(e^s) up to 0
TIMES = np.linspace(0, 10, 101)


def pulse(t, x, u, params):
    return [1.0 / np.cosh(300.0 * (t - 5.0)) ** 2]


def logistic(t, x, u, params):
    return [1.0 / (1.0 + np.exp(-900.0 * (t - 5.0)))]


def folded(t, x, u, params):
    return [np.exp(-np.exp(200.0 * (t - 2.0))) + np.tanh(np.exp(200.0 * (t - 2.0)))]


def inverse_tangent(t, x, u, params):
    return [np.arctan(np.exp(500.0 * (t - 5.0)))]


def logistic_of_state(t, x, u, params):
    return [1.0 + 1.0 / (1.0 + np.exp(900.0 * (5.0 - x[0])))]


def root_of_time(t, x, u, params):
    return [np.sqrt(np.abs(t - 3.0))]


def root_at_rest(t, x, u, params):
    """An oscillator next to the root of a state that rests at 0."""
    return [x[1], -x[0] + np.sqrt(x[2]), 0.0]


def blows_up(t, x, u, params):
    return [x[0] ** 2]


def ends_as_nan(t, x, u, params):
    return [np.sqrt(4.05 - t) / np.cosh(900.0 * (t - 5.0))]


CLOSED = {
    pulse: lambda t: (1.0 + np.tanh(300.0 * (t - 5.0))) / 300.0,
    logistic: lambda t: np.logaddexp(0.0, 900.0 * (t - 5.0)) / 900.0,
    inverse_tangent: lambda t: np.where(
        np.isclose(t, 5.0), CATALAN / 500.0, 0.5 * np.pi * np.maximum(t - 5.0, 0.0)
    ),
    root_of_time: lambda t: (3.0**1.5 + np.sign(t - 3.0) * np.abs(t - 3.0) ** 1.5) / 1.5,
}


def diagram(update, n=1):
    return nlctl.compile(ct.nlsys(update, None, inputs=0, outputs=n, states=n, name="loop"))


def ran(update, x0, method, **more):
    return nlctl.input_output_response(
        diagram(update, len(x0)), TIMES, initial_state=x0, method=method, **more
    )


@pytest.mark.parted
@pytest.mark.parametrize("method", ["taylor", "auto"])
@pytest.mark.parametrize("update", list(CLOSED))
def test_the_integral_is_the_closed_form(update, method):
    found = ran(update, [0.0], method, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found.states[0], CLOSED[update](TIMES), atol=2e-8)


def test_two_that_switch_at_one_time_are_constant_on_both_sides():
    """exp(-e) + tanh(e) of e = exp(200 (t - 2)): 1 before and 1 behind."""
    found, pair = (ran(folded, [0.0], m, rtol=1e-9, atol=1e-11) for m in ("taylor", "tsit5"))
    np.testing.assert_allclose(found.states, pair.states, atol=1e-8)
    np.testing.assert_allclose(np.diff(found.states[0])[22:], 0.1, atol=1e-8)


def test_a_logistic_function_of_a_state_between_its_limits():
    """x' = 2 - 1 / (1 + e^z), z = 900 (x - 5): twice as fast behind 5 as before, 1 from 0 on."""
    found = ran(logistic_of_state, [0.0], "taylor", rtol=1e-9, atol=1e-11).states[0]
    before, behind = TIMES < 4.9, TIMES > 5.1
    np.testing.assert_allclose(found[before], TIMES[before], atol=1e-8)
    np.testing.assert_allclose(np.diff(found[behind]), 0.2, atol=1e-8)


@pytest.mark.parametrize("method", ["taylor", "auto"])
def test_a_root_at_rest_leaves_the_other_states_as_they_are(method):
    found = ran(root_at_rest, [1.0, 0.0, 0.0], method, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found.states[0], np.cos(TIMES), atol=1e-8)


def test_members_whose_coefficients_are_not_finite_run_as_alone():
    x0 = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.5, 0.0, 0.0]])
    compiled = diagram(root_at_rest, 3)
    many = nlctl.ensemble_response(
        compiled, TIMES, initial_state=x0, method="taylor", keep=["y[0]"], rtol=1e-9, atol=1e-11
    )
    offset = np.sqrt(x0[:, 2])[:, None]
    exact = offset + (x0[:, :1] - offset) * np.cos(TIMES)
    np.testing.assert_allclose(many.signals["y[0]"], exact, atol=1e-8)
    assert many.table["status"].tolist() == ["OK"] * 3


@pytest.mark.parametrize("method", ["taylor", "auto", "tsit5"])
@pytest.mark.parametrize(("update", "x0", "time"), [(blows_up, 1.0, 1.0), (ends_as_nan, 0.0, 4.05)])
def test_what_has_no_solution_ends_where_it_ends(update, x0, time, method):
    with pytest.raises(DivergedError, match="diverged") as caught:
        ran(update, [x0], method)
    assert caught.value.time == pytest.approx(time, abs=1e-3)


@pytest.mark.parametrize("method", ["taylor", "auto"])
def test_a_root_of_time_with_fixed_steps(method):
    found = ran(root_of_time, [0.0], method, step=1e-3)
    np.testing.assert_allclose(found.states[0], CLOSED[root_of_time](TIMES), atol=1e-4)
