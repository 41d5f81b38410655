"""Conditions that move nothing but an event function, a guard or a memory are located as well.

No rate of a state depends on them, so that error control sees nothing of the pulses.
"""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

TIMES = np.linspace(0, 5.2, 27)
METHODS = ["auto", "tsit5", "rodas5p", "taylor"]
WITH_MEMORY = [method for method in METHODS if method != "taylor"]
TOLERANCES = [1e-5, 1e-9]


@nlctl.record
class Since:
    """Time since its input has exceeded a half, 0 at the start."""

    inputs, outputs, states, feedthrough = ("watched",), ("since",), ("since",), False
    update = staticmethod(lambda t, x, u, p: (1.0,))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (0.5 - u[0],))
    reset = staticmethod(lambda t, x, u, p: (0.0,))


@nlctl.record
class SinceOwn:
    """Time since the last pulse of its own guard."""

    inputs, outputs, states, feedthrough = (), ("since",), ("since",), False
    update = staticmethod(lambda t, x, u, p: (1.0,))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (-1.0 if 0.5 < t % 1.0 < 0.503 else 1.0,))
    reset = staticmethod(lambda t, x, u, p: (0.0,))


def ramp(output, name="watched"):
    """A state x' = 1, and a function of it."""
    return ct.nlsys(
        lambda t, x, u, p: [1.0], lambda t, x, u, p: [output(x[0])], states=1, inputs=0,
        outputs=[name], name="ramp",
    )  # fmt: skip


def signal(function, name="watched"):
    return ct.nlsys(None, lambda t, x, u, p: [function(t)], inputs=0, outputs=[name], name="signal")


def pulse(v):
    return 1.0 if 0.5 < v % 1.0 < 0.503 else 0.0


def run(diagram, method, rtol, **kwargs):
    return nlctl.input_output_response(
        nlctl.compile(diagram), TIMES, method=method, rtol=rtol, atol=1e-2 * rtol, **kwargs
    )


SINCE_A_HALF = np.where(TIMES < 0.5, TIMES, (TIMES - 0.5) % 1.0)


@pytest.mark.parametrize(
    ("method", "rtol", "source"), crossed([*METHODS], [*TOLERANCES], [signal, ramp])
)
def test_a_guard_behind_a_pulse(source, method, rtol):
    """A pulse of 3 ms of t, or of a state, resets a clock."""
    diagram = nlctl.interconnect({"s": source(pulse), "w": Since()}, outputs=["since"])
    found = run(diagram, method, rtol)
    np.testing.assert_allclose(found.outputs.reshape(-1), SINCE_A_HALF, atol=max(rtol, 1e-8))


@pytest.mark.parted
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", TOLERANCES)
def test_a_guard_with_a_pulse_of_its_own(method, rtol):
    diagram = nlctl.interconnect({"w": SinceOwn()}, outputs=["since"])
    found = run(diagram, method, rtol)
    np.testing.assert_allclose(found.outputs.reshape(-1), SINCE_A_HALF, atol=max(rtol, 1e-8))


@pytest.mark.parametrize(
    ("method", "rtol", "source"), crossed([*WITH_MEMORY], [*TOLERANCES], [signal, ramp])
)
def test_a_play_behind_a_pulse(source, method, rtol):
    """A play of half-width 1/4 is drawn to 3/4 by a pulse of height 1, and back to 1/4 behind it.

    No pulse later finds it elsewhere: what is seen is the first.
    """
    play = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.25, c_l=-0.25)
    diagram = nlctl.interconnect({"s": source(pulse, "u"), "play": play}, outputs=["v"])
    found = run(diagram, method, rtol)
    expected = np.where(TIMES < 0.5, 0.0, 0.25)
    np.testing.assert_allclose(found.outputs.reshape(-1), expected, atol=1e-4)


ENGINES = [*((method, "native") for method in METHODS), (None, "python-control")]
EVENTS = {
    "pulse": lambda t, x, u, p: pulse(t) - 0.5,
    "state": lambda t, x, u, p: 1.0 if 2.0 < x[0] < 2.0005 else -1.0,
}


def seen(found, name):
    """Times and directions of an event."""
    own = found.events[found.events["which"] == name]
    return own["time"].to_numpy(), own["direction"].tolist()


