"""Pairs of what jumps, in both engines, one acting on the other, against closed forms."""

import control as ct
import numpy as np
import pytest

import nlctl

T = np.linspace(0, 5, 101) + 0.0123  # beside all instants at which something jumps
TIMES = np.r_[0.0, T]


def signal(function, name="u"):
    """A source."""
    return ct.nlsys(None, lambda t, x, u, p: [function(t)], inputs=0, outputs=[name], name="source")


@nlctl.record
class Watch:
    """Time since its input has exceeded a level, 0 at the start."""

    level: float = 1.0
    inputs, outputs, states, feedthrough = ("watched",), ("since",), ("since",), False
    update = staticmethod(lambda t, x, u, p: (1.0,))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (p.level - u[0],))
    reset = staticmethod(lambda t, x, u, p: (0.0,))

    def derived(self):
        return {"level": self.level}


@nlctl.record
class Saw:
    """u' = 1, and u - 1 where u exceeds 1."""

    inputs, outputs, states, feedthrough = (), ("u",), ("u",), False
    update = staticmethod(lambda t, x, u, p: (1.0,))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (1.0 - x[0],))
    reset = staticmethod(lambda t, x, u, p: (x[0] - 1.0,))


def through(name_in, name_out, dt, **more):
    """What is sampled and held."""
    unit = ct.ss([], [], [], 1.0, dt, inputs=name_in, outputs=name_out, name="hold")
    return nlctl.sampled(unit, **more)


def play(name_in="u", name_out="v", half=0.3):
    class Play(nlctl.Backlash):
        inputs, outputs = (name_in,), (name_out,)

    return nlctl.record(Play)(m_r=1.0, m_l=1.0, c_r=half, c_l=-half)


def relay(name_in="u", name_out="v", **fields):
    class Switch(nlctl.Relay):
        inputs, outputs = (name_in,), (name_out,)

    return nlctl.record(Switch)(**fields)


def late(name_in, name_out, delay):
    return nlctl.TransportDelay(inputs=(name_in,), outputs=(name_out,), delay=delay)


def below(level, name_in="u", name_out="v"):
    """1 below a level, 0 above, by a user's own function."""
    return ct.nlsys(None, lambda t, x, u, p: np.where(u < level, 1.0, 0.0), inputs=[name_in],
                    outputs=[name_out], name="below")  # fmt: skip


def narrow(name_in, name_out):
    """1 within 0.001 of 0, by a user's own function."""
    return ct.nlsys(None, lambda t, x, u, p: np.where(abs(u) < 1e-3, 1.0, 0.0), inputs=[name_in],
                    outputs=[name_out], name="narrow")  # fmt: skip


def integral(name_in, name_out):
    return ct.ss(0, 1, 1, 0, inputs=name_in, outputs=name_out, name="plant")


def since(*at):
    """Time since the last of these instants."""
    return lambda t: t - np.r_[0.0, at][np.searchsorted(at, t, side="right")]


def saw_integral(t):
    return np.floor(t) / 2 + (t % 1) ** 2 / 2


def triangle(t):
    """Of height 0.6, from 0 downwards."""
    return 0.6 * (4 * np.abs((t + 0.6) / 2.4 % 1 - 0.5) - 1)


