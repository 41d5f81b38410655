"""Derivatives where what drives a block jumps: memories, faults, break points that coincide."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import Ball, block

import nlctl

T = 0.7


def driven(signal, actuator, params):
    """A function of t in front of an actuator, and an integral behind it."""
    source = ct.nlsys(
        None, lambda t, x, u, p: [signal(t, p)], inputs=0, outputs=["u"], params=params,
        name="source",
    )  # fmt: skip
    integral = ct.nlsys(
        lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["v"], outputs=["y"], states=["y"],
        name="integral",
    )  # fmt: skip
    parts = {"source": source, "actuator": actuator, "integral": integral}
    return nlctl.interconnect(parts, outputs=["v", "y"])


def play(half_gap=0.5):
    return nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=half_gap, c_l=-half_gap)


@pytest.mark.parametrize(
    ("signal", "by_T", "slope"),
    [
        # held at A - c from the jump on
        (lambda t, p: np.where(t > p["T"], p["A"], 0.0), 0.0, 0.0),
        # u falls behind the jump: held at A - T - c
        (lambda t, p: np.where(t > p["T"], p["A"] - t, 0.0), -1.0, 0.0),
        # u goes on rising: v = A + t - c
        (lambda t, p: np.where(t > p["T"], p["A"] + t, 0.0), 0.0, 1.0),
        # it drives, then falls back within the gap: held at 2 T - c
        (lambda t, p: p["A"] * t - np.where(t > p["T"], 0.6 + 3 * (t - p["T"]), 0.0), 2.0, 0.0),
        # and across it: held at 2 T - 1.8 + c, on the other side
        (lambda t, p: p["A"] * t - np.where(t > p["T"], 1.8, 0.0), 2.0, 0.0),
    ],
    ids=["step", "back", "on", "within the gap", "across the gap"],
)
def test_play_behind_a_jump(signal, by_T, slope):
    """What a play holds is what it was moved to at a time that moves."""
    loop = driven(signal, play(), {"T": T, "A": 2.0})
    t = np.array([0.0, T + 0.05, T + 0.15])
    made = nlctl.sensitivity_response(loop, t, with_respect_to=["source.T", "source.A"])
    assert made.success
    v = made.values[0]
    assert np.allclose(made["v", "source.T"][1:], by_T, rtol=0, atol=1e-7)
    assert abs((v[2] - v[1]) / 0.1 - slope) < 1e-7
    # y' = v, so that y by T is that of v times the time since, less the jump of v at T
    (by_y,) = np.diff(made["y", "source.T"][1:]) / 0.1
    assert abs(by_y - by_T) < 1e-6


def test_play_behind_square_waves():
    """v = A sign(sin(w t + f)) -+ c behind each of four edges: y moves by their heights."""
    loop = driven(
        lambda t, p: p["A"] * np.sign(np.sin(p["w"] * t + p["f"])), play(0.25),
        {"A": 1.0, "w": 4.0, "f": 0.3},
    )  # fmt: skip
    t = np.linspace(0, 3, 7)
    made = nlctl.sensitivity_response(loop, t, with_respect_to=["source.w", "source.A"])
    edges = (np.pi * np.arange(1, 5) - 0.3) / 4.0
    passed = t[:, None] > edges
    height, side = 2 * 0.75, np.array([1.0, -1.0, 1.0, -1.0])
    by_w = np.sum(passed * height * side * -edges / 4.0, axis=1)
    by_a = t - 2 * np.sum(passed * side * (t[:, None] - edges), axis=1)
    assert np.allclose(made["y", "source.w"], by_w, rtol=0, atol=1e-8)
    assert np.allclose(made["y", "source.A"], by_a, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    "law",
    [
        lambda t, T, a: np.where(t < T, t, 0.0) + np.where(t > T, -a, 0.0),
        lambda t, T, a: np.where(t <= T, t, 0.0) + np.where(t >= T, -a, 0.0),
        lambda t, T, a: np.piecewise(t, [t < T, t >= T], [lambda s: s, lambda s: -a]),
        lambda t, T, a: np.select([t < T, t >= T], [t, -a], 5.0),
        lambda t, T, a: t if t < T else (-a if t >= T else 5.0),
        lambda t, T, a: np.where(t < T, t, 0.0) - a * np.heaviside(t - T, 1.0),
    ],
    ids=["< and >", "<= and >=", "piecewise", "select", "if", "heaviside"],
)
def test_two_conditions_on_the_same_numbers(law):
    """x' = t before T and -a behind: T + a by T, however both are written."""
    plant = block(lambda t, x, u, p: [law(t, p["T"], p["a"])], {"T": T, "a": 1.0})
    made = nlctl.sensitivity_response(plant, [0, 1], with_respect_to=["plant.T", "plant.a"])
    assert made.success
    assert abs(made["x", "plant.T"][-1] - (T + 1.0)) < 1e-9
    assert abs(made["x", "plant.a"][-1] + 1.0 - T) < 1e-9


