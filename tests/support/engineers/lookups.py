"""Searches, members of enumerations, iterations until a tolerance, distances."""

import enum

import numpy as np
from scipy.integrate import simpson, trapezoid
from scipy.spatial.distance import cdist, euclidean
from scipy.spatial.transform import Rotation

from engineers.entry import engineered


@engineered(2, 1)
def newton_while(t, x, u, params):
    z, it = 1.0, 0
    while abs(z**3 + z - x[0]) > 1e-10 and it < 30:
        z -= (z**3 + z - x[0]) / (3 * z**2 + 1)
        it += 1
    return [u[0] - z, x[0] - x[1]]


class Axis(enum.Enum):
    X = "x"
    Y = "y"
    Z = "z"

    @property
    def unit(self):
        return {"x": np.array([1.0, 0, 0]), "y": np.array([0, 1.0, 0]), "z": np.array([0, 0, 1.0])}[
            self.value
        ]


@engineered(3, 1)
def enum_with_property(t, x, u, params):
    axis = Axis(params.get("axis", "z"))
    return np.cross(axis.unit, x) - 0.1 * x + u[0] * Axis.X.unit


@engineered(4, 1)
def argwhere_nonzero_sum(t, x, u, params):
    positive = np.flatnonzero(x > 0)
    s = sum(x[i] for i in positive)
    return -x + 0.1 * s + u[0]


@engineered(3, 1)
def list_index_of_max(t, x, u, params):
    xs = list(x)
    i = xs.index(max(xs))
    dx = [-v for v in xs]
    dx[i] += u[0]
    return dx


@engineered(2, 1)
def cdist_forces(t, x, u, params):
    pts = np.array([[0.0, 0.0], [1.0, 2.0]])
    d = cdist(x[None, :], pts)[0]
    return -x / (1 + d.min()) + u[0]


@engineered(2, 1)
def euclid(t, x, u, params):
    d = euclidean(x, [1.0, 1.0])
    return -x * d + u[0]


@engineered(3, 1)
def rotation_degrees_rotvec(t, x, u, params):
    r = Rotation.from_euler("zyx", [10, 20, 30], degrees=True) * Rotation.from_rotvec(x)
    return r.as_rotvec() * -0.1 + u[0]


@engineered(2, 1)
def solve_ivp_inner(t, x, u, params):
    s = np.linspace(0, 1, 5)
    return [trapezoid(np.sin(x[0] * s), s) - x[0] + u[0], simpson(np.cos(x[1] * s), x=s) - x[1]]


DEBUG = False


@engineered(2, 1)
def debug_print(t, x, u, params):
    if DEBUG:
        print(x)
    return [x[1], -x[0] + u[0]]
