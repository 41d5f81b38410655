"""Functions of packages: chosen by type, with messages, texts, named tuples and large matrices."""

import enum
import functools
import logging
import math
import warnings
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import linalg

from engineers.entry import engineered

log = logging.getLogger("engineers.packages")
rng = np.random.default_rng(3)
WIDE = rng.normal(size=(4, 40)) / 3
DEEP = rng.normal(size=(40, 40)) / 7


@functools.singledispatch
def friction(model, w):
    raise TypeError(f"no friction model for {type(model).__name__}")


@dataclass(frozen=True)
class Viscous:
    b: float


@dataclass(frozen=True)
class Stribeck:
    fc: float
    fs: float
    vs: float


@friction.register
def _(model: Viscous, w):
    return model.b * w


@friction.register
def _(model: Stribeck, w):
    return (model.fc + (model.fs - model.fc) * np.exp(-((w / model.vs) ** 2))) * np.sign(w)


JOINTS = [Viscous(0.2), Stribeck(0.5, 0.8, 0.1)]


@engineered(4, 2)
def friction_by_type(t, x, u, params):
    w = x[2:]
    return np.concatenate([w, u - np.array([friction(m, wi) for m, wi in zip(JOINTS, w)])])


@engineered(4)
def elastic_joint_logged(t, x, u, params):
    log.debug("elastic joint at t=%s", t)
    q, th, dq, dth = x
    log.info(f"deflection {th - q:.4f} rad")
    spring = 80.0 * (th - q) + 8.0 * (th - q) ** 3
    return [dq, dth, (spring - 9.81 * math.sin(q)) / 0.4, (u[0] - spring) / 0.02]


@engineered(1)
def phase_by_name(t, x, u, params):
    table = dict(hover=0.0, **{"cruise": 1.0, "glide": 0.6})
    phase = "hover" if x[0] < 5 else ("cruise" if u[0] > 0.1 else "glide")
    with suppress(KeyError):
        return [table[phase] * u[0] - 0.1 * x[0]]
    return [0.0]


@engineered(1)
def suppressed_half_way(t, x, u, params):
    with suppress(ValueError):
        gain = 5.0
        if x[0] < 0.3:
            raise ValueError
        gain = 2.0
    return [-gain * x[0] + u[0]]


@engineered(1, verbose=False, limit=2)
def messages_when_asked(t, x, u, params):
    if params["verbose"]:
        print(f"x = {x[0]}")
    if params["limit"] < 1:
        warnings.warn("limit is less than 1", stacklevel=2)
    return [np.clip(u[0] - x[0], -params["limit"], params["limit"])]


def checked(function):
    @functools.wraps(function)
    def wrapper(t, x, u, params):
        out = np.asarray(function(t, x, u, params))
        if out.shape != x.shape:
            log.error("shape %s", out.shape)
        return out

    return wrapper


@engineered(3)
@checked
def dubins_in_wind(t, x, u, params):
    return [15 * np.cos(x[2]) + 2.0, 15 * np.sin(x[2]) - 1.0, u[0]]


@engineered(2)
def text_of_an_error(t, x, u, params):
    message = f"ball has hit the magnet: y = {x[0]:.4f} m"
    if not x[0] > 0:
        raise ValueError(message)
    return [x[1], 9.81 - u[0] ** 2 / x[0] ** 2]


class Cell(NamedTuple):
    capacity: float
    pairs: tuple = ((0.01, 2000.0), (0.02, 20000.0))

    @property
    def taus(self):
        return [r * c for r, c in self.pairs]

    def ocv(self, soc):
        return 3.4 + 0.6 * soc + 0.03 * np.log(np.clip(soc, 1e-3, None))


CELL = Cell(9000.0)


@engineered(3)
def cell_of_a_pack(t, x, u, params):
    i = u[0] - 0.1 * CELL.ocv(x[0])
    dv = [-v / tau + i / c for v, tau, (_, c) in zip(x[1:], CELL.taus, CELL.pairs, strict=True)]
    return [-i / CELL.capacity, *dv]


