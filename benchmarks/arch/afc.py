"""The fuel of an engine, controlled for its ratio of air to fuel.

Simulink's ``AbstractFuelControl_M1`` (Jin, Deshmukh, Kapinski, Ueda, Butts: Powertrain control
verification benchmark, HSCC 2014).  Equations and tables were read from the model file
``arch/arch20/shared/benchmarks/powertrain/AbstractFuelControl_M1.slx`` in
github.com/ismailbennani/zlscheck.  ZlsCheck's own text of it (``models/afc``) reads the time
constant of the puddle at rad/s in a table of rpm, and delays by a time instead of by a transport;
the model file is followed here.  Its controller is off for the first 0.001 s, which changes
nothing.

The exhaust is the one part that is not exact: its ratio arrives when gas that moves with 1/delay
has gone a unit of way, with a delay that depends on the state.  Here it is read every 0.01 s,
with the controller, and is straight in between (`Exhaust`); Simulink interpolates between its
steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from inputs import numbers, pieces, surface

import nlctl

TABLES = numbers("afc.json")
LOOK = 0.01  # s, of the controller
STORED = 60  # looks that the exhaust remembers
COUNT, PERIOD = 20, 2.5  # pieces of the throttle, s
RATIO, POWER_RATIO = 14.7, 12.5
CLOSED = 8.8  # degrees of the throttle without input

KAPPA = surface(TABLES["wetting_rpm"], TABLES["wetting_charge"], TABLES["kappa"])
PUDDLE = surface(TABLES["wetting_rpm"], TABLES["wetting_charge"], TABLES["tau"])
DELAY = surface(TABLES["delay_rpm"], TABLES["delay_charge"], TABLES["delay"])


def pumped(pressure: Any, speed: Any) -> Any:
    """Return the polynomial of what the cylinders pump, by pressure (bar) and speed (rad/s)."""
    by_speed = 0.08979 * pressure - 0.0337 * pressure**2 + 0.0001 * pressure * speed
    return -0.366 + speed * by_speed


def through(angle: Any, pressure: Any) -> Any:
    """Return the flow of air through the throttle (g/s), by angle and pressure behind it."""
    opening = 2.821 - 0.05231 * angle + 0.10299 * angle**2 - 0.00063 * angle**3
    ratio = np.minimum(pressure, 1.0 / pressure)
    subsonic = 2.0 * np.sqrt(np.maximum(ratio - ratio**2, 0.0))
    return opening * np.where(ratio >= 0.5, subsonic, 1.0) * np.sign(1.0 - pressure)


@nlctl.record
class Intake:
    """Throttle with a lag of 0.1 s, and manifold."""

    inputs, outputs = ("throttle", "engine"), ("angle", "flow", "air", "speed")
    states, feedthrough = ("throttle", "pressure"), True
    initial = {"pressure": 0.982}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Lag, and balance of the air."""
        _, flow, air, _ = intake(x, u)
        return 10.0 * (u[0] - x[0]), 0.41328 * (flow - air)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """Angle, air that comes in and that goes to the cylinders, and the speed in rad/s."""
        return intake(x, u)


def intake(x: Any, u: Any) -> Any:
    """Return the outputs of `Intake`."""
    angle = np.clip(x[0] + CLOSED, 0.0, 90.0)
    speed = np.clip(u[1], 900.0, 1100.0) * np.pi / 30.0
    return angle, through(angle, x[1]), 0.9 * pumped(x[1], speed), speed


@nlctl.record
class Cylinder:
    """Fuel that wets the wall, and the ratio of air to fuel; `way` is how far the gas has gone."""

    inputs, outputs = ("fuel", "air", "speed"), ("ratio", "way", "pace")
    states, feedthrough = ("puddle", "way"), True
    initial = {"puddle": 0.0112}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Balance of the puddle."""
        kappa, evaporated, pace = wetting(x, u)
        return u[0] * (1.0 - kappa) - evaporated, pace

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The ratio in the cylinder."""
        kappa, evaporated, pace = wetting(x, u)
        return u[1] / (kappa * u[0] + evaporated), x[1], pace


def wetting(x: Any, u: Any) -> Any:
    """Return what part of the fuel stays in the air, what evaporates, and the exhaust's pace."""
    _, air, speed = u
    rpm, charge = speed * 30.0 / np.pi, np.pi * air / speed
    kappa, tau = KAPPA([[rpm, charge]])[0], PUDDLE([[rpm, charge]])[0]
    return kappa, x[0] / tau, 1.0 / DELAY([[rpm, charge]])[0]


def read(ways: Any, ratios: Any, way: Any) -> Any:
    """Return what was sent at a way: straight between what is stored, the newest last."""
    parts = np.clip((way - ways[:-1]) / np.diff(ways), 0.0, 1.0)
    after_first = np.where(way >= ways[0], 0.0, np.nan)  # never a guess
    return ratios[0] + np.sum(parts * np.diff(ratios)) + after_first


