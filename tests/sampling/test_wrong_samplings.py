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


def of_no_time():
    return ct.nlsys(
        lambda t, x, u, p: [-x[0] + u[0]], lambda t, x, u, p: [x[0]], inputs="y", outputs="u",
        states=1, dt=None, name="law",
    )  # fmt: skip


def without_sizes():
    return ct.nlsys(None, lambda t, x, u, p: u, dt=0.1, name="law")


LAG = ct.tf([1.0], [1.0, 0.5], inputs="y", outputs="u", name="lag")
TWICE = "'law' is sampled already: give .* the block that it samples"


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
    "a transfer function's x'": (lambda: nlctl.sampled(LAG, 0.1), "'lag' is in continuous time"),
    "an update that is neither": (
        lambda: nlctl.sampled(of_no_time(), 0.1),
        "'law' says nothing of its time.*x\\[k\\+1\\]",
    ),
    "a matrix that is neither": (
        lambda: nlctl.sampled(ct.ss(-1, 1, 1, 0, dt=None, name="law"), 0.1),
        "says nothing of",
    ),
    "no numbers of signals": (lambda: nlctl.sampled(without_sizes()), "how many inputs it has"),
    "no numbers, discretised": (
        lambda: nlctl.discretise(without_sizes(), 0.1),
        "how many inputs it has",
    ),
    "sampled twice": (lambda: nlctl.sampled(nlctl.sampled(LAW), 0.1), TWICE),
    "sampled twice by Euler": (
        lambda: nlctl.sampled(nlctl.sampled(LAW), 0.1, method="euler"),
        TWICE,
    ),
    "a diagram with samples": (lambda: nlctl.sampled(loop(nlctl.sampled(LAW)), 0.1), TWICE),
    "samples discretised": (lambda: nlctl.discretise(loop(nlctl.sampled(LAW)), 0.1), TWICE),
    "no common period": (lambda: nlctl.compile(incommensurate()).linearize(0.0), "common period"),
    "an algebraic loop": (
        lambda: nlctl.compile(ring()),
        r"algebraic loop: (law\.u|other\.y) -> .* -> ",
    ),
    "an algebraic loop that is run": (
        lambda: run(ring()),
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


@pytest.mark.parametrize("method", ["tustin", "zoh", "euler"])
def test_a_transfer_function_is_discretised_as_its_state_space_is(method):
    """Its states are known once it has some."""
    known = ct.ss(LAG, name="lag", inputs="y", outputs="u")
    for make in (nlctl.discretise, nlctl.sampled):
        made, wanted = (make(each, 0.1, method=method) for each in (LAG, known))
        if make is nlctl.sampled:
            made, wanted = made.inner, wanted.inner
        for name in "ABCD":
            np.testing.assert_array_equal(getattr(made, name), getattr(wanted, name))


def test_a_record_in_continuous_time_is_one_whatever_the_default_is(monkeypatch):
    """python-control's default may leave the timebase open."""
    monkeypatch.setitem(ct.config.defaults, "control.default_dt", None)
    assert nlctl.block(nlctl.Lag(), "lag").dt == 0
    with pytest.raises(UsageError, match="'lag' is in continuous time"):
        nlctl.sampled(nlctl.block(nlctl.Lag(), "lag"), 0.1)


def test_the_advice_of_the_refusal_is_python_controls_reference():
    """An algebraic loop between samples is not told as one of integrating over samples."""
    with pytest.raises(RuntimeError, match=r"[Aa]lgebraic loop"):
        nlctl.input_output_response(
            ring_from(1.0), np.linspace(0, 1, 11), 0, engine="python-control"
        )


def ring_from(value):
    """Two programs in a circle, with a constant that is not at rest."""
    one = ct.nlsys(None, lambda t, x, u, p: [u[0] + value], inputs="y", outputs="u", dt=0.1)
    two = ct.nlsys(None, lambda t, x, u, p: [0.5 * u[0]], inputs="u", outputs="y", dt=0.1)
    return ct.interconnect(
        [nlctl.sampled(one), nlctl.sampled(two)], inputs=[], outputs=["y"], inplist=[]
    )


@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_instants_that_rounding_sets_apart_are_run(engine):
    """A delay of 3 * 0.3 s is one of three samples, and one that is later by 1e-15 s nearly."""

    def law(**given):
        gain = ct.ss([], [], [], [[-0.4]], 0.3, inputs="y", outputs="u", name="law")
        return loop(nlctl.sampled(gain, **given))

    times, start = np.linspace(0, 5, 51), {"plant.x[0]": 1.0}
    runs = [
        nlctl.input_output_response(law(offset=0.1, delay=delay), times, 0, start, engine=engine)
        for delay in (0.9, 3 * 0.3, 0.9 + 1e-15)
    ]
    np.testing.assert_array_equal(runs[0].outputs, runs[1].outputs)
    np.testing.assert_allclose(runs[2].outputs[0], runs[0].outputs[0], rtol=0, atol=1e-7)
