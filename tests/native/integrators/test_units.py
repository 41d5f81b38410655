"""Units are a matter of taste: in others by a power of two a run has the same numbers."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl
from nlctl import actuators

TOLERANCE = 1e-9  # in the unit
ACTUATORS = {
    "backlash": lambda unit: actuators.Backlash(m_r=1.0, m_l=1.0, c_r=0.4 * unit, c_l=-0.3 * unit),
    "stop": lambda unit: actuators.Stop(r=0.8 * unit),
    "relay": lambda unit: actuators.Relay(on=0.2 * unit, off=-0.2 * unit, height=unit),
    "saturation": lambda unit: actuators.Saturation(limit=unit),
    "rate limiter": lambda unit: actuators.RateLimiter(rise=unit, fall=-unit, K=50.0),
}
FUNCTIONS = {
    "dead zone": lambda t, x, u, p: np.sign(u[0]) * np.maximum(abs(u[0]) - 0.4 * p["unit"], 0.0),
    "sign": lambda t, x, u, p: p["unit"] * np.sign(u[0] - 0.2 * p["unit"]),
    "window": lambda t, x, u, p: u[0] + p["unit"] * (0.10 * p["unit"] < u[0] < 0.12 * p["unit"]),
    "a square": lambda t, x, u, p: u[0] * abs(u[0]) / p["unit"],
    "pulses": lambda t, x, u, p: u[0] * (t % 0.2 < 0.07),
}


def loop(name, unit):
    """A second-order plant under PI control behind an actuator, all signals in a unit."""
    if name in ACTUATORS:
        actuator = nlctl.block(ACTUATORS[name](unit), "actuator")
    else:
        actuator = ct.nlsys(
            None, FUNCTIONS[name], inputs=["u"], outputs=["v"], params={"unit": unit},
            name="actuator",
        )  # fmt: skip
    parts = {
        "reference": ct.nlsys(
            None, lambda t, x, u, p: p["unit"] * (np.sin(1.3 * t) + 0.3 * np.sin(3.1 * t)),
            inputs=0, outputs=["r"], params={"unit": unit},
        ),
        "law": ct.nlsys(
            lambda t, x, u, p: u[0] - u[1], lambda t, x, u, p: 3.0 * (u[0] - u[1]) + 0.5 * x[0],
            states=1, inputs=["r", "y"], outputs=["u"],
        ),
        "actuator": actuator,
        "plant": ct.nlsys(
            lambda t, x, u, p: [x[1], u[0] - x[0] - 0.4 * x[1]], lambda t, x, u, p: x[0],
            states=2, inputs=["v"], outputs=["y"],
        ),
    }  # fmt: skip
    return nlctl.interconnect(parts, outputs=["y", "u", "v"], name="loop")


def run(name, unit, method):
    """A run with the tolerance in the same unit."""
    return nlctl.input_output_response(
        loop(name, unit), np.linspace(0, 20, 201), method=method, rtol=1e-7,
        atol=TOLERANCE * unit, audit=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("method", "name"), crossed(["tsit5", "rodas5p", "taylor"], [*ACTUATORS, *FUNCTIONS])
)
def test_another_unit_is_another_exponent(name, method):
    """To the bit: nothing in the engine is compared with a number of its own."""
    # A mode has no unit, so that what the stiff method eliminates next to it rounds otherwise.
    most = 10 * TOLERANCE if (name, method) == ("relay", "rodas5p") else 0.0
    here = run(name, 1.0, method)
    for unit in (2.0**-40, 2.0**33):
        there = run(name, unit, method)
        assert np.abs(there.outputs / unit - here.outputs).max() <= most
        assert there.statistics.accepted == here.statistics.accepted
        assert list(there.events["which"]) == list(here.events["which"])
        assert np.abs(there.events["time"] - here.events["time"]).max() <= most


def test_a_signal_of_the_size_of_the_tolerance_is_named():
    """Its error may be as large as it: a static gain of 1e-11 is seen as 1.6e-11 by default."""
    plant = ct.ss(
        [[0, 1], [-4e4, -8]], [[0], [4e-7]], [[1, 0], [0, 0]], [[0], [1]], inputs=["u"],
        outputs=["y", "u"], name="stage",
    )  # fmt: skip
    times = np.linspace(0, 2, 201)
    coarse = nlctl.input_output_response(plant, times, np.sin(5 * times))
    assert "y is at most" in coarse.small_outputs()
    assert "atol = 1e-10: take a smaller atol" in repr(coarse)
    fine = nlctl.input_output_response(plant, times, np.sin(5 * times), atol=1e-18)
    assert fine.small_outputs() == ""
    assert np.abs(fine.outputs[0, 100:]).max() == pytest.approx(1e-11, rel=1e-2)
