"""Derivatives of runs against closed forms: every way in which states move and jump."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import Ball, ball_after, block, end, jumping_rate

import nlctl


def differences(function, at, h=1e-3):
    """Derivative of a function by Richardson's extrapolation of central differences."""
    value = lambda step: (function(at + step) - function(at - step)) / (2 * step)  # noqa: E731
    return (64 * value(h / 4) - 20 * value(h / 2) + value(h)) / 45


def of_run(diagram, times, name, at, initial=None, h=1e-3, inputs=0.0):
    """The same of the outputs of a run, by a parameter or an initial state."""
    compiled = nlctl.compile(diagram)

    def outputs(value):
        start, params = dict(initial or {}), {}
        if name.endswith("(0)"):
            start[name.removesuffix("(0)")] = value
        else:
            params[name] = value
        return nlctl.input_output_response(
            compiled, times, inputs, start, params=params, rtol=1e-12, atol=1e-14, squeeze=False
        ).outputs

    return differences(outputs, at, h)


def check(diagram, times, of, by, initial=None, inputs=0.0, within=1e-7, h=1e-3, **more):
    """Compare derivatives of a diagram's outputs, in their order, with differences of runs."""
    made = nlctl.sensitivity_response(
        diagram, times, inputs, initial, of=of, with_respect_to=list(by), **more
    )
    assert made.success, made.message
    for name, value in by.items():
        expected = of_run(diagram, times, name, value, initial, h, inputs)
        for signal, row in zip(of, expected, strict=True):
            scale = max(np.abs(row).max(), 1e-2)
            assert np.abs(made[signal, name] - row).max() < within * scale, (signal, name)
    return made


def test_linear():
    """x' = -a x + b u: exp(-a t), and by a and b what follows."""
    lag = ct.nlsys(
        lambda t, x, u, p: [-p["a"] * x[0] + p["b"] * u[0]], lambda t, x, u, p: x, inputs=1,
        outputs=["x"], states=["x"], params={"a": 2.0, "b": 3.0}, name="lag",
    )  # fmt: skip
    t = np.linspace(0, 2, 9)
    made = nlctl.sensitivity_response(
        lag, t, 1.0, [0.5], with_respect_to=["lag.a", "lag.b", "lag.x(0)"]
    )
    decay = np.exp(-2 * t)
    by_a = -t * decay * 0.5 + 3 * (t * decay / 2 - (1 - decay) / 4)
    assert np.allclose(made["x", "lag.a"], by_a, rtol=0, atol=1e-8)
    assert np.allclose(made["x", "lag.b"], (1 - decay) / 2, rtol=0, atol=1e-8)
    assert np.allclose(made["x", "lag.x(0)"], decay, rtol=0, atol=1e-8)
    assert np.allclose(made.values[0], 0.5 * decay + 1.5 * (1 - decay), rtol=0, atol=1e-8)


def test_rising_comparison():
    """x' = 1 + (x > p) gives x = 2 t - p behind t = p: -1 by p, 2 by x(0)."""
    made = nlctl.sensitivity_response(
        jumping_rate(), [0, 0.25, 1], with_respect_to=["plant.p", "plant.x(0)"]
    )
    assert np.allclose(made["x", "plant.p"], [0, 0, -1], rtol=0, atol=1e-9)
    assert np.allclose(made["x", "plant.x(0)"], [1, 1, 2], rtol=0, atol=1e-9)


def test_falling_comparison():
    """x' = -1 above p and -3 below: behind the crossing x = p - 3 (t - x(0) + p)."""
    plant = block(lambda t, x, u, p: [np.where(x[0] > p["p"], -1.0, -3.0)], {"p": 0.5})
    made = nlctl.sensitivity_response(
        plant, [0, 1], 0, [1.0], with_respect_to=["plant.p", "plant.x(0)"]
    )
    assert abs(end(made, "x", "plant.p") + 2) < 1e-9
    assert abs(end(made, "x", "plant.x(0)") - 3) < 1e-9


