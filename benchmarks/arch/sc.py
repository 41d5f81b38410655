"""A steam condenser with a recurrent network as its controller.

Yaghoubi, Fainekos: Gray-box adversarial testing for control systems with machine learning
components (HSCC 2019).  Equations, tables and weights were read from the model file
``arch/arch20/shared/benchmarks/SteamCondenser/steamcondense_RNN_22_ZLS.slx`` in
github.com/ismailbennani/zlscheck.  ZlsCheck's own text of it (``models/sc/sc_d.zls``) adds one of
the six feedback terms of the network twice; the model file, which is followed here, does not.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from inputs import line, numbers, pieces

import nlctl

TABLES = numbers("sc.json")
VOLUME, HOLDUP = 3.0, 500.0  # m^3, kg
PRESSURE, TEMPERATURE, FLOW = 90.0, 80.0, 107.8880952381  # at the start: kPa, degrees C, kg/s
COOLING = 60.0  # degrees C of the cooling water
STEP, BEFORE, AFTER = 2.0, 90.0, 87.0  # s, kPa: when the set point falls, from what to what
LAG = 10.0  # 1/s of the network's memories
COUNT, PERIOD = 100, 0.35  # pieces of the steam flow, s

STEAM_TEMPERATURE = line(TABLES["pressure"], TABLES["temperature"])
LATENT_HEAT = line(TABLES["pressure"], TABLES["latent_heat"])


@nlctl.record
class Condenser:
    """Steam and cooling water."""

    inputs, outputs = ("steam", "demand"), ("pressure",)
    states, feedthrough = ("steam", "temperature", "flow", "pressure"), False
    initial = {"steam": PRESSURE, "temperature": TEMPERATURE, "flow": FLOW, "pressure": PRESSURE}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Balances, a valve with a lag of 1 s, and a sensor with one of 0.5 s."""
        steam, temperature, flow, pressure = x
        hot = STEAM_TEMPERATURE(steam)
        mean = (temperature - COOLING) / np.log((hot - COOLING) / (hot - temperature))
        heat = mean / (0.0872924756541668 / flow**0.8 + 0.00073786772008033)
        condensed = heat / LATENT_HEAT(steam)
        return (
            0.461526 / VOLUME * (u[0] - condensed) * hot,
            (heat / 4.2 + (COOLING - temperature) * flow) / HOLDUP,
            np.clip(u[1] + FLOW, 0.0, 200.0) - flow,
            2.0 * (steam - pressure),
        )

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """What the sensor says."""
        return (x[3],)


def mapped(value: Any, ends: np.ndarray, to: tuple[Any, Any]) -> Any:
    """Return a number of one range as one of another."""
    return (value - ends[0]) * (to[1] - to[0]) / (ends[1] - ends[0]) + to[0]


def hidden(x: Any, pressure: Any, t: Any) -> Any:
    """Return the three neurons, from the six memories and the error of the pressure."""
    error = pressure - np.where(t < STEP, BEFORE, AFTER)
    seen = mapped(error, TABLES["input_range"], (-1.0, 1.0))
    return np.tanh(TABLES["input"] * seen + TABLES["recurrent"] @ x + TABLES["bias"])


@nlctl.record
class Network:
    """Three neurons that see the error, and themselves through lags 1/(s + 10), once and twice."""

    inputs, outputs, states = ("pressure",), ("demand",), ("d1", "d2", "d3", "d4", "d5", "d6")
    feedthrough, vector = True, True

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """The memories."""
        return np.concatenate([hidden(x, u[0], t), x[:3]]) - LAG * x

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The flow of cooling water that is asked for, from where it started."""
        out = TABLES["output"] @ hidden(x, u[0], t) + TABLES["offset"][0]
        low, high = TABLES["output_range"]
        return (mapped(out, np.array([-1.0, 1.0]), (low, high)),)


def loop(**given: Any) -> Any:
    """Return the loop; the steam flow is a given block, or an input of the diagram."""
    outside = [] if given else ["steam"]
    parts = {"network": Network(), "condenser": Condenser()}
    return nlctl.interconnect({**given, **parts}, inputs=outside, outputs=["pressure"])


def plant() -> Any:
    """Return the loop whose steam flow has a hundred pieces."""
    return loop(steam=pieces("steam", COUNT, PERIOD, start=4.0))
