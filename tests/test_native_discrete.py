"""Diagrams in discrete time: the compiled program against python-control and closed forms."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl._errors import ParameterError
from nlctl.native._compile import compile as compile_diagram
from nlctl.native._discrete import simulate_discrete


def simulated(system, times, inputs=0.0, x0=None, params=None):
    """Outputs and states of a compiled system."""
    compiled = compile_diagram(system, params=params)
    u = np.broadcast_to(np.asarray(inputs, dtype=float), (system.ninputs, len(times)))
    x = nlctl.initial_state(compiled.system) if x0 is None else np.asarray(x0, dtype=float)
    return simulate_discrete(compiled, times, u, x, compiled.parameter_vector(params))


def logistic(dt):
    """x[k+1] = r x[k] (1 - x[k]) + u[k]."""
    return ct.nlsys(
        lambda t, x, u, params: [params["r"] * x[0] * (1 - x[0]) + u[0]],
        lambda t, x, u, params: [x[0] + t],
        inputs=["u"], outputs=["y"], states=["x"], params={"r": 4.0}, dt=dt, name="logistic",
    )  # fmt: skip


def sampled_loop(dt):
    """An integrating controller, a nonlinear plant, and a static block whose dt is None."""
    plant = ct.nlsys(
        lambda t, x, u, params: [0.9 * x[0] + 0.2 * np.tanh(u[0]) + 0.01 * np.sin(t)],
        lambda t, x, u, params: x,
        inputs=["u"], outputs=["y"], states=1, dt=dt, name="plant",
    )  # fmt: skip
    control = ct.tf([0.5, -0.4], [1, -1], dt, inputs="e", outputs="u", name="control")
    error = ct.summing_junction(["r", "-y"], "e", name="error")
    return ct.interconnect([plant, control, error], inputs="r", outputs=["y", "u"], name="loop")


SYSTEMS = {
    "nlsys": lambda dt: logistic(dt),
    "ss": lambda dt: ct.ss([[0.5, 0.1], [0, 0.9]], [[0], [1]], [[1, 1]], [[0.2]], dt),
    "tf": lambda dt: ct.tf([1.0, 0.3], [1, -0.5, 0.06], dt),
    "diagram": sampled_loop,
}


@pytest.mark.parametrize("dt", [0.1, True])
@pytest.mark.parametrize("kind", SYSTEMS)
def test_samples_are_those_of_python_control(kind, dt):
    """Nonlinear, linear and mixed systems; 40 samples with a varying input."""
    system = SYSTEMS[kind](dt)
    times = 0.3 + 0.1 * np.arange(40)
    u = np.cos(times) * (0.0 if kind == "nlsys" else 1.0)
    reference = ct.ss(system) if isinstance(system, ct.TransferFunction) else system
    x0 = np.full(reference.nstates, 0.3)
    y, x = simulated(system, times, u, x0)
    # the logistic map doubles a rounding error in every step
    expected = ct.input_output_response(reference, times, u, x0)
    tolerance = 1e-16 * 2.0**42 if kind == "nlsys" else 1e-12
    np.testing.assert_allclose(np.atleast_2d(expected.y[0] if y.shape[0] == 1 else expected.y), y,
                               rtol=tolerance, atol=tolerance)  # fmt: skip
    np.testing.assert_allclose(expected.x, x, rtol=tolerance, atol=tolerance)


def test_the_logistic_map_has_a_closed_form():
    """x[k] = sin(2^k asin(sqrt(x0)))^2 for r = 4."""
    k = np.arange(20)
    _, x = simulated(logistic(1), 1.0 * k, x0=[0.3])
    np.testing.assert_allclose(x[0], np.sin(2.0**k * np.arcsin(np.sqrt(0.3))) ** 2, atol=1e-9)


def test_a_run_that_diverges_ends_before_the_first_sample_that_is_not_finite():
    """x[k+1] = x[k]^2 with x[0] = 2 is 2^(2^k): finite up to k = 9."""
    square = ct.nlsys(lambda t, x, u, params: x**2, None, inputs=0, states=1, dt=0.5, name="square")
    y, x = simulated(square, 0.5 * np.arange(30), x0=[2.0])
    np.testing.assert_array_equal(x[0], 2.0 ** (2.0 ** np.arange(10)))
    assert y.shape == x.shape


def test_parameters_hold_for_the_run():
    """r = 2 has the fixed point 1/2."""
    _, x = simulated(logistic(1), 1.0 * np.arange(50), x0=[0.3], params={"r": 2.0})
    assert x[0, -1] == pytest.approx(0.5, abs=1e-15)


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (np.arange(5) * 0.2, r"'logistic' is sampled every 0\.1 s, but timepts 0 and 0\.2 are "),
        ([0, 0.1, 0.2, 0.35], r"timepts 0\.2 and 0\.35 are 0\.15 s apart"),
    ],
)
def test_times_between_the_samples_are_refused(times, words):
    """python-control accepts neither: not multiples of dt, and no unequal steps."""
    times = np.asarray(times, dtype=float)
    with pytest.raises(ParameterError, match=words):
        simulated(logistic(0.1), times)
    with pytest.raises(ValueError, match="must be equal"):
        ct.input_output_response(logistic(0.1), times, 0, 0)


def test_without_a_sampling_time_the_steps_must_be_equal():
    """dt = True: the first step counts."""
    with pytest.raises(ParameterError, match=r"sampled every 1 s, but timepts 1 and 3"):
        simulated(logistic(True), np.array([0.0, 1.0, 3.0]))
    with pytest.raises(ParameterError, match="no discrete-time system"):
        simulated(logistic(0), np.array([0.0, 1.0]))