def test_condition_of_time():
    """x' = a (t > T) - x: by T it is -a exp(T - t)."""
    plant = block(
        lambda t, x, u, p: [np.where(t > p["T"], p["a"], 0.0) - x[0]], {"T": 0.5, "a": 2.0}
    )
    made = nlctl.sensitivity_response(plant, [0, 1], with_respect_to=["plant.T", "plant.a"])
    assert abs(end(made, "x", "plant.T") + 2 * np.exp(-0.5)) < 1e-9
    assert abs(end(made, "x", "plant.a") - (1 - np.exp(-0.5))) < 1e-9


def test_pulse_width():
    """Ten pulses of width d T: 10 T by d, 10 d by T."""

    def pulses(t, x, u, p):
        return [np.where(p["d"] > (t % p["T"]) / p["T"], 1.0, 0.0)]

    plant = block(pulses, {"d": 0.3, "T": 0.1})
    made = nlctl.sensitivity_response(plant, [0, 0.95], with_respect_to=["plant.d", "plant.T"])
    assert abs(end(made, "x", "plant.d") - 1) < 1e-9
    assert abs(end(made, "x", "plant.T") - 3) < 1e-9


def compared(t, x, u, p):
    return [np.where(x[0] < p["d"] + 0.2 * np.sin(20 * t), 1.0, -1.0) - x[0]]


def test_comparator_of_a_state():
    """What compares a state with a wave switches at times that follow from everything."""
    check(
        block(compared, {"d": 0.3}), [0, 0.6, 1.234], ["x"],
        {"plant.d": 0.3, "plant.x(0)": 0.1}, {"plant.x": 0.1},
    )  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("rounding", [np.floor, np.ceil, np.rint, np.trunc])
def test_steps(rounding):
    """x' = 1 + a round(x / q): straight pieces, one behind the other."""
    plant = block(lambda t, x, u, p: [1 + p["a"] * rounding(x[0] / p["q"])], {"a": 0.5, "q": 0.3})
    check(plant, [0, 0.45, 1], ["x"], {"plant.a": 0.5, "plant.q": 0.3})


@pytest.mark.parted
@pytest.mark.parametrize(
    "law",
    [
        lambda t, x, u, p: [1.5 - np.sign(np.sin(6 * x[0] - p["a"]))],
        lambda t, x, u, p: [1.0 + np.heaviside(x[0] - p["a"], 0.5)],
        lambda t, x, u, p: [1.0 + p["a"] * (x[0] % 0.3)],
        lambda t, x, u, p: [1.5 + np.copysign(p["a"], np.sin(9 * x[0] + p["a"]))],
        lambda t, x, u, p: [
            1.5 + 0.3 * np.arctan2(np.sin(6 * x[0] + 1), np.cos(6 * x[0] + p["a"]))
        ],
        lambda t, x, u, p: [1.0 + np.abs(np.sin(7 * x[0]) - p["a"]) + np.maximum(x[0], p["a"])],
        lambda t, x, u, p: [1.0 + np.where((x[0] > p["a"]) & (x[0] < 2 * p["a"]), 2.0, x[0])],
    ],
    ids=["sign", "heaviside", "remainder", "copysign", "arctan2", "bends", "window"],
)
def test_other_jumps(law):
    """Each operation that jumps or bends, by a parameter and by where the run begins."""
    check(
        block(law, {"a": 0.4}), [0, 0.7, 1.3], ["x"], {"plant.a": 0.4, "plant.x(0)": 0.05},
        {"plant.x": 0.05}, h=1e-4, within=5e-7,
    )  # fmt: skip


def test_where_that_does_not_jump():
    """A dead zone of `np.where` has kinks only, also where it turns near them."""
    check(
        block(
            lambda t, x, u, p: [np.cos(3 * t), np.where(x[0] > p["b"], x[0] - p["b"], 0.0)],
            {"b": 0.2}, states=("x", "y"),
        ), [0, 0.5, 3.0], ["x", "y"], {"plant.b": 0.2, "plant.x(0)": 0.0},
    )  # fmt: skip