def test_two_conditions_of_a_state():
    """x' = 1 + x up to p, 1 behind: x = p + t - log(1 + p) has 1 - 1 / (1 + p) by p."""
    plant = block(
        lambda t, x, u, p: [
            np.piecewise(x[0], [x[0] < p["p"], x[0] >= p["p"]], [lambda s: 1 + s, lambda s: 1.0])
        ], {"p": 0.9},
    )  # fmt: skip
    made = nlctl.sensitivity_response(plant, [0, 2], with_respect_to="plant.p")
    assert made.success
    assert abs(made["x", "plant.p"][-1] - (1 - 1 / 1.9)) < 1e-8


def stuck(at=None, when=None):
    """x' = -a x + b t, seen through a sensor that sticks, and its integral."""
    plant = ct.nlsys(
        lambda t, x, u, p: [p["b"] * t - p["a"] * x[0]], lambda t, x, u, p: x, inputs=0,
        outputs=["x"], states=["x"], params={"a": 0.5, "b": 1.0}, name="plant",
    )  # fmt: skip
    integral = ct.nlsys(
        lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["x"], outputs=["y"], states=["y"],
        name="integral",
    )  # fmt: skip
    loop = nlctl.interconnect({"plant": plant, "integral": integral}, outputs=["x", "y"])
    return nlctl.with_faults(loop, nlctl.Fault("integral.x", "stuck", at=at, when=when))


def test_what_a_fault_is_stuck_at():
    """y = y(T) + x(T) (t - T): x(T) moves with everything, and with T by its rate."""
    by = ["fault_integral_x.onset", "plant.b", "plant.x(0)"]
    made = nlctl.sensitivity_response(
        stuck(at=T), [0, T, 1.5], 0, {"plant.x": 1.0}, of=["x", "y"], with_respect_to=by
    )
    since, rate = 1.5 - T, T - 0.5 * made.values[0, 1]
    assert made.success
    assert abs(made["y", by[0]][-1] - rate * since) < 1e-8
    for name in by[1:]:
        expected = made["y", name][1] + made["x", name][1] * since
        assert abs(made["y", name][-1] - expected) < 1e-8


def test_what_a_fault_is_stuck_at_when_a_level_is_met():
    """Stuck at the level: y = y(t*) + level (t - t*), whatever x does behind."""
    by = ["plant.b", "plant.x(0)"]
    loop = nlctl.compile(stuck(when="plant.x > 1.1"))
    t = [0, 1.5]

    def end(b=1.0, x0=1.0):
        run = nlctl.input_output_response(
            loop, t, 0, {"plant.x": x0}, params={"plant.b": b}, rtol=1e-12, atol=1e-14
        )
        return run.outputs[1, -1]

    made = nlctl.sensitivity_response(loop, t, 0, {"plant.x": 1.0}, of=["y"], with_respect_to=by)
    h = 1e-4
    assert abs(made["y", by[0]][-1] - (end(b=1 + h) - end(b=1 - h)) / (2 * h)) < 1e-6
    assert abs(made["y", by[1]][-1] - (end(x0=1 + h) - end(x0=1 - h)) / (2 * h)) < 1e-6


