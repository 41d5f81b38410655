"""Derivatives where what drives a block jumps: memories, faults, break points that coincide."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import Ball, Tank, block

import nlctl
from nlctl.analysis.metrics import Metric

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


@pytest.mark.parted
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


@pytest.mark.parted
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


# -- held inputs -----------------------------------------------------------------------------------

HELD, TIMES = np.array([0.0, 1.7, -0.4, 1.1, -1.6, 0.2, 0.9]), 0.5 * np.arange(7.0)


def follower(rate, params, name="plant"):
    """x' by x and an input r."""
    return ct.nlsys(
        rate, lambda t, x, u, p: x, inputs=["r"], outputs=["x"], states=["x"], params=params,
        name=name,
    )  # fmt: skip


def differences(loop, name, value, start, h=1e-3):
    """Richardson differences of tight runs with held inputs."""
    compiled = nlctl.compile(loop)
    rows = []
    for step in (h, h / 2):
        runs = [
            nlctl.input_output_response(
                compiled, TIMES, HELD, start, params={name: value + side * step}, hold="zoh",
                rtol=1e-11, atol=1e-13,
            ).outputs for side in (1, -1)
        ]  # fmt: skip
        rows.append((runs[0] - runs[1]) / (2 * step))
    return (4 * rows[1] - rows[0]) / 3


def test_a_lag_of_held_inputs():
    """x' = b r - a x: by a and b in closed form from sample to sample, and by the start."""
    loop = follower(lambda t, x, u, p: [p["b"] * u[0] - p["a"] * x[0]], {"a": 0.8, "b": 1.3})
    by = ["plant.a", "plant.b", "plant.x(0)"]
    made = nlctl.sensitivity_response(
        loop, TIMES, HELD, 0.5, with_respect_to=by, hold="zoh", rtol=1e-10, atol=1e-12
    )
    a, b, dt = 0.8, 1.3, 0.5
    x, by_a, by_b, by_start = 0.5, 0.0, 0.0, 1.0
    fade = np.exp(-a * dt)
    for k, r in enumerate(HELD):
        exact = [by_a, by_b, by_start]
        assert [made["x", name][k] for name in by] == pytest.approx(exact, abs=1e-8)
        by_a = fade * by_a - dt * fade * x + b * r * (dt * fade / a - (1 - fade) / a**2)
        by_b, by_start = fade * by_b + r * (1 - fade) / a, fade * by_start
        x = fade * x + b * r * (1 - fade) / a


STEPPED = {
    "jump": (lambda t, x, u, p: [np.where(u[0] + x[0] > p["a"], 1.0, -0.5) - x[0]], 0.3),
    "sign": (lambda t, x, u, p: [np.sign(u[0] - p["a"]) * (2 + x[0]) * p["a"] - x[0]], 0.6),
    "kink": (lambda t, x, u, p: [np.maximum(u[0], p["a"] * x[0]) - x[0]], 0.4),
}


