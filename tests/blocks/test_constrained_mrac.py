"""Input-constrained MRAC (Karason, Annaswamy): their scalar loop, and its Lyapunov function."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.params import equation_arguments

T = np.linspace(0, 20, 4001)
START = {
    "controller.model.xm1": -9.9,
    "controller.weights.W_hat[0]": 2.2,
    "controller.weights.W_hat[1]": -1.1,
}


@nlctl.equation
def unstable(x, v):
    return x[0] + v


def loop_of(error):
    """x' = x + u, |u| <= 10, after xm' = -xm + 5 sin(0.5 t), from x = -9.99: hardly to be held."""
    controller = nlctl.mrac(
        nlctl.controllers.ReferenceModel(a=(1.0,), b=1.0),
        error=error,
        weights=nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=0.1, sigma_1=0.0),
        law=nlctl.controllers.ConstrainedLaw(u_max=10.0),
    )
    command = nlctl.SumOfSines(order=0, amplitudes=5.0, frequencies=0.5, phases=0.0)
    plant = nlctl.PureFeedback(order=1, f=unstable, initial={"x1": -9.99})
    blocks = {"command": command, "plant": plant, "controller": controller, "a": nlctl.Gain()}
    return nlctl.interconnect(blocks, outputs=["x1", "u", "e", "r", "W_norm"])


def run_of(error):
    loop = loop_of(error)
    start = nlctl.initial_state(loop, START)
    response = nlctl.input_output_response(loop, T, 0, start, rtol=1e-10, atol=1e-12)
    return response, dict(zip(nlctl.state_names(loop), response.states, strict=True))


CONSTRAINED = nlctl.controllers.ConstrainedError(
    K=(1.0,), Q=(2.0,), gamma_d=1.0
)  # P = 1, as theirs


@pytest.mark.slow
def test_the_loop_of_the_authors_written_in_their_symbols():
    """theta, k, beta_delta, e_delta as one `ct.nlsys`, in python-control's own simulation."""

    def rates(t, x, u, params):
        x_p, x_m, theta, k, beta, e_d = x
        command = 5 * np.sin(0.5 * t)
        u_c = theta * x_p + k * command
        allowed = np.clip(u_c, -10, 10)
        e_u = x_p - x_m - e_d
        return [
            *(x_p + allowed, -x_m + command, -0.1 * e_u * x_p, -0.1 * e_u * command),
            *(e_u * (allowed - u_c), -e_d + beta * (allowed - u_c)),
        ]

    theirs = ct.nlsys(rates, None, inputs=0, outputs=6, states=6, name="theirs")
    start = [-9.99, -9.9, -2.2, 1.1, 0.0, 0.0]
    expected = ct.input_output_response(
        theirs, T, 0, start, solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12}
    ).states
    _, states = run_of(CONSTRAINED)
    found = [states["plant.x1"], states["controller.model.xm1"]]
    found += [-states[f"controller.weights.W_hat[{i}]"] for i in (0, 1)]
    found += [states[f"controller.error.{name}"] for name in ("beta_hat", "E_d1")]
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_the_lyapunov_function_falls_although_the_input_saturates():
    """V = e_u^2 + |W_hat - W|^2 / Gamma + (beta_hat - 1)^2 / gamma_d has V' = -2 e_u^2."""
    response, states = run_of(CONSTRAINED)
    x, u, _, r, _ = response.outputs
    off = [states["controller.weights.W_hat[0]"] - 2, states["controller.weights.W_hat[1]"] + 1]
    beta = states["controller.error.beta_hat"]
    V = r**2 + (off[0] ** 2 + off[1] ** 2) / 0.1 + (beta - 1) ** 2
    assert V[-1] - V[0] == pytest.approx(-np.trapezoid(2 * r**2, T), abs=1e-5)
    assert np.abs(u).max() == 10.0
    assert np.mean(np.abs(u) == 10.0) > 0.1  # for a long time
    assert np.abs(x).max() < 10  # beyond that no input |u| <= 10 brings it back


def test_without_the_correction_the_estimates_wind_up():
    """The same law learning from e: its gains leave for ten times their true values."""
    constrained, _ = run_of(CONSTRAINED)
    plain, _ = run_of(nlctl.controllers.ModelError(K=(1.0,), Q=(2.0,)))
    assert constrained.outputs[4].max() < 3.0
    assert plain.outputs[4].max() > 30.0


@given(st.floats(-1e6, 1e6), st.floats(0.1, 100))
def test_the_law_never_leaves_its_limits(wanted, u_max):
    """|u| <= u_max, and u - du is what the law wanted."""
    law = nlctl.controllers.ConstrainedLaw(u_max=u_max)
    u, du = law.output(0.0, (), (-wanted,), equation_arguments(law))
    assert abs(u) <= u_max
    assert u - du == pytest.approx(wanted, rel=1e-12, abs=1e-9)
    assert (du == 0) == (abs(wanted) <= u_max)


@given(st.lists(st.floats(-3, 3), min_size=4, max_size=4))
def test_without_a_deficit_it_is_the_model_error(u):
    """du = 0 from E_d = 0: nothing moves, and a law sees what it sees of `ModelError`."""
    spec, plain = nlctl.controllers.ConstrainedError(), nlctl.controllers.ModelError()
    x, p = np.array([0.0, 0.0, 0.7]), equation_arguments(spec)
    np.testing.assert_array_equal(spec.update(0.0, x, np.array([*u, 0.0]), p), 0.0)
    seen = plain.output(0.0, np.empty(0), np.array(u), equation_arguments(plain))
    assert spec.output(0.0, x, np.array([*u, 0.0]), p)[:4] == pytest.approx(seen)


def test_gains_and_weights_of_equal_length():
    """As of `ModelError`."""
    with pytest.raises(nlctl.errors.ParameterError, match="ConstrainedError needs as many Q as K"):
        nlctl.controllers.ConstrainedError(K=(1.0,))
