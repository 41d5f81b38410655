"""nlctl.input_output_response: python-control's integration with checks around it."""

import control as ct
import numpy as np
import pytest
from rows import each_row

import nlctl


@nlctl.equation
def escaping(x, v):
    """x' = x^2 + v escapes in finite time."""
    (x1,) = x
    return x1 * x1 + v


def escaping_plant(x0):
    return nlctl.block(nlctl.PureFeedback(order=1, f=escaping, initial={"x1": x0}), "plant")


@pytest.mark.parametrize("method", ["LSODA", "RK45", "DOP853"])
def test_finite_escape_is_reported_with_its_time(method):
    """x' = x^2 from 1 escapes at t = 1: an error with that time, no calm response."""
    with pytest.raises(nlctl.errors.DivergedError, match="'plant' diverged") as caught:
        nlctl.input_output_response(escaping_plant(1.0), [0, 0.5, 2], method=method)
    assert caught.value.time == pytest.approx(1, abs=1e-6)


def test_before_the_escape_the_solution_is_the_closed_form():
    """x(t) = 1 / (1 - t)."""
    t = np.linspace(0, 0.9, 10)
    response = nlctl.input_output_response(escaping_plant(1.0), t, rtol=1e-10)
    np.testing.assert_allclose(response.y[0], 1 / (1 - t), rtol=1e-7)


def test_an_algebraic_loop_keeps_its_own_message():
    """A ring of feedthrough is not a divergence."""
    one = ct.nlsys(None, lambda t, x, u, params: 2 * u + 1, inputs="a", outputs="b", name="one")
    two = ct.nlsys(None, lambda t, x, u, params: 2 * u + 1, inputs="b", outputs="a", name="two")
    integrator = ct.nlsys(lambda t, x, u, params: u, None, inputs="b", states=1, name="int")
    ring = ct.interconnect([one, two, integrator], outputs="b", check_unused=False)
    with pytest.raises(RuntimeError, match="algebraic loop"):
        nlctl.input_output_response(ring, [0, 1], engine="python-control")


@each_row("times", [[0], [], [0, 1, 1], [1, 0], [0, np.nan], [0, np.inf], [[0, 1], [2, 3]]])
def test_bad_time_grids_are_refused(times):
    """Times must be finite, increasing, at least two."""
    with pytest.raises(nlctl.errors.ParameterError, match="timepts needs"):
        nlctl.input_output_response(escaping_plant(0.1), times)


def test_inputs_parameters_and_initial_state_reach_python_control():
    """A first-order lag x' = -x + v driven by a ramp has the closed form t - 1 + 2 exp(-t)."""

    @nlctl.equation
    def lag(x, v):
        return -x[0] + v

    plant = nlctl.block(nlctl.PureFeedback(order=1, f=lag), "plant")
    t = np.linspace(0, 3, 31)
    response = nlctl.input_output_response(plant, t, t, {"x1": 1.0}, rtol=1e-10)
    np.testing.assert_allclose(response.y[0], t - 1 + 2 * np.exp(-t), atol=1e-8)
    response = nlctl.input_output_response(plant, t, t, [1.0], rtol=1e-10)
    np.testing.assert_allclose(response.y[0], t - 1 + 2 * np.exp(-t), atol=1e-8)


def test_progress_is_told_increasing_times_up_to_the_end():
    """The last accepted step ends at the last time or beyond it."""
    seen = []
    nlctl.input_output_response(escaping_plant(-1.0), [0, 1, 2], progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] >= 2 - 1e-9
