"""A magnet levitates by a neural controller (NARMA-L2).

    pos'' = -9.8 - (12/3) pos' + (15/3) sign(i) i^2 / pos,    pos(0) = 0.5,  pos'(0) = 0

MathWorks' ``narmamaglev_v1``.  Equations, weights and sampling times were read from the model
file and from github.com/ismailbennani/zlscheck, ``arch/arch20`` (``models/nn``).
The controller looks every 0.01 s; a second hold of the model, of 0.001 s, changes nothing of what
is held already.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from inputs import numbers, pieces

import nlctl

WEIGHTS = numbers("nn.json")
LEAST_CURRENT, MOST_CURRENT = -1.0, 4.0  # A
LOOK = 0.01  # s
COUNT, PERIOD = 20, 2.0  # pieces of the reference, s
STATES = ("position_1", "current_1", "current_2")  # normalized, one and two samples ago


@nlctl.record
class Magnet:
    """The magnet above the coil."""

    inputs, outputs, states, feedthrough = ("current",), ("position",), ("position", "speed"), False
    initial = {"position": 0.5}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Weight, friction and the force of the coil, on 3 kg."""
        force = 15.0 * np.sign(u[0]) * u[0] ** 2 / x[0]
        return x[1], -9.8 - 12.0 / 3.0 * x[1] + force / 3.0

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """Where it is."""
        return (x[0],)


def normalized(value: Any, ends: np.ndarray) -> Any:
    """Return a number of a range as one of [-1, 1]."""
    return (value - ends[0]) * 2.0 / (ends[1] - ends[0]) - 1.0


def network(seen: Any, name: str) -> Any:
    """Return the output of a network of 9 neurons, without its scale."""
    hidden = WEIGHTS[f"{name}_hidden"] @ seen + WEIGHTS[f"{name}_bias"]
    return WEIGHTS[f"{name}_output"] @ np.tanh(hidden) + WEIGHTS[f"{name}_offset"][0]


def control(x: Any, u: Any) -> tuple[Any, Any]:
    """Return the current and the normalized position, from the states and (reference, position)."""
    reference, position = (normalized(value, WEIGHTS["position"]) for value in (u[0], u[1]))
    seen = np.array([position, x[0], x[1], x[2]])
    f = WEIGHTS["f_scale"][0] * network(seen, "f")
    g = np.prod(WEIGHTS["g_scales"]) * network(seen, "g")
    low, high = WEIGHTS["current"]
    current = ((reference - f) / g + 1.0) * (high - low) / 2.0 + low
    return np.clip(current, LEAST_CURRENT, MOST_CURRENT), position


@nlctl.record
class Controller:
    """NARMA-L2: what current makes the networks' next position the reference."""

    inputs, outputs, states = ("reference", "position"), ("current",), STATES
    feedthrough, discrete = True, True

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """What is remembered."""
        current, position = control(x, u)
        return position, normalized(current, WEIGHTS["current"]), x[1]

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The current."""
        return (control(x, u)[0],)


@nlctl.record
class Requirement:
    """What the requirement reads: |position - reference| - beta |reference|."""

    beta: float = nlctl.param(
        0.03, unit="1", meaning="part of the reference that is allowed", at_least=0
    )
    inputs, outputs, states, feedthrough = ("reference", "position"), ("excess",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The error less what is allowed of it."""
        return (np.abs(u[1] - u[0]) - p.beta * np.abs(u[0]),)


def levitation(beta: float = 0.03, **given: Any) -> Any:
    """Return the loop; the reference is a given block, or an input of the diagram."""
    parts = {
        "controller": nlctl.sampled(nlctl.block(Controller(), "controller", dt=LOOK)),
        "magnet": Magnet(), "requirement": Requirement(beta=beta),
    }  # fmt: skip
    outside = [] if given else ["reference"]
    return nlctl.interconnect(
        {**given, **parts}, inputs=outside, outputs=["position", "current", "excess"]
    )


def plant(beta: float = 0.03) -> Any:
    """Return the loop whose reference has twenty pieces."""
    return levitation(beta, reference=pieces("reference", COUNT, PERIOD, start=2.0))