def test_what_a_reset_leaves_continuous_goes_through_a_delay():
    """The height of a ball is 0 at a bounce, before and behind: its integral has a derivative."""
    wire = nlctl.block(nlctl.TransportDelay(inputs=("h",), outputs=("late",), delay=0.1), "wire")
    integral = ct.nlsys(
        lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["late"], outputs=["y"], states=["y"],
        name="integral",
    )  # fmt: skip
    loop = nlctl.interconnect({"ball": Ball(), "wire": wire, "integral": integral}, outputs=["y"])
    made = nlctl.sensitivity_response(loop, [0, 1.0], with_respect_to=["ball.e"])
    assert made.success
    # h = e v (s - s_1) - g (s - s_1)^2 / 2 behind s_1 = sqrt(2 / g), v = g s_1
    first = np.sqrt(2 / 9.81)
    assert abs(made["y", "ball.e"][-1] - 9.81 * first * (0.9 - first) ** 2 / 2) < 1e-7


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10, 1e-12])
def test_kinks_that_blocks_declare(rtol):
    """v' = min(K (u - v), rise) leaves its limit at t*, and u - v decays from there on."""
    rise, K, slope = 2.0, 50.0, 1.0
    source = ct.nlsys(
        None, lambda t, x, u, p: [p["h"] + slope * t], inputs=0, outputs=["u"], params={"h": 1.0},
        name="source",
    )  # fmt: skip
    limiter = nlctl.RateLimiter(rise=rise, K=K)
    loop = nlctl.interconnect({"source": source, "limiter": limiter}, outputs=["v"])
    t = np.linspace(0, 1.2, 13)
    made = nlctl.sensitivity_response(
        loop, t, with_respect_to=["source.h", "limiter.rise"], rtol=rtol, atol=0.01 * rtol
    )
    # K (h + t - rise t) = rise at t*; behind, w = u - v has w' = slope - K w
    leaves = (1.0 - rise / K) / (rise - slope)
    decay = np.exp(-K * np.maximum(t - leaves, 0))
    by_h = np.where(t < leaves, 0.0, 1 - decay)  # w = rise / K at t*, where its rate does not jump
    assert made.success
    assert np.allclose(made["v", "source.h"], by_h, rtol=0, atol=max(1e-8, 10 * rtol))


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_turns_at_all_tolerances(rtol):
    """sin(w t) through a play is held at 1 - c, whatever w is: 0 by w, 1 by the amplitude."""
    loop = driven(
        lambda t, p: p["A"] * np.sin(p["w"] * t + 0.1 * t**2), play(0.25), {"A": 1.0, "w": 1.0}
    )
    made = nlctl.sensitivity_response(
        loop, [0, 2.0], with_respect_to=["source.w", "source.A"], rtol=rtol, atol=0.01 * rtol
    )
    assert np.allclose(made.derivatives[0, :, -1], [0.0, 1.0], rtol=0, atol=max(1e-8, 5 * rtol))


def test_play_in_an_algebraic_loop():
    """w = play(A sin t - q w): (A sin t - c) / (1 + q) on its right side, and held from pi / 2."""
    source = ct.nlsys(
        None, lambda t, x, u, p: [p["A"] * np.sin(t) - p["q"] * u[0]], inputs=["w"],
        outputs=["e"], params={"A": 2.0, "q": 0.5}, name="source",
    )  # fmt: skip
    integral = ct.nlsys(
        lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["w"], outputs=["y"], states=["y"],
        name="integral",
    )  # fmt: skip
    loop = nlctl.compile(
        nlctl.interconnect(
            {"source": source, "gap": play(), "integral": integral},
            connections=[["source.w", "gap.v"], ["gap.u", "source.e"], ["integral.w", "gap.v"]],
            inplist=[], outlist=["gap.v"], outputs=["w"],
        ), algebraic_loops="solve",
    )  # fmt: skip
    t = np.array([0.0, 1.0, 1.5, 1.8])
    made = nlctl.sensitivity_response(loop, t, with_respect_to=["source.A", "source.q", "gap.c_r"])
    s = np.sin(np.minimum(t[1:], np.pi / 2))
    assert made.success
    for name, slope in (
        ("source.A", s / 1.5),
        ("source.q", -(2 * s - 0.5) / 1.5**2),
        ("gap.c_r", -np.ones(3) / 1.5),
    ):
        assert np.allclose(made["w", name][1:], slope, rtol=0, atol=1e-7)
