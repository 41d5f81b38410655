"""Everyday arrays, choices, records and closures."""

import enum
import functools
import itertools
import operator
from collections import namedtuple
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.special
from scipy.interpolate import Akima1DInterpolator, CubicSpline, PchipInterpolator, interp1d

from engineers.entry import engineered

A4 = np.array([[0, 1, 0, 0], [-2, -0.3, 1, 0], [0, 0, 0, 1], [1, 0, -2, -0.3]])
B4 = np.array([0, 0, 0, 1.0])
K = scipy.linalg.solve_continuous_are(A4, B4[:, None], np.eye(4), np.eye(1))
TABLE = {"cold": 1.5, "warm": 1.0, "hot": 0.4}
XS = np.linspace(-2, 2, 9)
YS = np.tanh(XS)
SPL = CubicSpline(XS, YS)
PCH = PchipInterpolator(XS, YS**3)
AK = Akima1DInterpolator(XS, YS)
LIN = interp1d(XS, YS, fill_value="extrapolate")
LINB = interp1d(XS, YS, bounds_error=False, fill_value=(YS[0], YS[-1]))
CUB = interp1d(XS, YS, kind="cubic", fill_value="extrapolate")
Point = namedtuple("Point", "x y")


@dataclass(frozen=True)
class Motor:
    R: float = 1.2
    L: float = 0.05
    k: float = 0.3

    def torque(self, i):
        return self.k * i

    @property
    def tau(self):
        return self.L / self.R


class Mode(enum.Enum):
    SLOW = 1
    FAST = 2


class Gear(enum.IntEnum):
    LOW = 1
    HIGH = 3


class Base:
    def __init__(self, k):
        self.k = k

    def force(self, x):
        return -self.k * x


class Damped(Base):
    def __init__(self, k, c):
        super().__init__(k)
        self.c = c

    def force(self, x, v):
        return super().force(x) - self.c * v


SPRING = Damped(2.0, 0.3)


@engineered(4)
def are_feedback(t, x, u, params):
    return A4 @ x - B4 * (B4 @ K @ x) + B4 * u[0]


@engineered(4)
def expm_of_constants(t, x, u, params):
    return scipy.linalg.expm(A4 * 0.1) @ x - x + B4 * u[0]


@engineered(3)
def trapz_profile(t, x, u, params):
    s = np.linspace(0, 1, 7)
    y = x[0] + x[1] * s + x[2] * s**2
    return [-np.trapezoid(y, s) + u[0], -x[1], x[0] - x[2]]


@engineered(3)
def convolved(t, x, u, params):
    return np.convolve(x, [0.25, 0.5, 0.25], mode="same") - x + u[0]


@engineered(5)
def gradient_heat(t, x, u, params):
    q = -np.gradient(x, 0.25)
    d = -np.gradient(q, 0.25)
    d[0] += u[0]
    return d


@engineered(4)
def along_axis(t, x, u, params):
    return np.apply_along_axis(lambda r: r - r.mean(), 1, x.reshape(2, 2)).ravel() * -1 + u[0]


@engineered(3)
def vectorized(t, x, u, params):
    g = np.vectorize(lambda v: v**2 if v > 0 else -v)
    return -g(x) + u[0]


@engineered(3)
def from_iter(t, x, u, params):
    return np.fromiter((-(i + 1) * v for i, v in enumerate(x)), dtype=float) + u[0]


@engineered(2)
def heaviside_push(t, x, u, params):
    return [x[1], -x[0] - np.heaviside(x[1], 0.5) * 0.3 + u[0]]


@engineered(2)
def interp_states_in_fp(t, x, u, params):
    return [x[1], -np.interp(0.3, [0, 0.5, 1], [x[0], x[1], 0]) + u[0]]


@engineered(2)
def interp_moving_xp(t, x, u, params):
    return [x[1], -np.interp(x[0], [-1.0, 0.0, 1.0], [x[1] - 1, 0.0, 1.0]) + u[0]]


@engineered(2)
def select_mode(t, x, u, params):
    s = np.select([x[0] < -0.5, np.abs(x[1]) > 1], [1.0, x[1] * 2], default=-x[0])
    return np.array([x[1], s + u[0]])


@engineered(2)
def piecewise_three(t, x, u, params):
    return [
        x[1],
        float(np.piecewise(x[0], [x[0] < -1, x[0] > 1], [lambda v: v + 1, lambda v: v - 1, 0.0]))
        * -1
        + u[0],
    ]


@engineered(3)
def match_on_number(t, x, u, params):
    n = len(x)
    match n:
        case 2:
            k = 1.0
        case 3:
            k = 2.0
        case _:
            k = 0.0
    return -k * x + u[0]