def test_bouncing_ball():
    """Height behind three bounces, by height, restitution and gravity, to 1e-10."""
    ball, t = nlctl.block(Ball(), "ball"), 2.03
    names = ["ball.h(0)", "ball.e", "ball.g"]
    made = nlctl.sensitivity_response(
        ball, [0, t], of=["h"], with_respect_to=names, rtol=1e-12, atol=1e-14
    )
    values = list(map(np.longdouble, (1.0, 0.8, 9.81)))
    for i, name in enumerate(names):

        def height(value, i=i):
            return ball_after(np.longdouble(t), *[*values[:i], value, *values[i + 1 :]], 3)

        expected = differences(height, values[i], np.longdouble(1e-3))
        assert abs(end(made, "h", name) - expected) < 1e-10 * max(1, abs(expected))
    assert abs(made.values[0, -1] - ball_after(t, 1.0, 0.8, 9.81, 3)) < 1e-10


def through_a_gap():
    """A source A sin t through a play, and its integral."""
    source = block(
        lambda t, x, u, p: [p["w"] * x[1], -p["w"] * x[0]], {"w": 1.0}, ("s", "c"), "source"
    )
    gap = nlctl.block(nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.2, c_l=-0.2), "gap")
    integral = ct.nlsys(
        lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["v"], outputs=["y"], states=["y"],
        name="integral",
    )  # fmt: skip
    return ct.interconnect(
        [source, gap, integral], connections=[["gap.u", "source.s"], ["integral.v", "gap.v"]],
        inputs=[], outlist=["gap.v", "integral.y", "source.c"], outputs=["v", "y", "c"],
    )  # fmt: skip


def test_play():
    """A sin(t) goes on to A - c_r, stands, and comes back A - c_l ... behind."""
    t = np.linspace(0, 6, 25)
    names = ["gap.c_r", "gap.c_l", "source.c(0)", "gap.memory(0)"]
    made = nlctl.sensitivity_response(
        through_a_gap(), t, 0, {"source.c": 1.0}, of=["v", "gap.memory"], with_respect_to=names
    )
    rises = (t > np.arcsin(0.2)) & (t < np.pi - np.arcsin(0.6))
    falls = (t > np.pi - np.arcsin(0.6)) & (t < 2 * np.pi - np.arcsin(0.6))
    stands = (t > np.pi / 2) & rises
    for signal in ("v", "gap.memory"):
        assert np.allclose(made[signal, "gap.c_r"][rises], -1)
        assert np.allclose(made[signal, "gap.c_l"][falls], -1)
        assert np.allclose(made[signal, "source.c(0)"][stands], 1, rtol=0, atol=1e-7)
        assert np.allclose(made[signal, "gap.memory(0)"], t < np.arcsin(0.2))
    check(
        through_a_gap(), t, ["v", "y", "c"],
        {"gap.c_r": 0.2, "gap.c_l": -0.2, "source.c(0)": 1.0, "source.w": 1.0},
        {"source.c": 1.0}, h=1e-4, within=1e-6,
    )  # fmt: skip


def first_order(name="plant"):
    return ct.nlsys(
        lambda t, x, u, p: [-p["a"] * x[0] - u[0] + p["d"]], lambda t, x, u, p: x, inputs=["v"],
        outputs=["u"], states=["x"], params={"a": 1.0, "d": 0.2}, name=name,
    )  # fmt: skip


def test_relay_with_hysteresis():
    """A memory that jumps: seventeen switches, each at a time that moves."""
    relay = nlctl.Relay(on=0.3, off=-0.2, height=1.0)
    loop = nlctl.interconnect({"relay": relay, "plant": first_order()}, outputs=["u"])
    by = {"relay.on": 0.3, "relay.off": -0.2, "relay.height": 1.0, "plant.d": 0.2}
    check(loop, np.linspace(0, 5, 11), ["u"], by | {"plant.x(0)": 1.0}, {"plant.x": 1.0})


