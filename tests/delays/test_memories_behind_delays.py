"""Memories that delayed signals carry: jumps and turns arrive, and nothing turns at a seam."""

import functools

import control as ct
import numpy as np
import pytest
from dense_play import through_play

import nlctl

R = 0.3  # half the play
LATE = 0.7
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)


@nlctl.record
class LateStop(nlctl.actuators.Stop):
    """A stop operator that a delayed signal drives."""

    inputs = ("late",)


@nlctl.record
class LatePlay(nlctl.Backlash):
    """A play that a delayed signal drives."""

    inputs = ("late",)


def of(signal, memory, *delays):
    """A signal of a state that is t, through delays, in front of a memory."""
    names = ["s", *(f"s{i}" for i in range(1, len(delays))), "late"]
    lines = {
        f"line_{i}": nlctl.TransportDelay(inputs=(names[i],), outputs=(names[i + 1],), delay=delay)
        for i, delay in enumerate(delays)
    }
    ramp = ct.nlsys(
        lambda t, x, u, p: [1.0], lambda t, x, u, p: [x[0]], inputs=0, outputs=["w"], states=1,
        name="ramp",
    )  # fmt: skip
    source = ct.nlsys(
        None, lambda t, x, u, p: [signal(u[0])], inputs=["w"], outputs=["s"], name="source"
    )
    blocks = {"ramp": ramp, "source": source, **lines, "memory": memory}
    return nlctl.compile(nlctl.interconnect(blocks, outputs=["v"]))


def saw(w):
    """Falls by 1.5 at every integer."""
    return 1.5 * (w % 1.0)


def staircase(w):
    """Jumps by 1/2, up and down."""
    return np.round(2.0 * np.sin(1.3 * w)) / 2.0


def jumping_sine(w):
    """A sine, on a step of 1 where another one is large."""
    return np.sin(3.0 * w) + (1.0 if np.sin(w) > 0.5 else 0.0)


@pytest.mark.parted
@pytest.mark.parametrize("delays", [(LATE,), (0.5, LATE - 0.5)], ids=["one", "two"])
@pytest.mark.parametrize("rtol", TOLERANCES)
def test_every_jump_of_a_saw_arrives_at_a_stop(rtol, delays):
    """Each takes the stop to -r, from where it rises with the saw."""
    compiled = of(saw, LateStop(r=0.5), *delays)
    phase = 0.2
    timepts = np.append(0.0, np.arange(1, 12) + LATE + phase)
    run = nlctl.input_output_response(compiled, timepts, rtol=rtol, atol=rtol / 100)
    assert run.outputs[0, 1:] == pytest.approx(-0.5 + 1.5 * phase, abs=30 * rtol)
    assert run.statistics.accepted < 1500


PLACES = np.append(0.0, np.linspace(0.61, 11.83, 23))


@functools.cache
def late_play(signal):
    """A play behind a delay: the operator over dense samples, at the places."""
    dense = np.linspace(0.0, 12.0, 240_001)
    late = np.array([signal(w - LATE) if w >= LATE else 0.0 for w in dense])
    return np.interp(PLACES, dense, through_play(late, R))


@pytest.mark.parted
@pytest.mark.parametrize("rtol", TOLERANCES)
@pytest.mark.parametrize("signal", [staircase, jumping_sine])
def test_a_play_behind_a_delay_is_that_of_the_late_signal(signal, rtol):
    """Against the operator over dense samples."""
    compiled = of(signal, LatePlay(m_r=1.0, m_l=1.0, c_r=R, c_l=-R), 0.45, LATE - 0.45)
    timepts, exact = PLACES, late_play(signal)
    run = nlctl.input_output_response(compiled, timepts, rtol=rtol, atol=rtol / 100)
    assert run.outputs[0] == pytest.approx(exact, abs=1e-4 + 30 * rtol)


def delayed_loop(memory_first):
    """A driven second-order plant under feedback through a play and a delay, in either order."""
    plant = ct.nlsys(
        lambda t, x, u, p: [x[1], -x[1] + u[0] + np.sin(t)], lambda t, x, u, p: [x[0]],
        inputs=["late" if memory_first else "v"], outputs=["y"], states=2, name="plant",
    )  # fmt: skip
    law = ct.nlsys(
        None, lambda t, x, u, p: [-1.5 * u[0]], inputs=["y" if memory_first else "late"],
        outputs=["u"], name="law",
    )  # fmt: skip
    sent = "v" if memory_first else "y"
    blocks = {
        "plant": plant,
        "law": law,
        "play": nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=R, c_l=-R),
        "line": nlctl.TransportDelay(inputs=(sent,), outputs=("late",), delay=0.5),
    }
    return nlctl.compile(nlctl.interconnect(blocks, outputs=["y", "v"]))


@pytest.mark.parametrize("memory_first", [False, True], ids=["behind", "in front"])
def test_nothing_turns_at_seams_of_what_a_delay_keeps(memory_first):
    """A loop over 30 s has the same turns at every tolerance, and errors that follow it."""
    compiled = delayed_loop(memory_first)
    timepts = np.linspace(0.0, 30.0, 61)
    runs = [
        nlctl.input_output_response(compiled, timepts, rtol=rtol, atol=rtol / 100)
        for rtol in (1e-10, 1e-8, 1e-6)
    ]
    assert len({run.statistics.events for run in runs}) == 1
    assert runs[-1].statistics.accepted < 500
    for run, rtol in zip(runs[1:], (1e-8, 1e-6), strict=True):
        assert run.outputs == pytest.approx(runs[0].outputs, abs=30 * rtol)


@pytest.mark.weekly
def test_a_loop_with_a_play_and_a_delay_is_the_reference():
    """Where python-control's own right-hand side is integrated."""
    loop = delayed_loop(memory_first=False).system
    timepts = np.linspace(0.0, 12.0, 25)
    runs = [
        nlctl.input_output_response(loop, timepts, rtol=1e-8, atol=1e-10, engine=engine)
        for engine in ("native", "python-control")
    ]
    assert runs[0].outputs == pytest.approx(runs[1].outputs, abs=1e-6)
