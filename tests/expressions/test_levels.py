"""What is compared with a constant is undone from the outside, and squares have two levels."""

from __future__ import annotations

import math

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

METHODS = ["tsit5", "rodas5p", "taylor"]
TOP = math.sqrt(-math.log(1 - 1e-8))  # |z| up to which e^(-z^2) is above 1 - 1e-8
# conditions on a parabola x = t (3 - t), and between which values of x each holds, from 0 on
WINDOWS = {
    "square of a square": (
        lambda x: (x**2 - 0.04) ** 2 < 1e-10,
        (math.sqrt(0.04 - 1e-5), math.sqrt(0.04 + 1e-5)),
    ),
    "scaled, and with a constant": (
        lambda x: 2.0 - 3.0 * (x**2 - 0.04) ** 2 > 2.0 - 3e-10,
        (math.sqrt(0.04 - 1e-5), math.sqrt(0.04 + 1e-5)),
    ),
    "root of a square": (lambda x: np.sqrt((x - 0.3) ** 2) < 1e-5, (0.29999, 0.30001)),
    "fourth power": (lambda x: (x - 0.3) ** 4 < 1e-20, (0.29999, 0.30001)),
    "bell": (
        lambda x: 3.0 - 2.0 * np.exp(-(((x - 0.3) / 1e-5) ** 2)) < 2.0,
        (0.3 - 1e-5 * math.sqrt(math.log(2)), 0.3 + 1e-5 * math.sqrt(math.log(2))),
    ),
    "top of a bell": (
        lambda x: np.exp(-(((x - 0.3) / 0.1) ** 2)) > 1.0 - 1e-8,
        (0.3 - 0.1 * TOP, 0.3 + 0.1 * TOP),
    ),
    "tanh": (lambda x: np.tanh(50.0 * (x - 0.3)) ** 2 < 1e-6, (0.3 - 2e-5, 0.3 + 2e-5)),
}


def at_height(x):
    """Return when the parabola is first at a height."""
    return (3.0 - math.sqrt(9.0 - 4.0 * x)) / 2.0


def parabola(holds):
    """Return x = t (3 - t), with a rate of 1 / s while a condition holds."""
    return ct.nlsys(
        lambda t, x, u, params: [x[1], -2.0, np.where(holds(x[0]), 1.0, 0.0)],
        lambda t, x, u, params: [x[2]], inputs=0, outputs=1, states=3, name="parabola",
    )  # fmt: skip


@pytest.mark.parametrize(("rtol", "method", "name"), crossed([1e-6, 1e-9], [*METHODS], [*WINDOWS]))
def test_narrow_windows_are_passed_on_the_way_up_and_down(name, method, rtol):
    holds, (low, high) = WINDOWS[name]
    width = at_height(high) - at_height(low)
    run = nlctl.input_output_response(
        parabola(holds), [0, 3], 0, [0, 3.0, 0], method=method, rtol=rtol, atol=1e-2 * rtol
    )
    assert abs(run.outputs[0, -1] - 2.0 * width) < 1e-2 * width + rtol


@pytest.mark.parted
@pytest.mark.parametrize("name", WINDOWS)
def test_the_reference_sees_narrow_windows_as_well(name):
    holds, (low, high) = WINDOWS[name]
    width = at_height(high) - at_height(low)
    run = nlctl.input_output_response(
        parabola(holds), [0, 3], 0, [0, 3.0, 0], engine="python-control", rtol=1e-9, atol=1e-11
    )
    assert abs(run.outputs[0, -1] - 2.0 * width) < 1e-2 * width


def circle():
    """Return cos t and sin t."""
    return ct.nlsys(
        lambda t, x, u, params: [-x[1], x[0]], lambda t, x, u, params: x,
        inputs=0, outputs=2, states=2, name="circle",
    )  # fmt: skip


@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_a_square_rises_and_falls_where_it_does(engine):
    """cos^2 t falls through 1/4 at 60 degrees, and rises through it at 120."""

    def square(t, x, u, params):
        return x[0] ** 2 - 0.25

    square.direction = 1
    run = nlctl.input_output_response(
        circle(), [0, 2 * np.pi], 0, [1.0, 0.0], events={"square": square}, engine=engine
    )
    times = run.events["time"][run.events["which"] == "square"]
    assert np.allclose(times, np.pi * np.array([2, 5]) / 3, atol=1e-6)
    held = ct.nlsys(
        lambda t, x, u, params: [-x[1], x[0], np.where(x[0] ** 2 > 0.25, 1.0, 0.0)],
        None, inputs=0, states=3, name="held",
    )  # fmt: skip
    ways = nlctl.input_output_response(held, [0, 2 * np.pi], 0, [1.0, 0, 0], engine=engine).events
    assert list(ways["direction"]) == ["falling", "rising", "falling", "rising"]