def test_sliding():
    """x' = d - v slides from x(0) / (1 - d) on: x = 0, v = d, and z' = v behind."""
    plant = ct.nlsys(
        lambda t, x, u, p: [p["d"] - u[0], u[0]], lambda t, x, u, p: x, inputs=["v"],
        outputs=["u", "z"], states=["x", "z"], params={"d": 0.5}, name="plant",
    )  # fmt: skip
    loop = nlctl.interconnect(
        {"relay": nlctl.IdealRelay(), "plant": plant}, outputs=["u", "z", "v"]
    )
    made = nlctl.sensitivity_response(
        loop, [0, 1, 4], 0, {"plant.x": 1.0}, with_respect_to=["plant.d", "plant.x(0)"]
    )
    # until t* = x(0) / (1 - d) = 2: x = x(0) - (1 - d) t, z = t; then x = 0, z = t* + d (t - t*)
    assert np.allclose(made["u", "plant.d"], [0, 1, 0], rtol=0, atol=1e-5)
    assert np.allclose(made["u", "plant.x(0)"], [1, 1, 0], rtol=0, atol=1e-5)
    assert np.allclose(made["v", "plant.d"], [0, 0, 1], rtol=0, atol=1e-5)
    assert np.allclose(made["z", "plant.d"], [0, 0, 4], rtol=0, atol=1e-5)
    assert np.allclose(made["z", "plant.x(0)"], [0, 0, 1], rtol=0, atol=1e-5)


def test_stick_slip():
    """Friction that sticks: the mode switches, and the force with it."""
    mass = ct.nlsys(
        lambda t, x, u, p: [x[1], p["F"] * np.sin(2 * t) - u[0]],
        lambda t, x, u, p: [x[1], p["F"] * np.sin(2 * t)], inputs=["force"],
        outputs=["velocity", "applied"], states=["position", "velocity"], params={"F": 1.8},
        name="mass",
    )  # fmt: skip
    friction = nlctl.actuators.StickSlip(F_c=1.0, F_s=1.5)
    loop = nlctl.interconnect({"mass": mass, "friction": friction}, outputs=["velocity"])
    check(
        loop, np.linspace(0, 5, 21), ["velocity"],
        {"mass.F": 1.8, "friction.F_c": 1.0, "friction.F_s": 1.5, "friction.sigma_2": 0.4},
        {"mass.velocity": 0.3}, within=1e-6,
    )  # fmt: skip


def test_sampled_loop():
    """x' = u - a x and a gain that is sampled: (e^-aT - K (1 - e^-aT) / a)^n."""
    plant = ct.nlsys(
        lambda t, x, u, p: [u[0] - p["a"] * x[0]], lambda t, x, u, p: x, inputs=["u"],
        outputs=["y"], states=["x"], params={"a": 1.0}, name="plant",
    )  # fmt: skip
    law = ct.nlsys(
        None, lambda t, x, u, p: [-p["K"] * u[0]], inputs=["y"], outputs=["u"],
        params={"K": 2.0}, name="law",
    )  # fmt: skip
    loop = nlctl.interconnect({"plant": plant, "law": nlctl.sampled(law, 0.1)}, outputs=["y"])
    made = nlctl.sensitivity_response(
        loop, [0, 0.95], 0, {"plant.x": 1.0}, with_respect_to=["law.K", "plant.a", "plant.x(0)"]
    )

    def held(K, a, T):
        return np.exp(-a * T) - K * (1 - np.exp(-a * T)) / a

    def last(K, a):
        return held(K, a, 0.1) ** 9 * held(K, a, 0.05)

    assert abs(end(made, "y", "law.K") - differences(lambda K: last(K, 1.0), 2.0)) < 1e-9
    assert abs(end(made, "y", "plant.a") - differences(lambda a: last(2.0, a), 1.0)) < 1e-9
    assert abs(end(made, "y", "plant.x(0)") - last(2.0, 1.0)) < 1e-9