@pytest.mark.parted
@pytest.mark.parametrize(("method", "engine"), ENGINES)
@pytest.mark.parametrize("rtol", TOLERANCES)
def test_event_functions_with_pulses(method, engine, rtol):
    """A pulse of t in each second, and one of a state: each edge is an event."""
    found = nlctl.input_output_response(
        nlctl.interconnect({"s": ramp(lambda v: v)}, outputs=["watched"]), TIMES, method=method,
        rtol=rtol, atol=1e-2 * rtol, engine=engine, events=EVENTS,
    )  # fmt: skip
    edges = np.concatenate([k + np.array([0.5, 0.503]) for k in range(5)])
    for name, at in (("pulse", edges), ("state", np.array([2.0, 2.0005]))):
        times, ways = seen(found, name)
        np.testing.assert_allclose(times, at, atol=1e-7)
        assert ways == ["rising", "falling"] * (at.size // 2)


@pytest.mark.parted
@pytest.mark.parametrize(("method", "engine"), ENGINES)
def test_a_run_ends_at_a_pulse(method, engine):
    """Where the state is first within 0.1 ms of 3, and where t is: a jump of the function."""
    for stop_when in (
        lambda t, x, u, p: -1.0 if 2.9999 < x[0] < 3.0001 else 1.0,
        lambda t, x, u, p: -1.0 if 2.9999 < t < 3.0001 else 1.0,
    ):
        found = nlctl.input_output_response(
            nlctl.interconnect({"s": ramp(lambda v: v)}, outputs=["watched"]), TIMES,
            method=method, engine=engine, stop_when=stop_when,
        )  # fmt: skip
        assert found.time[-1] == pytest.approx(3.0 - 1e-4, abs=1e-6)


@nlctl.record
class Bouncing:
    """A ball that keeps half of its speed."""

    inputs, outputs, states, feedthrough = (), ("height",), ("height", "speed"), False
    update = staticmethod(lambda t, x, u, p: (x[1], -9.81))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (x[0],))
    reset = staticmethod(lambda t, x, u, p: (0.0 * x[0], -0.5 * x[1]))


@pytest.mark.parted
@pytest.mark.parametrize(("method", "engine"), ENGINES)
def test_what_jumps_through_zero_is_an_event(method, engine):
    """The speed of a ball leaves 0, rises through it at each bounce, and falls at each summit."""
    found = nlctl.input_output_response(
        nlctl.interconnect({"ball": Bouncing()}, outputs=["height"]), np.linspace(0, 1.1, 12),
        initial_state=[1, 0], method=method, engine=engine,
        events={"speed": lambda t, x, u, p: x[1]},
    )  # fmt: skip
    fall = np.sqrt(2 / 9.81)
    times, ways = seen(found, "speed")
    np.testing.assert_allclose(times, fall * np.array([0.0, 1.0, 1.5, 2.0, 2.25]), atol=1e-7)
    assert ways == ["falling", *["rising", "falling"] * 2]


# windows around a kink: how the function looks near x = 3, and where it is below 0
WIDTHS = [1e-2, 1e-4, 1e-6]
KINKS = {
    "abs": (lambda x, w: abs(x - 3.0) - w, 1.0, 1.0),
    "max": (lambda x, w: max(3.0 - x, 2.0 * (x - 3.0)) - w, 1.0, 0.5),
    "min": (lambda x, w: -min(x - 3.0, 3.0 * (3.0 - x)) - w, 1.0, 1.0 / 3.0),
    "sum of two": (lambda x, w: abs(x - 3.0) + 0.5 * abs(x - 2.0) - 0.5 - w, 2.0, 2.0 / 3.0),
}


def since_window(function, width):
    """Time since a function of a state that grows as t has fallen below 0."""

    @nlctl.record
    class Since:
        inputs, outputs, states, feedthrough = (), ("since",), ("since", "x"), False
        update = staticmethod(lambda t, x, u, p: (1.0, 1.0))
        output = staticmethod(lambda t, x, u, p: (x[0],))
        guard = staticmethod(lambda t, x, u, p: (function(x[1], width),))
        reset = staticmethod(lambda t, x, u, p: (0.0, x[1]))

    return nlctl.block(Since(), "w")


@pytest.mark.parametrize(("method", "width", "kink"), crossed([*METHODS], [*WIDTHS], [*KINKS]))
def test_an_event_function_below_zero_around_its_kink(kink, width, method):
    function, before, behind = KINKS[kink]
    diagram = nlctl.compile(ramp(lambda x: x))

    def window(t, x, u, p):
        return function(x[0], width)

    found = nlctl.input_output_response(
        diagram, [0, 10], method=method, rtol=1e-7, atol=1e-9,
        events=window,
    ).events  # fmt: skip
    own = found[found["which"] == "window"]["time"].to_numpy()
    expected = np.array([3.0 - before * width, 3.0 + behind * width])
    np.testing.assert_allclose(own, expected, rtol=0, atol=max(1e-7, 1e-3 * width) + 1e-9)


@pytest.mark.parametrize(("method", "width", "kink"), crossed([*METHODS], [*WIDTHS], [*KINKS]))
def test_a_guard_that_falls_around_its_kink(kink, width, method):
    diagram = since_window(KINKS[kink][0], width)
    y = nlctl.input_output_response(
        nlctl.compile(diagram), [0, 2.5, 10.0], method=method, rtol=1e-7, atol=1e-9
    ).outputs.reshape(-1)
    fallen = 3.0 - KINKS[kink][1] * width
    np.testing.assert_allclose(y, [0, 2.5, 10.0 - fallen], rtol=0, atol=1e-3 * width + 1e-8)
