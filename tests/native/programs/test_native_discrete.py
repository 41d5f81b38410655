"""Diagrams in discrete time: the compiled program against python-control and closed forms."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.metrics import Metric, final
from nlctl.diagrams import state_names
from nlctl.errors import ParameterError
from nlctl.native import ensemble_response
from nlctl.native.compiled import compile as compile_diagram
from nlctl.native.discrete import simulate_discrete


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


@pytest.mark.parametrize("kind", SYSTEMS)
def test_members_of_an_ensemble_are_the_single_runs(kind):
    """Bit for bit, more members than one thread takes at a time, on one thread or two."""
    compiled = compile_diagram(SYSTEMS[kind](0.1))
    times, state = 0.1 * np.arange(30), state_names(compiled.system)[0]
    starts, u = np.linspace(0.1, 0.4, 19), 0.0 if kind == "nlsys" else np.cos(times)
    label = compiled.system.output_labels[0]
    made = [
        ensemble_response(compiled, times, u, {state: starts}, keep=[label], threads=threads)
        for threads in (1, 2)
    ]
    for number, start in enumerate(starts):
        run = nlctl.input_output_response(compiled, times, u, {state: start})
        for ensemble in made:
            np.testing.assert_array_equal(
                ensemble.signals[label][number], np.atleast_2d(run.outputs)[0]
            )
    assert set(made[0].table["status"]) == {"OK"}
    assert set(made[0].table["steps"]) == {30}


def test_members_have_their_own_parameters_and_their_own_ends():
    """x[k+1] = a x[k]^2 is (a x0)^(2^k) / a: it settles at 0 or at 1 / a, or leaves the floats."""
    square = ct.nlsys(
        lambda t, x, u, params: params["a"] * x**2 + params["b"], lambda t, x, u, params: x,
        inputs=0, outputs=["y"], states=["x"], params={"a": 1.0, "b": 0.0}, dt=1, name="square",
    )  # fmt: skip
    a = np.array([0.25, 0.5, 1.0])
    last = Metric(key="last", signal="y", unit="1", meaning="last y", function=final)
    ensemble = ensemble_response(
        compile_diagram(square), 1.0 * np.arange(12), 0, {"x": 2.0}, params={"a": a},
        metrics=[last], keep=["y"],
    )  # fmt: skip
    assert ensemble.table["status"].tolist() == ["OK", "OK", "DIVERGED"]
    assert ensemble.table["last"][:2].tolist() == [0.0, 2.0]
    assert np.isnan(ensemble.table["last"][2])
    assert ensemble.table["time"].tolist() == [11.0, 11.0, 9.0]
    y = ensemble.signals["y"]
    np.testing.assert_array_equal(y[0, :9], 0.5 ** (2.0 ** np.arange(9)) / 0.25)
    np.testing.assert_array_equal(y[2, :10], 2.0 ** (2.0 ** np.arange(10)))
    assert np.isnan(y[2, 10:]).all()


def test_an_ensemble_refuses_times_between_the_samples():
    with pytest.raises(ParameterError, match=r"'logistic' is sampled every 0\.1 s"):
        ensemble_response(compile_diagram(logistic(0.1)), np.arange(5) * 0.2)
