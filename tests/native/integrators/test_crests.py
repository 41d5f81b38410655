"""Steps that end at the crest of a narrow pulse: what switches on its flank is located there."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

AT, WIDTH, END = 5.0, 0.01, 20.0


@pytest.mark.parametrize(
    ("rtol", "method", "level"),
    crossed([1e-3, 1e-5, 1e-6, 1e-8, 1e-10], ["tsit5", "rodas5p", "taylor", "auto"], [0.0, 0.9]),
)
def test_a_relay_switches_on_the_flank(level, method, rtol):
    """A line from the start of the step says that 0 is next to the crest; it is far from there."""
    parabola = ct.nlsys(
        lambda t, x, u, p: [1.0], lambda t, x, u, p: [1.0 - ((x[0] - AT) / WIDTH) ** 2],
        inputs=0, outputs=["u"], states=1, name="parabola",
    )  # fmt: skip
    blocks = {
        "parabola": parabola,
        "relay": nlctl.Relay(on=level, off=level - 0.1),
        "sum": ct.ss(0, 1, 1, 0, inputs="v", outputs="z"),
    }
    loop = nlctl.interconnect(blocks, outputs=["z", "v"])
    run = nlctl.input_output_response(
        loop, [0.0, AT, END], 0, rtol=rtol, atol=rtol / 100, method=method
    )
    on, off = AT - WIDTH * np.sqrt(1.0 - level), AT + WIDTH * np.sqrt(1.1 - level)
    late = 1e-3 * END * min(10.0 * rtol, 1e-3)  # of a step that may be as long as the run
    assert run.outputs[0, 1] == pytest.approx(AT - 2.0 * on, abs=1e-7 + 10 * late)
    assert run.outputs[0, 2] == pytest.approx(2.0 * (off - on) - END, abs=1e-7 + 10 * late)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("delay", [0.3, 7.0])
def test_a_pulse_with_kinks_passes_a_delay(delay, rtol):
    """Half of it was lost where its first kink was sought at its crest."""
    pulse = ct.nlsys(
        lambda t, x, u, p: [1.0],
        lambda t, x, u, p: [np.maximum(0.0, 1.0 - ((x[0] - AT) / WIDTH) ** 2)],
        inputs=0, outputs=["u"], states=1, name="pulse",
    )  # fmt: skip
    blocks = {
        "pulse": pulse,
        "line": nlctl.TransportDelay(inputs=("u",), outputs=("late",), delay=delay),
        "sum": ct.ss(0, 1, 1, 0, inputs="late", outputs="z"),
    }
    loop = nlctl.interconnect(blocks, outputs=["z"])
    run = nlctl.input_output_response(loop, [0.0, END], 0, rtol=rtol, atol=rtol / 100)
    assert run.outputs[0, -1] == pytest.approx(4.0 / 3.0 * WIDTH, abs=1e-5 + rtol)
