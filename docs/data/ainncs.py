"""Four neural controllers that sample (ARCH competition, category AINNCS), as diagrams.

Plants, boxes of initial states and specifications are those of the repository
verivital/ARCH-COMP2020 (the pendulum's smaller box is of a later year); README.md next to this file
says where the weights are from.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import control as ct
import numpy as np

import nlctl

WEIGHTS = np.load(Path(__file__).with_name("ainncs.npz"))


def network(name, given, made):
    """The network of a benchmark, between what it is given and what it makes."""
    count = sum(key.startswith(f"{name}.W") for key in WEIGHTS)
    layers = [(WEIGHTS[f"{name}.W{k}"], WEIGHTS[f"{name}.b{k}"]) for k in range(count)]

    def output(t, x, u, params):
        z = given(u)
        for W, b in layers[:-1]:
            z = np.maximum(W @ z + b, 0)
        return made(layers[-1][0] @ z + layers[-1][1])

    return output


def loop(name, rates, made, period, given=lambda x: x, inputs=("u",), states=4):
    """The plant with its network, which samples."""
    x = [f"x{k + 1}" for k in range(states)]
    plant = ct.nlsys(rates, None, inputs=inputs, outputs=x, states=x, name="plant")
    law = network(name, given, made)
    law = ct.nlsys(None, law, inputs=x, outputs=inputs, dt=period, name="network")
    return nlctl.interconnect([plant, nlctl.sampled(law, period)], outputs=x, name=name)


def cars(t, x, u, p):
    lead, ego = -4 - 2 * x[2] - 1e-4 * x[1] ** 2, 2 * u[0] - 2 * x[5] - 1e-4 * x[4] ** 2
    return np.array([x[1], x[2], lead, x[4], x[5], ego])


def seen(x):  # set speed, time gap, own speed, distance and its rate
    return np.array([30.0, 1.4, x[4], x[0] - x[3], x[1] - x[4]])


def tora(t, x, u, p):
    return np.array([x[1], -x[0] + 0.1 * np.sin(x[2]), x[3], u[0]])


def unicycle(t, x, u, p):
    return np.array([x[3] * np.cos(x[2]), x[3] * np.sin(x[2]), u[1], u[0]])


def pendulum(t, x, u, p):
    return np.array([x[1], 2 * np.sin(x[0]) + 8 * u[0]])


@dataclass(frozen=True)
class Case:
    """A loop, its box of initial states, and what must stay positive from one time to another."""

    loop: Any
    box: tuple[tuple[float, ...], tuple[float, ...]]
    begin: float
    end: float
    says: str
    margin: Callable[[np.ndarray], np.ndarray]

    def runs(self, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times, and margins (runs, times) from starts (runs, states)."""
        t, x = np.linspace(0, self.end, 401), [f"x{k + 1}" for k in range(x0.shape[1])]
        start = {f"plant.{name}": x0[:, k] for k, name in enumerate(x)}
        found = nlctl.ensemble_response(self.loop, t, 0, start, keep=x)
        return t, self.margin(np.array([found.signals[name] for name in x]))


GOAL = np.array([0.6, 0.2, 0.06, 0.3])
CASES = {
    "cruise control": Case(
        loop("acc", cars, lambda y: y, 0.1, seen, states=6),
        ((90, 32, 0, 10, 30, 0), (110, 32.2, 0, 11, 30.2, 0)), 0.0, 5.0,
        "gap left (m)", lambda x: x[0] - x[3] - 10 - 1.4 * x[4],
    ),
    "TORA": Case(
        loop("tora", tora, lambda y: np.maximum(y, 0) - 10, 1.0),
        ((0.6, -0.7, -0.4, 0.5), (0.7, -0.6, -0.3, 0.6)), 0.0, 20.0,
        "2 - largest |x|", lambda x: 2 - np.abs(x).max(axis=0),
    ),
    "unicycle": Case(
        loop("unicycle", unicycle, lambda y: np.maximum(y, 0) - 20, 0.2, inputs=("u1", "u2")),
        ((9.5, -4.5, 2.1, 1.5), (9.55, -4.45, 2.11, 1.51)), 10.0, 10.0,
        "1 - largest |x| / goal", lambda x: 1 - np.abs(x / GOAL[:, None, None]).max(axis=0),
    ),
    "pendulum": Case(
        loop("pendulum", pendulum, lambda y: y, 0.05, states=2),
        ((1.0, 0.0), (1.175, 0.2)), 0.5, 1.0,
        "1 - angle (rad)", lambda x: 1 - x[0],
    ),
}  # fmt: skip
