"""What cannot be sampled, or a fault that cannot be: one sentence, before anything runs."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import UsageError

PLANT = ct.ss([[-1.0]], [[1.0]], [[1.0]], 0, inputs="u", outputs="y", name="plant")
LAW = ct.ss([], [], [], [[-1.0]], 0.1, inputs="y", outputs="u", name="law")


def loop(law):
    return ct.interconnect([PLANT, law], inputs=[], outputs=["y", "u"], inplist=[])


def ring():
    """Two programs that need each other's new outputs at one instant."""
    other = ct.ss([], [], [], [[0.5]], 0.1, inputs="u", outputs="y", name="other")
    both = [nlctl.sampled(LAW), nlctl.sampled(other)]
    return ct.interconnect(both, inputs=[], outputs=["y"], inplist=[])


def run(diagram, **params):
    return nlctl.input_output_response(diagram, np.linspace(0, 1, 11), 0, params=params)


def incommensurate():
    slow = ct.ss([], [], [], [[1.0]], 0.1234567, inputs="y", outputs="s", name="slow")
    blocks = [PLANT, nlctl.sampled(LAW), nlctl.sampled(slow)]
    return ct.interconnect(blocks, inputs=[], outputs=["y", "s"], inplist=[])


def with_fault():
    return nlctl.with_faults(
        nlctl.paper.example_1(), nlctl.Fault("actuator.w", "bias", 0.5, at=1.0)
    )


CASES = {
    "dt of 0": (lambda: nlctl.sampled(PLANT, 0, method="euler"), "dt > 0, got 0"),
    "negative dt": (lambda: nlctl.sampled(PLANT, -0.1, method="euler"), "dt > 0, got -0.1"),
    "dt that is none": (lambda: nlctl.sampled(PLANT, np.nan, method="euler"), "dt"),
    "dt as text": (lambda: nlctl.sampled(PLANT, "10 ms", method="euler"), "dt.*'10 ms'"),
    "negative delay": (lambda: nlctl.sampled(LAW, delay=-1e-3), "delay >= 0, got -0.001"),
    "jitter of dt": (lambda: nlctl.sampled(LAW, jitter=0.1), "jitter < dt, got 0.1"),
    "negative jitter": (lambda: nlctl.sampled(LAW, jitter=-0.1), "jitter >= 0, got -0.1"),
    "negative quantum": (lambda: nlctl.sampled(LAW, input_quantum=-1), "input_quantum >= 0"),
    "too little room": (lambda: nlctl.sampled(LAW, delay=0.3, waiting=2), "waiting >= 3, got 2"),
    "x' for x[k+1]": (lambda: nlctl.sampled(PLANT, 0.1), "'plant' is in continuous time"),
    "no common period": (lambda: nlctl.compile(incommensurate()).linearize(0.0), "common period"),
    "an algebraic loop": (
        lambda: nlctl.compile(ring()),
        r"algebraic loop: (law\.u|other\.y) -> .* -> ",
    ),
    "two timebases": (
        lambda: nlctl.interconnect([PLANT, LAW]),
        r"'plant' is in continuous time and 'law' .*\(dt = 0\.1\): nlctl\.sampled\(law, dt\)",
    ),
    "two rates": (
        lambda: nlctl.interconnect([LAW, ct.ss([], [], [], 1.0, 0.2, inputs="u", outputs="y")]),
        r"'law' is in discrete time \(dt = 0\.1\) and .*\(dt = 0\.2\): nlctl\.sampled\(",
    ),
    "an unknown signal": (with_fault, "'actuator.w'.*nearest.*'actuator.v'"),
    "an unknown parameter": (
        lambda: run(loop(nlctl.sampled(LAW)), **{"law.sampling.dtt": 1.0}),
        r"'law\.sampling\.dtt'; nearest: 'law\.sampling\.dt'",
    ),
    "an override": (
        lambda: run(loop(nlctl.sampled(LAW, delay=0.05)), **{"law.sampling.delay": -1.0}),
        r"delay >= 0, got -1 \(block 'law\.sampling'\)",
    ),
}


@pytest.mark.parametrize(("call", "words"), CASES.values(), ids=CASES)
def test_bad_input_ends_in_one_sentence(call, words):
    with pytest.raises(UsageError, match=words) as raised:
        call()
    assert "\n" not in str(raised.value)


def test_the_advice_on_two_timebases_makes_the_loop():
    """A gain behind a hold of 0.1 s: y[k+1] = e^(-0.1) y[k] - (1 - e^(-0.1)) y[k]."""
    loop = nlctl.interconnect([PLANT, nlctl.sampled(LAW)])
    found = nlctl.input_output_response(loop, np.linspace(0, 1, 11), 0, {"plant.x[0]": 1.0})
    wanted = (2 * np.exp(-0.1) - 1) ** np.arange(11)
    np.testing.assert_allclose(found.outputs[0], wanted, rtol=1e-7)
