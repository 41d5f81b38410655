"""Which engine computes a run, and what is said when machine code cannot."""

import control as ct
import numpy as np
import pytest
import scipy.special
from numba.core import config

import nlctl
from nlctl.errors import EngineWarning, ParameterError

TIMES = np.linspace(0, 1, 5)
WITHOUT_JIT = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="nothing is compiled without JIT"
)


def decay(function=lambda t, x, u, params: [-params["k"] * x[0]]):
    return ct.nlsys(
        function, None, inputs=0, outputs=["y"], states=["x"], name="decay", params={"k": 2.0}
    )


calls = []


def cautious(t, x, u, params):
    calls.append(t)
    return [-params["k"] * x[0]]


def special(t, x, u, params):
    rate = scipy.special.erfcx(0.0 * x[0])
    return [-rate * params["k"] * x[0]]


@pytest.mark.parametrize("engine", ["python-control", "native", "auto"])
def test_every_engine_gives_the_same_answer(engine):
    """x' = -k x with an override."""
    response = nlctl.input_output_response(
        decay(), TIMES, 0, [1.0], params={"k": 3.0}, engine=engine, rtol=1e-9
    )
    np.testing.assert_allclose(response.states[0], np.exp(-3 * TIMES), rtol=1e-7)
    assert (response.statistics is None) == (engine == "python-control")


def test_what_cannot_be_compiled_falls_back_with_a_warning():
    """The warning names block, line and reason; "native" raises instead."""
    line = cautious.__code__.co_firstlineno + 1
    said = rf"'decay' .* changes .* \(.*test_native_engine.py, line {line}\)"
    with pytest.raises(nlctl.errors.CompileError, match=said):
        nlctl.input_output_response(decay(cautious), TIMES, 0, [1.0], engine="native")
    with pytest.warns(EngineWarning, match=f"python-control takes over: .*{said}"):
        response = nlctl.input_output_response(
            decay(cautious), TIMES, 0, [1.0], engine="auto", method="tsit5", max_steps=1000
        )
    np.testing.assert_allclose(response.states[0], np.exp(-2 * TIMES), rtol=1e-7)


def test_a_function_that_nothing_can_compile_is_called_by_machine_code():
    """One of SciPy's: no warning, and the engine's own numbers."""
    response = nlctl.input_output_response(decay(special), TIMES, 0, [1.0], params={"k": 3.0})
    assert response.statistics is not None
    np.testing.assert_allclose(response.states[0], np.exp(-3 * TIMES), rtol=1e-7)


def test_a_mistake_is_no_reason_to_change_the_engine():
    """Names and values are refused by "auto" as they are by "native"."""
    with pytest.raises(nlctl.errors.UnknownNameError, match=r"unknown state 'decay\.z'"):
        nlctl.input_output_response(decay(), TIMES, 0, {"decay.z": 1.0}, engine="auto")
    with pytest.raises(
        nlctl.errors.UnknownNameError, match="unknown engine 'naive'; nearest: 'native'"
    ):
        nlctl.input_output_response(decay(), TIMES, engine="naive")


def test_a_compiled_diagram_does_not_run_in_python_control():
    """It is machine code whatever else is asked for."""
    compiled = nlctl.compile(decay())
    with pytest.raises(ParameterError, match=r"give compiled\.system"):
        nlctl.input_output_response(compiled, TIMES, 0, [1.0], engine="python-control")
    response = nlctl.input_output_response(compiled, TIMES, 0, [1.0], engine="native")
    assert response.statistics.accepted > 0


@pytest.mark.slow
def test_a_block_that_raises_ends_the_run_with_its_own_error():
    """In machine code as in Python: the exception reaches the caller."""

    def update(t, x, u, params):
        if x[0] > 0.5:
            raise ValueError("beyond the table")
        return [1.0]

    for engine in ("python-control", "native"):
        with pytest.raises(ValueError, match="beyond the table"):
            nlctl.input_output_response(decay(update), TIMES, 0, [0.0], engine=engine)


def test_a_block_that_returns_nan_ends_the_run_as_diverged():
    """Behind t = 1/2 the rate is NaN: there the run ends, with the time."""

    def update(t, x, u, params):
        return [np.nan if x[0] > 0.5 else 1.0]

    with pytest.raises(nlctl.errors.DivergedError) as caught:
        nlctl.input_output_response(decay(update), TIMES, 0, [0.0], engine="native")
    assert caught.value.time == pytest.approx(0.5, abs=1e-3)


def test_an_index_out_of_range_is_an_error():
    """Machine code that reads beyond an array would compute with whatever lies there."""

    def update(t, x, u, params):
        return [-x[len(x)]]

    with pytest.raises((IndexError, nlctl.errors.CompileError)):
        nlctl.input_output_response(decay(update), TIMES, 0, [1.0], engine="native")


@pytest.mark.parametrize("result", [[1.0, 2.0], []])
def test_a_wrong_number_of_values_is_an_error(result):
    """The message names the block, what it returned and what it should."""
    short = np.array(result)
    with pytest.raises(
        nlctl.errors.CompileError, match=rf"'decay' returns {len(result)} .* needs 1"
    ):
        nlctl.compile(decay(lambda t, x, u, params: short))


@pytest.mark.parametrize(
    "rename",
    [
        lambda c: c.copy(name="other"),
        lambda c: c.update_names(name="other"),
        lambda c: c.set_inputs(["w"]),
        lambda c: c.set_outputs(["w"]),
        lambda c: c.set_states(["w"]),
    ],
    ids=["copy", "update_names", "set_inputs", "set_outputs", "set_states"],
)
def test_a_compiled_diagram_keeps_its_names(rename):
    """It is machine code of the diagram as it was."""
    compiled = nlctl.compile(nlctl.block(nlctl.Lag(), "lag"))
    with pytest.raises(nlctl.errors.UsageError, match=r"compiled already: .*\.system"):
        rename(compiled)
    assert (compiled.name, compiled.input_labels, compiled.state_labels) == ("lag", ["u"], ["v"])