class Layers:
    def __init__(self, *layers):
        self.layers = layers

    def __len__(self):
        return len(self.layers)

    def __call__(self, z):
        for layer in self.layers:
            z = np.tanh(z @ layer)
        return z


NET = Layers(WIDE, DEEP, WIDE.T)


@engineered(4)
def rows_through_layers(t, x, u, params):
    assert len(NET) == 3, "three layers"
    return NET(x) - x + u[0]


@engineered(4)
def furuta(t, x, u, params):
    a, b, da, db = x
    p1, p2, p3, p4 = 0.0034, 0.0011, 0.0008, 0.027
    M = np.array([[p1 + p2 * np.sin(b) ** 2, p3 * np.cos(b)], [p3 * np.cos(b), p2]])
    h = np.array([p2 * np.sin(2 * b) * da * db - p3 * np.sin(b) * db**2, -p4 * np.sin(b)])
    return np.block([da, db, linalg.solve(M, np.array([u[0], 0.0]) - h, assume_a="pos")])


@engineered(3)
def log_determinant(t, x, u, params):
    M = np.diag(x) + 0.1 * np.outer(x, x) + np.eye(3)
    sign, size = np.linalg.slogdet(M)
    return sign * size - x + u[0]


@engineered(3)
def triangular_determinants(t, x, u, params):
    M = np.array([[1.0, x[0], 0], [0, 2.0, x[2]], [0, 0, 3.0]])
    return [np.linalg.det(M), np.linalg.det(np.diag(x)), u[0] - x[2]]


@engineered(3)
def zeros_in_a_matrix(t, x, u, params):
    M = np.array([[2 + x[0] ** 2, 0.0, 0.0], [x[1], 3.0, 0.0], [0.0, 0.0, 1 + x[2] ** 2]])
    return np.linalg.solve(M, [u[0], x[1], 1.0]) - np.linalg.inv(M)[0]


@engineered(2)
def horizon_of_five(t, x, u, params):
    A, B, N = np.array([[1, 0.1], [0, 0.95]]), np.array([[0.0], [0.1]]), 5
    Phi = np.vstack([np.linalg.matrix_power(A, k + 1) for k in range(N)])
    G = np.zeros((2 * N, N))
    for i in range(N):
        for j in range(i + 1):
            G[2 * i : 2 * i + 2, [j]] = np.linalg.matrix_power(A, i - j) @ B
    U = -np.linalg.solve(G.T @ G + 0.1 * np.eye(N), G.T @ Phi @ x)
    return [x[1], np.clip(U[0], -1, 1) + u[0]]


@engineered(2)
def level_of_flags(t, x, u, params):
    flags = [x[0] > 1, x[1] < -1, abs(u[0]) > 0.5]
    k = [1.0, 0.6, 0.3, 0.0][sum(flags)]
    return np.array([-k * x[0] + u[0], -k * x[1]])


@engineered(1)
def nearest_of_many(t, x, u, params):
    best, place = math.inf, 0
    for k, p in enumerate(np.linspace(-3, 3, 20)):
        d = abs(p - x[0])
        if d < best:
            best, place = d, k
    return [np.linspace(-1, 1, 20)[place] - x[0] + u[0]]


class Quadrant(enum.Enum):
    MOTORING = "motoring"
    BRAKING = "braking"

    @classmethod
    def of(cls, torque, speed):
        return cls.MOTORING if torque * speed >= 0 else cls.BRAKING


EFFICIENCY = {Quadrant.MOTORING: 0.92, Quadrant.BRAKING: 0.85}


@engineered(1)
def power_by_quadrant(t, x, u, params):
    quadrant, p = Quadrant.of(u[0], x[0]), u[0] * x[0]
    eta = EFFICIENCY[quadrant]
    return [p / eta if quadrant is Quadrant.MOTORING else p * eta]