@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_a_root_is_never_at_a_level_below_zero(engine):
    """Nothing switches where the square of the root is that of the level."""
    ramp = ct.nlsys(
        lambda t, x, u, params: [1.0, np.where(np.hypot(x[0], 0.5) > -1.0, 1.0, 0.0)
                                 + np.where(np.sqrt(x[0] + 0.1) > -0.7, 1.0, 0.0)],
        None, states=["x", "y"], inputs=0, name="ramp",
    )  # fmt: skip
    run = nlctl.input_output_response(ramp, [0, 3], 0, [0.0, 0.0], engine=engine)
    assert len(run.events) == 0
    assert run.states[1, -1] == pytest.approx(6.0)


@pytest.mark.parametrize("radius", [-0.5, 0.0])
def test_a_square_is_never_below_what_is_not_above_zero(radius):
    system = ct.nlsys(
        lambda t, x, u, params: [-x[1], x[0], np.where(x[0] ** 2 < params["r"], 1.0, 0.0)],
        lambda t, x, u, params: [x[2]], inputs=0, outputs=1, states=3, name="s",
        params={"r": radius},
    )  # fmt: skip
    run = nlctl.input_output_response(system, [0, 7], 0, [1.0, 0, 0])
    assert run.outputs[0, -1] == 0.0


FAR = {
    "peak": (lambda t, x: np.exp(-(((x[0] - 3) / 1e-4) ** 2)) - 0.5, 1e-4 * math.log(2) ** 0.5),
    "sum of peaks": (
        lambda t, x: (
            np.exp(-(((x[0] - 3) / 1e-4) ** 2)) + np.exp(-(((x[0] - 3) / 1e-4) ** 2) + t - x[0])
        ) - 1.0,
        1e-4 * math.log(2) ** 0.5,
    ),
    "product": (lambda t, x: (x[0] - 3 + 1e-5) * (x[0] - 3 - 1e-5), 1e-5),
    "hole": (lambda t, x: 0.5 - 1 / (1 + ((x[0] - 3) / 1e-5) ** 4), 1e-5),
    "peak of t": (lambda t, x: np.exp(-(((t - 3) / 1e-2) ** 2)) - 0.5, 1e-2 * math.log(2) ** 0.5),
}  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("engine", ["native", "python-control"])
@pytest.mark.parametrize("name", FAR)
def test_runs_end_at_narrow_event_functions(name, engine):
    function, before = FAR[name]
    ramp = ct.nlsys(
        lambda t, x, u, params: [1.0], lambda t, x, u, params: x,
        inputs=0, outputs=1, states=1, name="ramp",
    )  # fmt: skip
    run = nlctl.input_output_response(
        ramp, [0, 5], 0, [0.0], stop_when=lambda t, x, u, params: function(t, x), engine=engine
    )
    assert abs(run.time[-1] - (3.0 - before)) < 1e-6 * before + 1e-8


def test_a_step_that_ends_at_a_stop_is_shortened_there():
    """A bell in front of a memory, whose tail lies less than a hundredth of a step before the end.

    The shorter step ended at the stop again, and so did the next.
    """
    clock = ct.nlsys(
        lambda t, x, u, params: [1.0],
        lambda t, x, u, params: [2.0 * np.exp(-(((x[0] - 3.0) / 0.002) ** 2))],
        inputs=0, outputs=["e"], states=1, name="clock",
    )  # fmt: skip
    stop = nlctl.record(type("S", (nlctl.actuators.Stop,), {"inputs": ("e",), "outputs": ("q",)}))
    loop = nlctl.interconnect({"clock": clock, "stop": stop(r=0.5)}, outputs=["q"])
    run = nlctl.input_output_response(
        loop, [0, 2.99], 0, method="taylor", rtol=1e-6, atol=1e-8, max_steps=100
    )
    assert abs(run.outputs[0, -1] - 2.0 * np.exp(-25.0)) < 1e-8