@engineered(2, mode=1)
def match_on_string(t, x, u, params):
    mode = "slow" if params["mode"] == 1 else "fast"
    match mode:
        case "slow":
            g = 0.5
        case "fast":
            g = 5.0
    return [x[1], -g * x[0] - x[1] + u[0]]


@engineered(2)
def walrus(t, x, u, params):
    if (e := u[0] - x[0]) > 1:
        e = 1 + 0.1 * (e - 1)
    return [x[1], 5 * e - 2 * x[1]]


@engineered(3, k_1=1.0, k_2=2.0, k_3=0.5)
def f_string_keys(t, x, u, params):
    return np.array([-params[f"k_{i}"] * x[i - 1] for i in range(1, 4)]) + u[0]


@engineered(2)
def string_lookup(t, x, u, params):
    key = "hot" if x[0] > 1 else "cold" if x[0] < -1 else "warm"
    return [x[1], -TABLE[key] * x[0] - x[1] + u[0]]


@engineered(2)
def named_point(t, x, u, params):
    p = Point(*x)
    q = p._replace(x=p.x**2)
    return [p.y, -q.x * np.sign(p.x) - p.y + u[0]]


@engineered(2)
def motor_record(t, x, u, params):
    m = Motor(R=2.0)
    i, w = x
    return [(u[0] - m.R * i - m.k * w) / m.L, m.torque(i) - 0.1 * w - m.tau * w]


@engineered(2)
def enum_mode(t, x, u, params):
    mode = Mode.FAST if abs(x[0]) > 1 else Mode.SLOW
    return [x[1], -(2.0 if mode is Mode.FAST else 0.5) * x[0] - x[1] + u[0]]


@engineered(1)
def int_enum(t, x, u, params):
    return [-Gear.HIGH * x[0] + Gear.LOW.value * u[0]]


@engineered(2)
def with_super(t, x, u, params):
    return [x[1], SPRING.force(x[0], x[1]) + u[0]]


@engineered(2)
def super_made_inside(t, x, u, params):
    s = Damped(1.5, 0.2)
    return [x[1], s.force(*x) + u[0]]


@engineered(2)
def complex_pair(t, x, u, params):
    z = x[0] + 1j * x[1]
    dz = (-0.2 + 2j) * z - z * abs(z) ** 2 + u[0]
    return [dz.real, dz.imag]


@engineered(2)
def complex_exponential(t, x, u, params):
    z = complex(x[0], x[1]) * np.exp(1j * 0.7)
    return [-z.real + u[0], -z.imag]


@engineered(4)
def accumulated(t, x, u, params):
    return -np.array(list(itertools.accumulate(x))) + u[0]


@engineered(4)
def pairwise_chain(t, x, u, params):
    d = [b - a for a, b in itertools.pairwise(x)]
    return [d[0] + u[0], d[1] - d[0], d[2] - d[1], -d[2]]


@engineered(3)
def reduced(t, x, u, params):
    return -x * functools.reduce(operator.mul, [1 + 0.1 * v**2 for v in x]) + u[0]


@engineered(2)
def partial_law(t, x, u, params):
    law = functools.partial(lambda k, c, p, v: -k * p - c * v, 2.0, c=0.5)
    return [x[1], law(p=x[0], v=x[1]) + u[0]]


@engineered(3)
def comprehension_with_condition(t, x, u, params):
    return [sum(v for v in x if v > 0) * -1 + u[0]] + [-v for v in x[1:]]


@engineered(3)
def dict_comprehension(t, x, u, params):
    s = {n: 1.0 * v for n, v in zip("abc", x)}
    return [s["b"] - s["a"] + u[0], s["c"] - s["b"], -s["c"]]


@engineered(2)
def special_functions(t, x, u, params):
    return [
        x[1],
        -scipy.special.erf(x[0])
        - scipy.special.expit(x[1])
        + scipy.special.xlogy(1.0, 1 + x[0] ** 2)
        + u[0],
    ]


@engineered(2)
def log_ndtr_gamma(t, x, u, params):
    return [
        x[1],
        -scipy.special.ndtr(x[0])
        - scipy.special.gamma(1.5) * x[1]
        + scipy.special.logit(0.3)
        + u[0],
    ]


@engineered(2)
def pchip_derivative(t, x, u, params):
    return [x[1], -PCH.derivative()(x[0]) - x[1] + u[0]]


@engineered(2)
def akima(t, x, u, params):
    return [x[1], -AK(np.clip(x[0], -2, 2)) - x[1] + u[0]]


@engineered(2)
def linear_extrapolated(t, x, u, params):
    return [x[1], -LIN(x[0]) - LINB(x[1]) + u[0]]


@engineered(2)
def interp1d_cubic(t, x, u, params):
    return [x[1], -float(CUB(x[0])) - x[1] + u[0]]