@pytest.mark.parametrize("name", STEPPED)
def test_conditions_that_held_inputs_step_across(name):
    """What a step takes across does not move with anything."""
    rate, a = STEPPED[name]
    loop = follower(rate, {"a": a})
    made = nlctl.sensitivity_response(
        loop, TIMES, HELD, 0.2, with_respect_to="plant.a", hold="zoh", rtol=1e-10, atol=1e-12
    )
    exact = differences(loop, "plant.a", a, 0.2)
    np.testing.assert_allclose(made["x", "plant.a"], exact, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("record", [
    nlctl.Backlash(c_r=0.4, c_l=-0.5, m_r=1.2, m_l=0.9), nlctl.Relay(on=0.5, off=-0.2, height=0.8),
], ids=["play", "relay"])  # fmt: skip
def test_memories_behind_held_inputs(record):
    """A lead filter in front of a play and of a relay: steps drive these to and fro."""
    lead = ct.nlsys(
        lambda t, x, u, p: [p["g"] * (u[0] - x[0])], lambda t, x, u, p: [x[0] + 0.5 * u[0]],
        inputs=["r"], outputs=["u"], states=["z"], params={"g": 3.0}, name="lead",
    )  # fmt: skip
    parts = {"lead": lead, "actuator": nlctl.block(record, "actuator"), "integral": INTEGRAL}
    loop = nlctl.interconnect(parts, inputs=["r"], outputs=["y"])
    made = nlctl.sensitivity_response(
        loop, TIMES, HELD, with_respect_to="lead.g", hold="zoh", rtol=1e-10, atol=1e-12
    )
    exact = differences(loop, "lead.g", 3.0, 0.0)
    np.testing.assert_allclose(made["y", "lead.g"], exact, rtol=1e-6, atol=1e-7)


INTEGRAL = ct.nlsys(
    lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["v"], outputs=["y"], states=["y"],
    name="integral",
)  # fmt: skip


def test_a_play_behind_a_steep_ramp():
    """A ramp of 1e-9 s is no corner that lies ahead: v = m (u - c) has -m by c, also next to it."""
    loop = nlctl.block(nlctl.Backlash(c_r=0.4, c_l=-0.5, m_r=1.2, m_l=0.9), "play")
    t = np.array([0.0, 1.0, 1.0 + 1e-9, 2.0, 2.0 + 1e-9, 3.0])
    u = np.array([0.0, 0.0, 2.0, 2.0, -1.0, -1.0])
    made = nlctl.sensitivity_response(loop, t, u, with_respect_to=["play.c_r", "play.c_l"])
    assert made.success
    assert made["v", "play.c_r"] == pytest.approx([0, 0, -1.2, -1.2, 0, 0], abs=1e-9)
    assert made["v", "play.c_l"] == pytest.approx([0, 0, 0, 0, -0.9, -0.9], abs=1e-9)


@pytest.mark.parametrize("part", ["a guard", "a delay"])
def test_what_sees_the_instant_of_a_step_is_refused(part):
    """By name, with what to do instead."""
    if part == "a delay":
        loop = nlctl.block(nlctl.TransportDelay(inputs=("r",), outputs=("x",), delay=0.3), "late")
        by = "late.delay"
    else:
        loop, by = nlctl.block(Tank(), "tank"), "tank.q"
    with pytest.raises(nlctl.errors.CompileError, match=f"{part} sees the steps of held inputs"):
        nlctl.sensitivity_response(loop, TIMES, 2 + HELD, with_respect_to=by, hold="zoh")


@pytest.mark.parted
@pytest.mark.parametrize("periodic", [False, True])
def test_a_play_behind_a_table(periodic):
    """u = K r - t with r held at 0 and 1.5: driven left until t = 1, then right, where it stays."""
    table = nlctl.sources.TimeTable(
        times=(0.0, 1.0, 2.0), values=(0.0, 1.5, 0.0), hold=True, periodic=periodic
    )
    law = ct.nlsys(
        None, lambda t, x, u, p: [p["K"] * u[0] - t], inputs=["r"], outputs=["u"],
        params={"K": 1.0}, name="law",
    )  # fmt: skip
    record = nlctl.Backlash(c_r=0.3, c_l=-0.25, m_r=1.1, m_l=0.9)
    parts = {"table": nlctl.block(table, "table", outputs=["r"]), "law": law,
             "play": nlctl.block(record, "play")}  # fmt: skip
    loop = nlctl.interconnect(parts, outputs=["v"])
    by = ["law.K", "play.c_r", "play.c_l"]
    made = nlctl.sensitivity_response(loop, [0, 0.9, 1.05, 1.5], with_respect_to=by)
    assert made.success
    np.testing.assert_allclose(
        made.derivatives[0].T[1:], [[0, 0, -0.9], [1.65, -1.1, 0], [1.65, -1.1, 0]], atol=1e-7
    )


def test_fit_and_tune_take_held_inputs():
    """The lag that python-control's own sampling says; a note of margins between samples, too."""
    loop = follower(lambda t, x, u, p: [u[0] - p["a"] * x[0]], {"a": 0.8})
    exact = ct.sample_system(ct.ss(-0.8, 1, 1, 0), 0.5, "zoh")
    data = np.ravel(ct.forced_response(exact, TIMES, HELD).outputs)
    found = nlctl.fit(loop, TIMES, {"x": data}, {"plant.a": 1.5}, HELD, hold="zoh")
    assert abs(found["plant.a"] - 0.8) < 1e-6
    other = nlctl.fit(loop, TIMES, {"x": data}, {"plant.a": 1.5}, HELD)
    assert abs(other["plant.a"] - 0.8) > 1e-2
    missed = Metric(
        key="missed", signal="x", function=lambda t, x: float(np.sum((x - data) ** 2)), unit="1",
        meaning="squares",
    )  # fmt: skip
    tuned = nlctl.tune(
        loop, {"plant.a": (1.5, 0.2, 3.0)}, [], 60, TIMES, HELD, cost=missed, hold="zoh"
    )
    assert abs(tuned["plant.a"] - 0.8) < 1e-2
    for run in (nlctl.fit, nlctl.tune, nlctl.sensitivity_response):
        given = {"hold": "zero"}
        given |= {nlctl.fit: {"data": {"x": data}, "parameters": {"plant.a": 1.0}},
                  nlctl.tune: {"space": {"plant.a": (0.2, 3.0)}, "spec": [], "cost": missed},
                  nlctl.sensitivity_response: {"with_respect_to": "plant.a"}}[run]  # fmt: skip
        with pytest.raises(nlctl.errors.ParameterError, match="hold to be 'foh' or 'zoh'"):
            run(loop, timepts=TIMES, inputs=HELD, **given)
