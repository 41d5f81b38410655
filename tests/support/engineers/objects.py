"""Classes of one's own: parameters, states, vectors, controllers."""

import enum
from collections import deque, namedtuple
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from engineers.entry import engineered

Pendulum = namedtuple("Pendulum", "m l g")


class Gains(NamedTuple):
    kp: float = 2.0
    kd: float = 0.5


@dataclass(frozen=True)
class State:
    q: float
    v: float

    @property
    def energy(self):
        return 0.5 * self.v**2 + 0.5 * self.q**2


@dataclass
class Plant:
    m: float = 1.0
    k: float = 2.0
    c: float = field(default=0.1)

    def acceleration(self, q, v, f):
        return (f - self.k * q - self.c * v) / self.m


class Vector:
    def __init__(self, x, y):
        self.x = x
        self.y = y

    def __add__(self, other):
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other):
        return Vector(self.x - other.x, self.y - other.y)

    def __mul__(self, k):
        return Vector(k * self.x, k * self.y)

    __rmul__ = __mul__

    def __neg__(self):
        return Vector(-self.x, -self.y)

    def length(self):
        return np.hypot(self.x, self.y)


class Mode(enum.Enum):
    OFF = 0
    ON = 1


class Law:
    def __init__(self, kp):
        self.kp = kp

    def __call__(self, e, v):
        return self.kp * e - self.damping() * v

    def damping(self):
        return 0.1


class BetterLaw(Law):
    def __init__(self, kp, kd):
        super().__init__(kp)
        self.kd = kd

    def damping(self):
        return super().damping() + self.kd


PENDULUM = Pendulum(1.0, 0.5, 9.81)
PLANT = Plant()
LAW = BetterLaw(2.0, 0.3)
SETTINGS = SimpleNamespace(kp=2.0, limit=1.0)


@engineered(2)
def named_tuple_outside(t, x, u, params):
    m, l, g = PENDULUM
    return [x[1], (u[0] - m * g * l * np.sin(x[0])) / (m * l**2)]


@engineered(2)
def named_tuple_made_inside(t, x, u, params):
    p = Pendulum(m=1.0, l=0.5, g=9.81)
    return [x[1], -p.g / p.l * np.sin(x[0]) + u[0] / p.m]


@engineered(2, gains=Gains())
def named_tuple_as_a_parameter(t, x, u, params):
    g = params["gains"]
    return [x[1], g.kp * (u[0] - x[0]) - g.kd * x[1]]


@engineered(2)
def frozen_state(t, x, u, params):
    s = State(*x)
    return [s.v, -s.q - 0.1 * s.energy * s.v + u[0]]


@engineered(2)
def frozen_state_by_names(t, x, u, params):
    s = State(q=x[0], v=x[1])
    return np.array([s.v, u[0] - s.q])


@engineered(2)
def plant_made_inside(t, x, u, params):
    plant = Plant(m=2.0)
    return [x[1], plant.acceleration(x[0], x[1], u[0])]


@engineered(2)
def plant_outside(t, x, u, params):
    return [x[1], PLANT.acceleration(*x, u[0])]


@engineered(4, 2)
def vectors_with_operators(t, x, u, params):
    r, v, f = Vector(x[0], x[1]), Vector(x[2], x[3]), Vector(u[0], u[1])
    a = f - 2.0 * r + -v * 0.3
    return [v.x, v.y, a.x, a.y]


@engineered(2)
def length_of_a_vector(t, x, u, params):
    r = Vector(x[0], x[1])
    return [-r.x / (1 + r.length()), u[0] - r.y]


@engineered(2, mode=Mode.ON)
def enumeration_as_a_parameter(t, x, u, params):
    f = u[0] if params["mode"] == Mode.ON else 0.0
    return [x[1], f - x[0]]


@engineered(2, mode=Mode.OFF)
def enumeration_by_identity(t, x, u, params):
    f = u[0] if params["mode"] is Mode.ON else 0.0
    return [x[1], f - x[0]]


@engineered(2)
def law_that_inherits(t, x, u, params):
    return [x[1], LAW(u[0] - x[0], x[1])]


@engineered(2)
def law_made_inside(t, x, u, params):
    law = BetterLaw(2.0, 0.3)
    return [x[1], law(u[0] - x[0], x[1])]


@engineered(2)
def settings_in_a_namespace(t, x, u, params):
    v = np.clip(SETTINGS.kp * (u[0] - x[0]), -SETTINGS.limit, SETTINGS.limit)
    return [x[1], v - x[1]]


@engineered(3)
def queue_made_inside(t, x, u, params):
    q = deque([u[0]])
    q.extend(x[:-1])
    return [a - b for a, b in zip(q, x)]


@engineered(2)
def named_results(t, x, u, params):
    out = dict(position=x[1], velocity=u[0] - x[0])
    return np.array(list(out.values()))


@engineered(2)
def polynomials_with_a_class(t, x, u, params):
    p = np.polynomial.Polynomial([0.0, 1.0, 0.0, 0.1])
    return [x[1], u[0] - p(x[0])]


@engineered(7, 3)
def attitude_by_rotation(t, x, u, params):
    q, w = x[:4], x[4:]
    r = Rotation.from_quat(q)
    down = r.inv().apply([0.0, 0.0, -1.0])
    dq = 0.5 * np.array(
        [
            q[3] * w[0] - q[2] * w[1] + q[1] * w[2],
            q[2] * w[0] + q[3] * w[1] - q[0] * w[2],
            -q[1] * w[0] + q[0] * w[1] + q[3] * w[2],
            -q[0] * w[0] - q[1] * w[1] - q[2] * w[2],
        ]
    )
    return np.concatenate([dq, u + np.cross(down, w) - w])


@engineered(3, 3)
def thrust_by_euler_angles(t, x, u, params):
    r = Rotation.from_euler("zyx", x)
    return r.as_matrix() @ u - x


@engineered(3, 3)
def thrust_by_rotation_vector(t, x, u, params):
    return Rotation.from_rotvec(x).apply(u) - x


class Parts:
    def __init__(self, parts):
        self.__parts = np.array(parts, dtype=float, order="C")

    def __scaled(self, by):
        return self.__class__(by * self.__parts)

    def __mul__(self, by):
        return self.__scaled(by)

    def __add__(self, other):
        return type(self)(self.__parts + other.parts)

    @property
    def parts(self):
        return self.__parts


class Force(Parts):
    limit = 2.0


WIND = Force([0.5, -0.2])


@engineered(2)
def private_names_and_classes_of_objects(t, x, u, params):
    total = Force(x) * -1.0 + WIND
    if hasattr(total, "limit") and hasattr(WIND, "limit"):
        return np.clip(total.parts, -total.limit, WIND.__class__.limit) + u[0]
    return total.parts


@engineered(2)
def types_of_arrays_and_numbers(t, x, u, params):
    error = u[0] - x[0]
    if type(error) == np.ndarray:  # noqa: E721 (as people write it)
        error = error[0]
    assert type(x) is np.ndarray
    return [x[1], error if type(error) in (float, np.float64) else 0.0]