DELAYED = 0.35
PAIRS = {  # blocks, an output, what it is at t > 0
    "a clock moves a guard": (
        {"s": signal(lambda t: t), "h": through("u", "watched", 0.25), "w": Watch(level=0.6)},
        "since", since(0.75),
    ),
    "a guard moves what a clock samples": (
        {"s": Saw(), "h": through("u", "v", 0.4, offset=0.01)}, "v",
        lambda t: np.where(t < 0.01, 0.0, (0.01 + 0.4 * np.floor((t - 0.01) / 0.4)) % 1),
    ),
    "a play moves a guard": (
        {"s": signal(lambda t: t), "p": play("u", "watched"), "w": Watch()}, "since", since(1.3),
    ),
    "a guard moves a play": (
        {"s": Saw(), "p": play()}, "v",
        lambda t: np.maximum(t % 1 - 0.3, np.where(t < 1, 0.0, 0.3)),
    ),
    "a clock moves a relay": (
        {"s": signal(lambda t: t % 3), "h": through("u", "r", 0.4),
         "v": relay("r", on=1.1, off=0.3)}, "v",
        lambda t: np.where(((t >= 1.2) & (t < 3.2)) | (t >= 4.4), 1.0, -1.0),
    ),
    "a relay moves what a clock samples": (
        {"s": signal(lambda t: t), "v": relay("u", "r", on=1.1, off=0.0),
         "h": through("r", "v", 0.4)}, "v", lambda t: np.where(t < 1.2, -1.0, 1.0),
    ),
    "a play moves a relay": (
        {"s": signal(lambda t: 2 * np.sin(t)), "p": play("u", "r", 0.5),
         "v": relay("r", on=1.0, off=-1.0)}, "v",
        lambda t: np.where((t >= np.arcsin(0.75)) & (t < np.pi + np.arcsin(0.75)), 1.0, -1.0),
    ),
    "a relay moves a play": (
        {"s": signal(lambda t: t), "v": relay("u", "r", on=1.5, off=0.0), "p": play("r", "v")}, "v",
        lambda t: np.where(t < 1.5, -0.7, 0.7),
    ),
    "a relay moves a guard": (
        {"s": signal(lambda t: t), "v": relay("u", "watched", on=1.5, off=0.0),
         "w": Watch(level=0.0)}, "since", since(1.5),
    ),
    "a guard moves a relay": (
        {"s": Saw(), "v": relay(on=0.8, off=0.2)}, "v",
        lambda t: np.where((t >= 0.8) & ((t % 1 > 0.8) | (t < 0)), 1.0, -1.0),
    ),
    "a guard moves what is delayed": (
        {"s": Saw(), "d": late("u", "v", DELAYED), "p": integral("v", "z")}, "z",
        lambda t: saw_integral(np.maximum(t - DELAYED, 0)),
    ),
    "a delay moves a guard": (
        {"s": Saw(), "d": late("u", "watched", DELAYED), "w": Watch(level=0.5)}, "since",
        since(*(0.85 + np.arange(5))),
    ),
    "a delay moves a relay, which moves what is delayed": (
        {"d": late("x", "u", 0.4), "v": relay(on=0.2, off=-0.2, v0=1.0), "x": ct.ss(
            0, -1, 1, 0, inputs="v", outputs="x", name="plant")}, "x", triangle,
    ),
    "a delay moves a narrow condition": (
        {"s": signal(np.cos), "d": late("u", "w", DELAYED), "n": narrow("w", "v"),
         "p": integral("v", "z")}, "z",
        lambda t: np.minimum(t, DELAYED) + 2 * np.arcsin(1e-3) * (t > np.pi / 2 + DELAYED),
    ),
    "a clock moves a play": (
        {"s": signal(lambda t: t), "h": through("u", "r", 0.25), "p": play("r", "v")}, "v",
        lambda t: np.maximum(0.25 * np.floor(4 * t) - 0.3, 0.0),
    ),
    "a play moves what a clock samples": (
        {"s": signal(lambda t: t), "p": play("u", "r"), "h": through("r", "v", 0.4)}, "v",
        lambda t: np.maximum(0.4 * np.floor(t / 0.4) - 0.3, 0.0),
    ),
    "a condition of time moves a guard": (
        {"s": signal(lambda t: np.where(t % 1.0 < 0.25, 1.0, 0.0), "watched"),
         "w": Watch(level=0.5)}, "since",
        lambda t: np.where(t < 1, t, t % 1),
    ),
    "a guard moves a condition": (
        {"s": Saw(), "c": below(0.3), "p": integral("v", "z")}, "z",
        lambda t: 0.3 * np.floor(t) + np.minimum(t % 1, 0.3),
    ),
    "a clock moves a condition": (
        {"s": signal(lambda t: t), "h": through("u", "r", 0.4), "c": below(1.0, "r"),
         "p": integral("v", "z")}, "z", lambda t: np.minimum(t, 1.2),
    ),
    "a condition moves what a clock samples": (
        {"s": signal(lambda t: t % 1.0), "c": below(0.5, "u", "r"), "h": through("r", "v", 0.3)},
        "v", lambda t: np.where(0.3 * np.floor(t / 0.3) % 1 < 0.5 - 1e-9, 1.0, 0.0),
    ),
    "a play moves a condition": (
        {"s": signal(lambda t: t), "p": play("u", "r"), "c": below(1.0, "r"),
         "p2": integral("v", "z")}, "z", lambda t: np.minimum(t, 1.3),
    ),
    "a condition moves a play": (
        {"s": signal(lambda t: t), "c": below(1.5, "u", "r"), "p": play("r", "v")}, "v",
        lambda t: np.where(t < 1.5, 0.7, 0.3),
    ),
    "a play moves what is delayed, which moves a clock": (
        {"s": signal(lambda t: t), "p": play("u", "r"), "d": late("r", "w", 0.5),
         "h": through("w", "v", 0.4)}, "v",
        lambda t: np.maximum(0.4 * np.floor(t / 0.4) - 0.8, 0.0),
    ),
}  # fmt: skip


def outputs(pair, engine):
    """Of the loop of a pair, and what they are."""
    blocks, output, exact = PAIRS[pair]
    found = nlctl.input_output_response(
        nlctl.interconnect(blocks, outputs=[output]), TIMES, 0, engine=engine, rtol=1e-10,
        atol=1e-12, squeeze=False,
    )  # fmt: skip
    return found.outputs[0, 1:], exact(T)


@pytest.mark.parted
@pytest.mark.parametrize("pair", PAIRS)
def test_in_the_reference(pair):
    np.testing.assert_allclose(*outputs(pair, "python-control"), rtol=0, atol=1e-8)


@pytest.mark.parted
@pytest.mark.parametrize("pair", PAIRS)
def test_in_machine_code(pair):
    np.testing.assert_allclose(*outputs(pair, "native"), rtol=0, atol=1e-7)
