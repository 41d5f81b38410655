"""Kinks of what is rounding: they move nothing, and no run stands still at them."""

import control as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nlctl

TIMES = np.linspace(0.0, 10.0, 101)
START = [0.3, 0.5]


def rounded(x):
    """0 but for rounding, of some 1e-5."""
    return (3e11 * x[0] + 1e11 * x[1]) - 1e11 * x[1] - 3e11 * x[0]


def smooth(t, x, u, params):
    return [-x[0] + np.sin(3 * t), x[0] - x[1]]


def with_noise(t, x, u, params):
    dx = smooth(t, x, u, params)
    return [dx[0], dx[1] + 1e-20 * np.abs(rounded(x))]


def with_several(t, x, u, params):
    dx = smooth(t, x, u, params)
    noise = np.abs(rounded(x)) + np.maximum(rounded(x[::-1]), 0.0) + np.abs(rounded(2.7 * x))
    return [dx[0], dx[1] + 1e-20 * noise]


def bent(t, x, u, params):
    """Also with kinks of another kind, ten of them."""
    dx = with_noise(t, x, u, params)
    return [dx[0], dx[1] + 3.0 * np.abs(x[0] - 0.05)]


def response(update, method):
    loop = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="noisy")
    compiled = nlctl.compile(loop)
    return nlctl.input_output_response(
        compiled, TIMES, 0.0, START, method=method, rtol=1e-8, atol=1e-10, max_steps=20_000
    )


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "auto"])
@pytest.mark.parametrize("update", [with_noise, with_several])
def test_a_run_goes_through_kinks_of_rounding(update, method):
    """As far as without them: what they add is 1e-25."""
    run = response(update, method)
    assert run.statistics.conditions == 1 + 2 * (update is with_several)
    np.testing.assert_allclose(run.states, response(smooth, method).states, rtol=0, atol=1e-7)


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "auto"])
def test_other_kinks_are_right_meanwhile(method):
    """Against SciPy, by the rates of Python."""
    exact = solve_ivp(
        lambda t, x: bent(t, x, None, {}), TIMES[[0, -1]], START, "DOP853", TIMES,
        rtol=1e-11, atol=1e-13, max_step=1e-2,
    ).y  # fmt: skip
    np.testing.assert_allclose(response(bent, method).states, exact, rtol=0, atol=1e-6)
