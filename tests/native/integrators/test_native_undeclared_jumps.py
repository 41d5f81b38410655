"""Memories that jump where no switching function tells of it: refused, or located."""

import control as ct
import numpy as np
import pytest
from own_relay import Side

import nlctl
from nlctl.native import Status

TIMES = np.linspace(0, 10, 101)


@nlctl.record
class AsItIs(Side):
    """It declares one of its two thresholds only."""

    width: float = nlctl.param(0.1, unit="1", meaning="threshold", at_least=0)

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return (u[0] - p.width,)


@nlctl.record
class BySign(AsItIs):
    """It outputs the sign of its side: wherever the side is moved to."""

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (np.sign(x[0]),)


@nlctl.record
class ByBranch(AsItIs):
    """It outputs what a branch on its side says."""

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        if x[0] > 0:
            return (1.0,)
        return (-1.0 + 0.0 * x[0],)


RELAYS = (AsItIs, BySign, ByBranch)
every_relay = pytest.mark.parametrize("relay", RELAYS)
methods = pytest.mark.parametrize("method", ["tsit5", "rodas5p"])


def behind_a_wave(width, relay):
    """y' = v, u = sin t, from side 1 on."""
    plant = ct.nlsys(
        lambda t, x, u, p: u[0], lambda t, x, u, p: (np.sin(t), x[0]), states=1, inputs=["v"],
        outputs=["u", "y"], name="plant",
    )  # fmt: skip
    return nlctl.interconnect({"relay": relay(width=width), "plant": plant}, outputs=["y"])


@pytest.mark.parted
@every_relay
@methods
@pytest.mark.parametrize("width", [0.5, 1e-3, 1e-12, 0.0])
def test_switches_of_an_open_loop_are_met(relay, method, width):
    """Steps see nothing of them, and would grow over several: down at pi + a, up at 2 pi + a."""
    made = nlctl.input_output_response(
        behind_a_wave(width, relay), TIMES, 0, {"relay.side": 1.0}, method=method
    )
    a = np.arcsin(width)
    down = [np.clip(TIMES - begin, 0, np.pi) for begin in (np.pi + a, 3 * np.pi + a)]
    np.testing.assert_allclose(made.outputs[0], TIMES - 2 * sum(down), rtol=0, atol=1e-6)


def closed(relay):
    """x' = 1/2 - v from 1: it comes to the threshold, and goes to and fro."""
    plant = ct.nlsys(
        lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0], states=1, inputs=["v"],
        outputs=["u"], name="plant",
    )  # fmt: skip
    return nlctl.interconnect({"relay": relay, "plant": plant})


@every_relay
@methods
def test_a_closed_loop_oscillates_between_the_thresholds(relay, method):
    """A sawtooth of width 0.2, rising at 3/2 and falling at 1/2."""
    start = {"plant.x[0]": 1.0, "relay.side": 1.0}
    made = nlctl.input_output_response(closed(relay()), TIMES, 0, start, method=method)
    first, rise, period = 2.2, 0.4 / 3, 1.6 / 3
    phase = (TIMES - first) % period
    saw = np.where(phase < rise, -0.1 + 1.5 * phase, 0.1 - 0.5 * (phase - rise))
    wanted = np.where(first > TIMES, 1 - TIMES / 2, saw)
    np.testing.assert_allclose(made.states[1], wanted, rtol=0, atol=1e-5)


@pytest.mark.parted
@every_relay
@methods
@pytest.mark.parametrize("width", [1e-12, 0.0])
def test_below_the_tolerance_it_chatters(relay, method, width):
    """It never goes on beyond the jump, in any number of steps."""
    made = nlctl.input_output_response(
        closed(relay(width=width)), TIMES, 0, {"plant.x[0]": 1.0, "relay.side": 1.0},
        method=method, ignore_errors=True,
    )  # fmt: skip
    assert made.statistics.status is Status.CHATTERING
    assert made.statistics.time == pytest.approx(2.0, abs=1e-3)
    sentences = "of block 'relay' jumps between -1 and 1", "(switching) accumulate near t = 2 s"
    assert any(each in made.message for each in sentences)


def test_members_of_an_ensemble_meet_them_too():
    """Widths of their own, side by side in lanes: each as it is alone."""
    loop = nlctl.compile(behind_a_wave(0.5, AsItIs))
    widths = np.linspace(0.0, 0.6, 11)
    made = nlctl.ensemble_response(
        loop,
        TIMES,
        0,
        {"relay.side": 1.0},
        params={"relay.width": widths},
        keep=["y"],
        rtol=1e-9,
        atol=1e-11,
    )
    a = np.arcsin(widths)[:, None]
    down = [np.clip(TIMES - begin - a, 0, np.pi) for begin in (np.pi, 3 * np.pi)]
    np.testing.assert_allclose(made.signals["y"], TIMES - 2 * sum(down), rtol=0, atol=1e-5)


def remembering(commit, **more):
    """A record with one memory, which is committed so, and no switching functions."""
    body = {
        "inputs": ("u",), "outputs": ("v",), "states": ("m",), "memory": ("m",),
        "feedthrough": False,
        "update": staticmethod(nlctl.equation(lambda t, x, u, p: (0.0,))),
        "output": staticmethod(nlctl.equation(lambda t, x, u, p: (x[0],))),
        "commit": staticmethod(nlctl.equation(commit)),
    }  # fmt: skip
    return nlctl.record(type("Remembers", (), body | more))()


@pytest.mark.parametrize(
    "commit",
    [
        lambda t, x, u, p: (1.0 if u[0] > 0 else x[0],),
        lambda t, x, u, p: (np.where(u[0] > 1, u[0], x[0]),),
        lambda t, x, u, p: (np.sign(u[0]),),
        lambda t, x, u, p: (np.floor(t),),
        lambda t, x, u, p: (np.heaviside(u[0], 0.5) + 0 * x[0],),
    ],
)
def test_a_memory_that_may_jump_declares_where(commit):
    """Named at once, and python-control does not take over: there it would never switch."""
    for run in (nlctl.compile, lambda loop: nlctl.input_output_response(loop, [0, 1], 1.0)):
        with pytest.raises(
            nlctl.errors.BlockError, match=r"Remembers \(block 'm'\) needs .*switching"
        ):
            run(nlctl.block(remembering(commit), "m"))


@pytest.mark.parametrize(
    ("commit", "wanted"),
    [
        (lambda t, x, u, p: (np.maximum(x[0], u[0]),), 1.0),
        (lambda t, x, u, p: (u[0] if u[0] > x[0] else x[0],), 1.0),
        (lambda t, x, u, p: (np.minimum(np.maximum(x[0], u[0] - 0.3), u[0] + 0.3),), -0.7),
    ],
)
def test_a_memory_that_does_not_jump_needs_none(commit, wanted):
    """A peak, twice, and a play, behind a source that has jumps of its own."""
    wave = ct.nlsys(
        None, lambda t, x, u, p: [np.sin(t), np.where(t > 2, 1.0, 0.0)], inputs=0,
        outputs=["u", "w"], name="wave",
    )  # fmt: skip
    loop = nlctl.interconnect({"wave": wave, "m": remembering(commit)}, outputs=["v"])
    made = nlctl.input_output_response(loop, np.linspace(0, 1.5 * np.pi, 11))
    assert made.outputs[0, -1] == pytest.approx(wanted, abs=1e-6)
