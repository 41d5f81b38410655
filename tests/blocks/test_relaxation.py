"""What python-control would never move is refused there, and runs as machine code."""

import inspect

import numpy as np
import pytest

import nlctl
from nlctl import actuators
from nlctl.blocks import memory_states
from nlctl.responses.relaxation import check_relaxation


def switch(rate):
    """A relay of one's own, whose mode follows the sign of an input beyond 0.5."""

    @nlctl.record
    class Switch:
        high: float = nlctl.param(1.0, unit="1", meaning="output")
        inputs, outputs, states, feedthrough = ("u",), ("v",), ("mode",), False
        memory = ("mode",)

        @staticmethod
        @nlctl.equation
        def commit(t, x, u, p):
            return (np.where(u[0] > 0.5, 1.0, np.where(u[0] < -0.5, -1.0, x[0])),)

        @staticmethod
        @nlctl.equation
        def update(t, x, u, p):
            wanted = np.where(u[0] > 0.5, 1.0, np.where(u[0] < -0.5, -1.0, x[0]))
            return (rate * (wanted - x[0]),)

        @staticmethod
        @nlctl.equation
        def output(t, x, u, p):
            return (p.high * x[0],)

        @staticmethod
        @nlctl.equation
        def switching(t, x, u, p):
            return u[0] - 0.5, u[0] + 0.5

    return nlctl.block(Switch(), "switch")


@pytest.mark.slow
def test_a_memory_without_a_rate_is_refused_in_python_control_alone():
    """It would be 0 for ever; as machine code it is 1 from u = 0.5 on."""
    t = np.linspace(0, 2, 41)
    made = nlctl.input_output_response(switch(0.0), t, t)
    np.testing.assert_array_equal(made.outputs[t > 0.55], 1.0)
    with pytest.raises(nlctl.errors.UsageError, match=r"Switch \(block 'switch'\).*memory 'mode'"):
        nlctl.input_output_response(switch(0.0), t, t, engine="python-control")
    slow = nlctl.input_output_response(switch(200.0), t, t, engine="python-control")
    np.testing.assert_allclose(slow.outputs[t > 0.6], 1.0, atol=1e-6)


def test_every_memory_of_the_catalogue_is_moved():
    """In python-control, by its own relaxation."""
    records = [getattr(actuators, name) for name in actuators.__all__]
    specs = [made() for made in records if inspect.isclass(made) and hasattr(made, "commit")]
    assert len(specs) > 5
    for spec in specs:
        assert memory_states(spec)
        check_relaxation(nlctl.block(spec, "one"))