@nlctl.record
class Exhaust:
    """Gas in transit, one unit long: what arrives at a look, and how it changes until the next."""

    inputs, outputs = ("ratio", "way", "pace"), ("arrives", "changes")
    states = (*(f"way{k}" for k in range(STORED)), *(f"ratio{k}" for k in range(STORED)))
    feedthrough, discrete, vector = True, True, True

    @property
    def initial(self) -> dict[str, float]:
        """As if the ratio had been right for long."""
        ways = {f"way{k}": 0.05 * (k - STORED) for k in range(STORED)}
        return ways | {f"ratio{k}": RATIO for k in range(STORED)}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Forget the oldest, store the newest."""
        return np.concatenate([x[1:STORED], u[1:2], x[STORED + 1 :], u[0:1]])

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """What left the cylinder one unit before now, and before the next look."""
        ways = np.concatenate([x[:STORED], u[1:2]])
        ratios = np.concatenate([x[STORED:], u[0:1]])
        now = read(ways, ratios, u[1] - 1.0)
        return now, (read(ways, ratios, u[1] + LOOK * u[2] - 1.0) - now) / LOOK


@nlctl.record
class Sensor:
    """Mixing with a lag of 0.1 s, and a sensor with one of 0.02 s; `since` is since a look."""

    inputs, outputs, states = ("arrives", "changes", "since"), ("measured",), ("mixed", "measured")
    feedthrough = False
    initial = {"mixed": RATIO, "measured": RATIO}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Both lags."""
        return 10.0 * (u[0] + u[1] * u[2] - x[0]), 50.0 * (x[0] - x[1])

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """What is measured."""
        return (x[1],)


@nlctl.record
class Since:
    """The time since the last look, as the difference of now and then."""

    inputs, outputs, states, feedthrough = ("then",), ("since",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The difference."""
        return (t - u[0],)


@nlctl.record
class Then:
    """The time, to be held at every look."""

    inputs, outputs, states, feedthrough = (), ("then",), (), False

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The time."""
        return (t,)


def decided(x: Any, u: Any) -> dict[str, Any]:
    """Return what the controller decides at a look, in the order of its program."""
    seconds, normal, power, failed, pressure, integral = x
    angle, flow, speed, measured = u
    seconds = seconds + 0.01
    normal = np.maximum(np.where(seconds >= 10.0, 1.0, 0.0), normal)
    power = np.where(angle >= np.where(power > 0.5, 50.0, 70.0), 1.0, 0.0)
    failed = np.maximum(np.where(measured <= -1.0, 1.0, 0.0), failed)
    feedforward = (failed > 0.5) | (normal < 0.5) | (power > 0.5)
    ratio = np.where((normal > 0.5) & (power > 0.5), POWER_RATIO, RATIO)
    air = pumped(pressure, speed)
    error = measured - ratio
    integral = np.where(feedforward, integral, integral + 0.01 * 0.14 * error)
    trim = np.where(feedforward, 1.0, np.maximum(1.0 + 0.04 * error + integral, 0.0))
    pressure = pressure + 0.01 * 0.41328 * (flow - air)
    return {
        "states": (seconds, normal, power, failed, pressure, integral),
        "outputs": (
            np.clip(air / ratio * trim, 0.13, 1.66),
            ratio,
            np.where(feedforward, 1.0, 0.0),
        ),
    }


@nlctl.record
class Controller:
    """Feedforward by an estimate of the air, and a PI in normal mode."""

    inputs, outputs = ("angle", "flow", "speed", "measured"), ("fuel", "wanted", "mode")
    states = ("seconds", "normal", "power", "failed", "pressure", "integral")
    feedthrough, discrete = True, True
    initial = {"pressure": 0.982}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """The states after a look."""
        return decided(x, u)["states"]

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """Fuel, wanted ratio, and whether there is no feedback."""
        return decided(x, u)["outputs"]


@nlctl.record
class Error:
    """mu, relative to the wanted ratio; before 1 s it is 0, as in the model."""

    inputs, outputs, states, feedthrough = ("measured", "wanted"), ("mu",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The error, once it is measured."""
        return (np.where(t >= 1.0, u[0] / np.maximum(u[1], 1.0) - 1.0, 0.0),)


def engine(**given: Any) -> Any:
    """Return the loop; throttle and engine are given blocks, or inputs of the diagram."""
    outside = [name for name in ("throttle", "engine") if name not in given]

    def looked(record: Any, name: str, offset: float) -> Any:
        is_discrete = getattr(record, "discrete", False)
        system = nlctl.block(record, name, dt=LOOK if is_discrete else None)
        return nlctl.sampled(system, LOOK, offset=offset)

    parts = {
        "intake": Intake(), "controller": looked(Controller(), "controller", LOOK),
        "cylinder": Cylinder(), "exhaust": looked(Exhaust(), "exhaust", 0.0),
        "then": looked(Then(), "then", 0.0), "since": Since(),
        "sensor": Sensor(), "error": Error(),
    }  # fmt: skip
    return nlctl.interconnect(
        {**given, **parts}, inputs=outside, outputs=["mu", "mode", "throttle"]
    )


START = {
    "controller.fuel_held": 0.1726,
    "controller.wanted_held": RATIO,
    "controller.mode_held": 1.0,
}


def plant() -> Any:
    """Return the loop whose throttle has twenty pieces, at one engine speed."""
    return engine(
        throttle=pieces("throttle", COUNT, PERIOD), engine=pieces("engine", 1, 50.0, 1000.0)
    )