def test_sampled_law_with_a_state():
    """A sampled integrator's state keeps its derivative from sample to sample."""
    law = ct.nlsys(
        lambda t, x, u, p: [x[0] + 0.1 * p["I"] * u[0]], lambda t, x, u, p: [-x[0] - u[0]],
        inputs=["y"], outputs=["v"], states=["i"], dt=0.1, params={"I": 2.0}, name="law",
    )  # fmt: skip
    plant = ct.nlsys(
        lambda t, x, u, p: [u[0] - x[0]], lambda t, x, u, p: x, inputs=["v"], outputs=["y"],
        states=["x"], name="plant",
    )  # fmt: skip
    loop = nlctl.interconnect({"plant": plant, "law": nlctl.sampled(law)}, outputs=["y", "v"])
    check(loop, [0, 0.55, 1.0], ["y", "v"], {"law.I": 2.0, "plant.x(0)": 1.0}, {"plant.x": 1.0})


def test_delay():
    """x' = -k x(t - 1), by k, by x(0), and by what was before: the method of steps."""
    wire = nlctl.block(nlctl.TransportDelay(inputs=("x",), outputs=("y",), delay=1.0), "wire")
    plant = ct.nlsys(
        lambda t, x, u, p: [-p["k"] * u[0]], lambda t, x, u, p: x, inputs=["y"], outputs=["x"],
        states=["x"], params={"k": 1.0}, name="plant",
    )  # fmt: skip
    loop = nlctl.interconnect({"wire": wire, "plant": plant}, outputs=["x"])
    made = nlctl.sensitivity_response(
        loop, [0, 1, 2, 2.5], 0, {"plant.x": 1.0},
        with_respect_to=["plant.k", "plant.x(0)", "wire.before"],
    )  # fmt: skip
    assert np.allclose(made["x", "plant.k"], [0, 0, -1, -1.25], rtol=0, atol=1e-9)
    assert np.allclose(made["x", "plant.x(0)"], [1, 1, 0, -0.375], rtol=0, atol=1e-9)
    assert np.allclose(made["x", "wire.before"], [0, -1, -0.5, -1 / 48], rtol=0, atol=1e-9)


def test_kink_through_a_delay():
    """z' = x(t - 0.3) with x = 2 t - p behind p: z has -(t - p - 0.3) by p."""
    wire = nlctl.block(nlctl.TransportDelay(inputs=("x",), outputs=("y",), delay=0.3), "wire")
    plant = ct.nlsys(
        lambda t, x, u, p: [1 + np.where(x[0] > p["p"], 1.0, 0.0), u[0]], lambda t, x, u, p: x,
        inputs=["y"], outputs=["x", "z"], states=["x", "z"], params={"p": 0.5}, name="plant",
    )  # fmt: skip
    loop = nlctl.interconnect({"wire": wire, "plant": plant}, outputs=["z"])
    made = nlctl.sensitivity_response(loop, [0, 0.6, 0.9, 1.1], with_respect_to=["plant.p"])
    assert np.allclose(made["z", "plant.p"], [0, 0, -0.1, -0.3], rtol=0, atol=1e-9)


def test_inputs_over_time():
    """A matrix of inputs, by the amplitudes of each and a limit."""
    plant = ct.nlsys(
        lambda t, x, u, p: [-x[0] + p["A"] * u[0] + p["B"] * np.maximum(u[1], p["c"])],
        lambda t, x, u, p: x, inputs=["u", "w"], outputs=["y"], states=["x"],
        params={"A": 1.0, "B": 0.5, "c": 0.2}, name="plant",
    )  # fmt: skip
    t = np.linspace(0, 3, 31)
    inputs = np.stack([np.sin(t), np.cos(t)])
    check(plant, t, ["y"], {"plant.A": 1.0, "plant.B": 0.5, "plant.c": 0.2}, inputs=inputs)


