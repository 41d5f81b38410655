"""Robots of six joints, and parameters that classes, functions and dicts take by name."""

import functools
import math
from collections import OrderedDict
from typing import NamedTuple

import numpy as np

from engineers.entry import engineered

LINKS = [
    {"axis": np.array(axis), "r": np.array(r), "m": m, "inertia": np.diag(inertia)}
    for axis, r, m, inertia in [
        ((0.0, 0.0, 1.0), (0.0, 0.0, 0.1), 2.0, (0.02, 0.02, 0.01)),
        ((0.0, 1.0, 0.0), (0.2, 0.0, 0.0), 1.5, (0.005, 0.02, 0.02)),
        ((0.0, 1.0, 0.0), (0.2, 0.0, 0.0), 1.0, (0.004, 0.01, 0.01)),
        ((1.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.4, (0.001, 0.002, 0.002)),
        ((0.0, 1.0, 0.0), (0.05, 0.0, 0.0), 0.3, (0.001, 0.001, 0.001)),
        ((1.0, 0.0, 0.0), (0.02, 0.0, 0.0), 0.1, (0.0005, 0.0005, 0.0005)),
    ]
]


def turned(axis, angle):
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def mass_and_weight(q):
    n, tool, place = len(q), np.eye(3), np.zeros(3)
    axes, places, mass, weight = [], [], np.zeros((n, n)), np.zeros(n)
    for i, link in enumerate(LINKS):
        axes.append(tool @ link["axis"])
        places.append(place)
        tool = tool @ turned(link["axis"], q[i])
        centre = place + tool @ link["r"]
        moves, turns = np.zeros((3, n)), np.zeros((3, n))
        for j in range(i + 1):
            moves[:, j] = np.cross(axes[j], centre - places[j])
            turns[:, j] = axes[j]
        mass += link["m"] * moves.T @ moves + turns.T @ tool @ link["inertia"] @ tool.T @ turns
        weight += link["m"] * 9.81 * moves[2]
        place = place + tool @ (2 * link["r"])
    return mass, weight


@engineered(12, 6)
def six_joints(t, x, u, params):
    q, rate = np.split(x, 2)
    mass, weight = mass_and_weight(q)
    return np.concatenate([rate, np.linalg.solve(mass + 0.01 * np.eye(6), u - weight - rate)])


def make_law(gains):
    def law(x, r=0.0):
        return float(-law.K @ (x - [r, 0.0]))

    law.K = np.array(gains)
    return law


LAW = make_law([3.0, 1.0])


@engineered(2)
def gains_of_a_function(t, x, u, params):
    return [x[1], LAW(x, r=u[0]) - 0.1 * LAW.K[0] * x[1]]


class Motor:
    def __init__(self, m, k):
        self.m, self.k = m, k

    @functools.cache  # noqa: B019
    def matrix(self, gain=1.0):
        return np.array([[0.0, 1.0], [-gain * self.k / self.m, -0.1]])


MOTOR = Motor(2.0, 3.0)


@engineered(2)
def cached_method(t, x, u, params):
    return MOTOR.matrix(gain=2.0) @ x + np.append(0.0, u)


class Plant:
    m, k = 1.0, 2.0

    def __init__(self, **given):
        for name, value in given.items():
            setattr(self, name, value)

    def acceleration(self, q, force):
        return (force - self.k * q) / self.m


class Settings:
    def __init__(self, **given):
        self.__dict__.update(given)


@engineered(2, k=3.0, c=0.2)
def attributes_by_name(t, x, u, params):
    plant, settings = Plant(**params), Settings(**params)
    return [x[1], plant.acceleration(x[0], u[0]) - settings.c * x[1]]


class Rate(NamedTuple):
    k: float
    energy: float

    def __call__(self, temperature):
        return self.k * np.exp(-self.energy / temperature)


RATES = OrderedDict(ab=Rate(3.0, 2.0), bc=Rate(1.0, 4.0))


@engineered(2)
def rates_in_an_ordered_dict(t, x, u, params):
    ab, bc = (rate(1.0 + x[0] ** 2) for rate in RATES.values())
    return [-ab * x[0] + u[0], ab * x[0] - bc * x[1]]


@engineered(4)
def written_into_chosen_elements(t, x, u, params):
    ends = x[[0, 3]]
    ends[0] = -u[0]
    return np.concatenate([ends, -x[[1, 2]]])
