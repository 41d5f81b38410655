"""Jumps at times that move, and once more where they leave delays: next to differences of runs."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import Ball

import nlctl

T = np.linspace(0, 3, 25)[1:] + 0.0137  # nothing jumps at these


def plant_of(update, output, inputs, outputs, states, params):
    return ct.nlsys(
        update, output, inputs=inputs, outputs=outputs, states=states, params=params, name="plant"
    )


def wire(delay, sent=("q",), left=("y",), name="wire"):
    return nlctl.block(nlctl.TransportDelay(inputs=sent, outputs=left, delay=delay), name)


def switch():
    """A rising x switches q, and z follows q as it was 0.3 s ago, and falls back."""
    plant = plant_of(
        lambda t, x, u, p: [p["a"], p["k"] * u[0] - x[1] * x[0]],
        lambda t, x, u, p: [np.where(x[0] > p["p"], 1.0 + x[1], -0.5)],
        ["y"], ["q"], ["x", "z"], {"a": 1.0, "k": 2.0, "p": 0.5},
    )  # fmt: skip
    return nlctl.interconnect({"wire": wire(0.3), "plant": plant}, outputs=["q"])


def relay_oscillation():
    """A relay's output heats a plant with a dead time: a limit cycle with many switches."""
    plant = plant_of(
        lambda t, x, u, p: [p["k"] * u[0] - p["a"] * x[0]], lambda t, x, u, p: [-x[0]],
        ["y"], ["u"], ["x"], {"a": 1.0, "k": 2.0},
    )  # fmt: skip
    relay = nlctl.block(nlctl.Relay(on=0.2, off=-0.2), "relay", inputs=["u"], outputs=["q"])
    return nlctl.interconnect({"wire": wire(0.17), "plant": plant, "relay": relay}, outputs=["u"])


def two_in_a_row():
    """What leaves one delay goes to the next at once, times a gain, and back into the plant."""
    plant = plant_of(
        lambda t, x, u, p: [1.0 - p["k"] * u[0] * x[0], u[1] - x[1]],
        lambda t, x, u, p: [np.where(x[0] > p["p"], 1.0, 0.2) * (1 + x[1])],
        ["far", "near"], ["q"], ["x", "z"], {"k": 1.5, "p": 0.4},
    )  # fmt: skip
    between = ct.nlsys(
        None, lambda t, x, u, p: [p["g"] * u[0] ** 2], inputs=["near"], outputs=["r"],
        params={"g": 0.8}, name="between",
    )  # fmt: skip
    parts = {"wire": wire(0.2, left=("near",)), "plant": plant, "between": between}
    return nlctl.interconnect(
        parts | {"second": wire(0.33, ("r",), ("far",))}, outputs=["q"]
    )  # fmt: skip


def two_at_once():
    """One block delays two signals, both of which jump at once."""
    plant = plant_of(
        lambda t, x, u, p: [p["a"] - 0.3 * u[0] * u[1], u[0] - u[1] * x[1]],
        lambda t, x, u, p: [
            np.where(x[0] > 0.5, 1.0, 0.0) + x[1], np.where(x[0] > 0.5, p["h"], 1.0)
        ],
        ["y1", "y2"], ["q1", "q2"], ["x", "z"], {"a": 1.05, "h": 2.0},
    )  # fmt: skip
    both = wire(0.25, ("q1", "q2"), ("y1", "y2"))
    return nlctl.interconnect({"wire": both, "plant": plant}, outputs=["q1"])


def ball():
    """A speed that reverses at each bounce is seen late."""
    seen = plant_of(
        lambda t, x, u, p: [p["k"] * (u[0] - x[0])], lambda t, x, u, p: x,
        ["y"], ["z"], ["z"], {"k": 2.0},
    )  # fmt: skip
    parts = {"ball": Ball(), "wire": wire(0.21, ("v",)), "plant": seen}
    return nlctl.interconnect(parts, outputs=["z"])


def step_in_time():
    """A step at t = p, of height h, behind a delay, into a nonlinear plant with backlash."""
    source = ct.nlsys(
        None, lambda t, x, u, p: [np.where(t > p["p"], p["h"], 0.0) + np.sin(3 * t)], inputs=0,
        outputs=["q"], params={"p": 0.7, "h": 1.5}, name="source",
    )  # fmt: skip
    plant = plant_of(
        lambda t, x, u, p: [x[1], u[0] - p["k"] * np.sin(x[0]) - x[1] - u[1]],
        lambda t, x, u, p: [x[0]], ["y", "b"], ["u"], ["x", "v"], {"k": 1.0},
    )  # fmt: skip
    gap = nlctl.block(nlctl.Backlash(c_r=0.05, c_l=-0.05), "gap", inputs=["u"], outputs=["b"])
    return nlctl.interconnect(
        {"source": source, "wire": wire(0.4), "plant": plant, "gap": gap}, outputs=["u"]
    )