def test_threshold_of_an_input():
    """x' = (u > p) with u = t^2 in straight pieces: by p it is -1 / u'."""
    plant = ct.nlsys(
        lambda t, x, u, p: [np.where(u[0] > p["p"], 1.0, 0.0)], lambda t, x, u, p: x,
        inputs=["u"], outputs=["y"], states=["x"], params={"p": 0.5}, name="plant",
    )  # fmt: skip
    t = np.linspace(0, 1, 11)
    made = nlctl.sensitivity_response(plant, t, t**2, with_respect_to=["plant.p"])
    assert abs(end(made, "y", "plant.p") + 1 / 1.5) < 1e-8  # u' from 0.7 to 0.8 is 1.5


def test_algebraic_loop():
    """y = tanh(a y + x): the derivative is that of the implicit function."""
    block_of = ct.nlsys(
        lambda t, x, u, p: [-u[0]], lambda t, x, u, p: [np.tanh(p["a"] * u[0] + x[0])],
        inputs=["y"], outputs=["y"], states=["x"], params={"a": 0.5}, name="plant",
    )  # fmt: skip
    loop = ct.interconnect(
        [block_of], connections=[["plant.y", "plant.y"]], inputs=[], outlist=["plant.y"],
        outputs=["y"], name="loop",
    )  # fmt: skip
    compiled = nlctl.compile(loop, algebraic_loops="solve")
    made = nlctl.sensitivity_response(
        compiled, [0, 1], 0, [1.0], with_respect_to=["plant.a", "plant.x(0)"]
    )

    def last(a, start):
        run = nlctl.input_output_response(
            compiled, [0, 1], 0, [start], params={"plant.a": a}, rtol=1e-12, atol=1e-14
        )
        return run.outputs.ravel()[-1]

    assert abs(end(made, "y", "plant.a") - differences(lambda a: last(a, 1.0), 0.5)) < 1e-7
    assert abs(end(made, "y", "plant.x(0)") - differences(lambda x: last(0.5, x), 1.0)) < 1e-7


def test_stiff():
    """A stiff loop: the stiff method has the exact Jacobian of all derivatives."""
    van_der_pol = block(
        lambda t, x, u, p: [x[1], p["m"] * (1 - x[0] ** 2) * x[1] - x[0]], {"m": 200.0},
        states=("x", "y"),
    )  # fmt: skip
    check(
        van_der_pol, [0, 50.0, 100.0], ["x", "y"], {"plant.m": 200.0, "plant.x(0)": 2.0},
        {"plant.x": 2.0}, within=1e-5, method="rodas5p",
    )  # fmt: skip


def behind_a_gap(source, signal, width):
    """A play behind a signal of a block, and its integral."""
    gap = nlctl.block(nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=width, c_l=-width), "gap")
    integral = ct.nlsys(
        lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["v"], outputs=["y"], states=["y"],
        name="integral",
    )  # fmt: skip
    return ct.interconnect(
        [source, gap, integral],
        connections=[["gap.u", f"{source.name}.{signal}"], ["integral.v", "gap.v"]], inputs=[],
        outlist=["gap.v", "integral.y", *(f"{source.name}.{s}" for s in source.output_labels)],
        outputs=["v", "y", *(f"source_{s}" for s in source.output_labels)], name="loop",
    )  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("width", [0.1, 2.0])
def test_play_behind_a_reset(width):
    """The speed of a bouncing ball through a play that is carried, jumps, and stands."""
    loop = behind_a_gap(nlctl.block(Ball(), "ball"), "v", width)
    check(
        loop, np.linspace(0, 1.6, 9), ["v", "y", "source_h", "source_v"],
        {"ball.e": 0.8, "ball.h(0)": 1.0, "ball.g": 9.81, "gap.c_r": width, "gap.c_l": -width},
        h=1e-4, within=1e-6,
    )  # fmt: skip


def test_play_behind_a_comparison():
    """x rises with 1 until s = p and falls with 1/2: the play stands at p - c, then follows."""
    source = block(
        lambda t, x, u, p: [1.0, np.where(x[0] > p["p"], -0.5, 1.0)], {"p": 0.7}, ("s", "x"),
        name="source",
    )  # fmt: skip
    loop = behind_a_gap(source, "x", 0.1)
    made = nlctl.sensitivity_response(
        loop, [0, 0.5, 1.0, 1.5], of=["v", "y"], with_respect_to=["source.p", "gap.c_r"]
    )
    # from t = 0.1: t - 0.1; from 0.7: 0.6; from 1.1: 0.8 - (t - 0.7) / 2 = 1.5 p + 0.1 - t / 2
    assert np.allclose(made.values[0], [0, 0.4, 0.6, 0.4])
    assert np.allclose(made["v", "source.p"], [0, 0, 1, 1.5], rtol=0, atol=1e-8)
    assert np.allclose(made["v", "gap.c_r"], [0, -1, -1, 0], rtol=0, atol=1e-8)
    assert abs(end(made, "y", "source.p") - (0.4 + 1.5 * 0.4)) < 1e-7


@pytest.mark.parted
@pytest.mark.parametrize(
    ("actuator", "own"),
    [
        (nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.2, c_l=-0.2), {"actuator.c_r": 0.2}),
        (nlctl.Relay(on=0.6, off=-0.4), {"actuator.height": 1.0}),
        (nlctl.DeadZone(), {"actuator.b_r": nlctl.DeadZone().b_r}),
        (
            nlctl.actuators.PrandtlIshlinskii(),
            {"actuator.w[0]": nlctl.actuators.PrandtlIshlinskii().w[0]},
        ),
    ],
    ids=["backlash", "relay", "dead zone", "Prandtl-Ishlinskii"],
)
def test_actuators_behind_a_sampled_law(actuator, own):
    """What an actuator is given jumps at a clock: at times that no parameter moves."""
    source = block(
        lambda t, x, u, p: [p["w"] * x[1], -p["w"] * x[0]], {"w": 2.0}, ("s", "c"), "source"
    )
    law = ct.nlsys(
        None, lambda t, x, u, p: [p["K"] * u[0]], inputs=["s"], outputs=["u"], params={"K": 1.5},
        name="law",
    )  # fmt: skip
    plant = ct.nlsys(
        lambda t, x, u, p: [u[0] - p["a"] * x[0]], lambda t, x, u, p: x, inputs=["v"],
        outputs=["y"], states=["y"], params={"a": 0.5}, name="plant",
    )  # fmt: skip
    blocks = {"source": source, "law": nlctl.sampled(law, 0.07), "actuator": actuator}
    check(
        nlctl.interconnect({**blocks, "plant": plant}, outputs=["y"]), np.linspace(0, 3, 7), ["y"],
        own | {"source.c(0)": 1.0, "law.K": 1.5, "plant.a": 0.5, "source.w": 2.0},
        {"source.c": 1.0}, h=1e-4,
    )  # fmt: skip