CASES = {
    "switch": (
        switch,
        ["plant.z"],
        {"plant.p": 0.5, "plant.a": 1.0, "plant.x(0)": 0.1, "wire.delay": 0.3},
    ),
    "relay": (
        relay_oscillation,
        ["plant.x"],
        {"plant.k": 2.0, "relay.on": 0.2, "plant.a": 1.0, "wire.delay": 0.17},
    ),
    "row": (
        two_in_a_row,
        ["plant.x", "plant.z"],
        {"plant.p": 0.4, "between.g": 0.8, "wire.delay": 0.2, "second.delay": 0.33},
    ),
    "at once": (
        two_at_once,
        ["plant.x", "plant.z"],
        {"plant.a": 1.05, "plant.h": 2.0, "wire.delay": 0.25},
    ),
    "ball": (
        ball,
        ["plant.z"],
        {"ball.g": 9.81, "ball.e": 0.8, "plant.k": 2.0, "wire.delay": 0.21},
    ),
    "step": (
        step_in_time,
        ["plant.x"],
        {"source.p": 0.7, "source.h": 1.5, "gap.c_r": 0.05, "wire.delay": 0.4},
    ),
}


def differences(loop, of, start, name, value):
    """Return Richardson's differences of runs by one quantity."""
    h = 2e-3 * (abs(value) or 1.0)

    def run(v):
        x0, params = (start | {name[:-3]: v}, {}) if name.endswith("(0)") else (start, {name: v})
        states = nlctl.input_output_response(
            loop, [0, *T], 0, x0, params=params, rtol=1e-12, atol=1e-14
        ).states
        return np.array([states[signal][1:] for signal in of])

    def central(h):
        return (run(value + h) - run(value - h)) / (2 * h)

    return (64 * central(h / 4) - 20 * central(h / 2) + central(h)) / 45


def test_closed_form():
    """q = (t + x(0) > p) and z' = q(t - 0.3): z = t - 0.3 - p + x(0) behind that."""
    plant = plant_of(
        lambda t, x, u, p: [1.0, u[0]], lambda t, x, u, p: [np.where(x[0] > p["p"], 1.0, 0.0)],
        ["y"], ["q"], ["x", "z"], {"p": 0.5},
    )  # fmt: skip
    loop = nlctl.interconnect({"wire": wire(0.3), "plant": plant}, outputs=["q"])
    made = nlctl.sensitivity_response(
        loop, [0, 0.6, 0.79, 0.81, 2], of=["plant.z"], with_respect_to=["plant.p", "plant.x(0)"]
    )
    assert np.allclose(made["plant.z", "plant.p"], [0, 0, 0, -1, -1], rtol=0, atol=1e-9)
    assert np.allclose(made["plant.z", "plant.x(0)"], [0, 0, 0, 1, 1], rtol=0, atol=1e-9)


def test_a_dead_time():
    """x' = -k x(t - d) from x = 1, and 0 before: by d the method of steps, and a fit finds both."""
    plant = plant_of(
        lambda t, x, u, p: [-p["k"] * u[0]], lambda t, x, u, p: x, ["y"], ["x"], ["x"], {"k": 1.3}
    )
    loop = nlctl.compile(
        nlctl.interconnect({"wire": wire(0.5, ("x",)), "plant": plant}, outputs=["x"])
    )
    t, k, d, start = np.array([0, 0.4, 0.7, 0.9, 1.1, 1.4]), 1.3, 0.5, {"plant.x": 1.0}
    made = nlctl.sensitivity_response(loop, t, 0, start, with_respect_to=["wire.delay"])
    expected = np.where(t < d, 0, np.where(t < 2 * d, k, k - 2 * k**2 * (t - 2 * d)))
    assert np.allclose(made["x", "wire.delay"], expected, rtol=0, atol=1e-9)
    found = nlctl.fit(loop, t, {"x": made.values[0]}, {"wire.delay": 0.4, "plant.k": 1.0}, 0, start)
    assert np.allclose(found.values, [d, k], rtol=0, atol=1e-7)


def test_signals_that_are_not_0_before():
    """z' = q(t - d), q = cos t and 2 before: z = 2 d + sin(t - d), by d and by `before`."""
    source = ct.nlsys(
        None, lambda t, x, u, p: [np.cos(t)], inputs=0, outputs=["q"], name="source"
    )  # fmt: skip
    plant = plant_of(lambda t, x, u, p: [u[0]], lambda t, x, u, p: x, ["y"], ["z"], ["z"], {})
    delay = nlctl.TransportDelay(inputs=("q",), outputs=("y",), delay=0.4, before=2.0)
    loop = nlctl.interconnect({"source": source, "wire": delay, "plant": plant}, outputs=["z"])
    made = nlctl.sensitivity_response(
        loop, [0, *T], with_respect_to=["wire.delay", "wire.before"]
    )  # fmt: skip
    assert np.allclose(made["z", "wire.delay"][5:], 2 - np.cos(T[4:] - 0.4), rtol=0, atol=1e-8)
    assert np.allclose(made["z", "wire.before"][5:], 0.4, rtol=0, atol=1e-9)


@pytest.mark.parted
@pytest.mark.parametrize("case", CASES)
def test_against_differences(case):
    """Every derivative, to 1e-6 of the largest."""
    loop_of, of, by = CASES[case]
    loop = nlctl.compile(loop_of())
    start = {name[:-3]: value for name, value in by.items() if name.endswith("(0)")}
    made = nlctl.sensitivity_response(
        loop, [0, *T], 0, start, with_respect_to=list(by), of=of, rtol=1e-10, atol=1e-12
    )
    assert made.success, made.message
    for name, value in by.items():
        expected = differences(loop, of, start, name, value)
        for signal, row in zip(of, expected, strict=True):
            apart = np.abs(made[signal, name][1:] - row).max()
            assert apart < 1e-6 * np.abs(row).max(), (signal, name)