@pytest.mark.parametrize("sampled", [False, True])
def test_play_that_the_start_drives(sampled):
    """u = t - k drives v(0) = 0 to c - k, and holds it there until u - c is above: t > 2 c."""
    source = ct.nlsys(
        None, lambda t, x, u, p: [t - p["k"]], inputs=0, outputs=["u"], params={"k": 1.0},
        dt=0.05 if sampled else 0, name="source",
    )  # fmt: skip
    loop = nlctl.interconnect(
        {
            "source": nlctl.sampled(source) if sampled else source,
            "gap": nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.3, c_l=-0.3),
            "plant": ct.nlsys(
                lambda t, x, u, p: [u[0]], lambda t, x, u, p: x, inputs=["v"], outputs=["y"],
                states=["x"], name="plant",
            ),
        }, outputs=["v", "y"],
    )  # fmt: skip
    t = np.array([0.0, 0.1, 0.3, 0.55])
    made = nlctl.sensitivity_response(loop, t, with_respect_to=["source.k", "gap.c_l", "gap.c_r"])
    assert made.success
    assert np.allclose(made["v", "source.k"], -1)
    assert np.allclose(made["y", "source.k"], -t)
    assert np.allclose(made["y", "gap.c_l"], -t)
    assert np.allclose(made["y", "gap.c_r"], 0)


@pytest.mark.parted
@pytest.mark.parametrize(
    "law",
    [
        lambda t, x, u, p: [-p["a"] * x[0] if x[0] < p["infinite"] else 0.0],
        lambda t, x, u, p: [-np.clip(p["a"] * x[0], -np.inf, p["infinite"])],
        lambda t, x, u, p: [-p["a"] * x[0] if np.isfinite(x[0]) else 1.0],
        lambda t, x, u, p: [-p["a"] * np.nan_to_num(x[0])],
        lambda t, x, u, p: [-p["a"] * x[0] + 0.0 * int(x[0] + 2)],
        lambda t, x, u, p: [-p["a"] * x[0] + 0.0 * round(x[0])],
    ],
    ids=["if", "clip", "isfinite", "nan_to_num", "int", "round"],
)
def test_bounds_that_are_infinite(law):
    """What compares with infinity is never met: x = exp(-a t)."""
    t = np.linspace(0, 2, 5)
    plant = block(law, {"a": 2.0, "infinite": np.inf})
    made = nlctl.sensitivity_response(plant, t, 0, [0.4], with_respect_to="plant.a")
    assert made.success
    assert np.allclose(made["x", "plant.a"], -0.4 * t * np.exp(-2 * t), rtol=0, atol=1e-8)


def test_python_rounds():
    """x' = 1 and y' = round(x / q): each step, at q (k + 1/2), moves with q."""
    for whole, shift in ((round, 0.5), (int, 1.0)):
        steps = block(
            lambda t, x, u, p, whole=whole: [1.0, whole(x[0] / p["q"])], {"q": 0.3}, ("x", "y")
        )
        made = nlctl.sensitivity_response(steps, [0, 1], 0, [1e-3, 0.0], with_respect_to="plant.q")
        places = 0.3 * (np.arange(4) + shift)
        assert made.success
        slope = -sum(k + shift for k, place in enumerate(places) if place < 1)
        assert abs(made["y", "plant.q"][-1] - slope) < 1e-7


def steered(t, x, u, p):
    """x' = -g k x: g is 1 in the first mode, n in the second, and the first does not ask for n."""
    rate = 0.0 * x[0]
    for part in range(p["mode"]):
        for _ in range(p["n"] - 1 if part else 1):
            rate = rate + p["k"]
    return [-rate * x[0]]


def test_an_integer_that_only_other_integers_ask_for_counts():
    """One compiled diagram, whose derivatives are kept: dx/dk = -g t exp(-g k t)."""
    values = {"mode": 1, "n": 3, "k": 0.5}
    loop = nlctl.compile(ct.nlsys(steered, None, inputs=0, states=1, name="s", params=values))
    times = np.linspace(0, 2, 5)
    for mode, n in ((1, 3), (2, 3), (2, 5), (1, 5), (2, 3)):
        run = nlctl.sensitivity_response(
            loop, times, 0, 1.0, params={"mode": mode, "n": n}, with_respect_to=["s.k"], rtol=1e-9
        )
        g = n if mode == 2 else 1
        exact = -g * times * np.exp(-g * 0.5 * times)
        np.testing.assert_allclose(run["x[0]", "s.k"], exact, rtol=0, atol=1e-7)
