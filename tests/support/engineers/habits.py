"""How loops, arguments and lists are written."""

import cmath
import copy
import functools
import itertools
import math
import operator
import statistics
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sl
from scipy import signal

from engineers.entry import engineered

M3 = np.array([[2.0, 0.3, 0], [0.3, 1.5, 0.2], [0, 0.2, 1.0]])
COEF = np.polyfit(np.linspace(-1, 1, 9), np.sin(np.linspace(-1, 1, 9)), 3)
BA = signal.butter(2, 1.0, analog=True)
ABCD = signal.tf2ss(*BA)


class Part(ABC):
    @abstractmethod
    def force(self, x): ...


class Spring(Part):
    def __init__(self, k):
        self.k = k

    def force(self, x):
        return -self.k * x


class Cubic(Part):
    def __init__(self, k):
        self.k = k

    def force(self, x):
        return -self.k * x**3


PARTS = [Spring(2.0), Cubic(0.5)]


@dataclass
class Tank:
    area: float = 1.0
    valves: list = field(default_factory=lambda: [0.1, 0.2])

    def out(self, h):
        return sum(v * math.sqrt(max(h, 0.0)) for v in self.valves) / self.area


TANK = Tank()


class Law:
    def __init__(self, k):
        self.k = k

    def __call__(self, e):
        return self.k * np.tanh(e)


LAW = Law(3.0)


def saturate(v, *, low=-1.0, high=1.0):
    return max(low, min(high, v))


def summed(*vs, **ks):
    return sum(vs) * ks.get("k", 1.0)


@functools.cache
def table(n):
    return np.linspace(0, 1, n)


def traced_twice(fn):
    @functools.wraps(fn)
    def inner(*a):
        return fn(*a) * 2

    return inner


@traced_twice
def drag(v):
    return 0.1 * v * abs(v)


class Unit:
    K = 2.0

    @staticmethod
    def scale(v):
        return v * 1.5

    @classmethod
    def gain(cls, v):
        return cls.K * v


@engineered(3)
def pseudo_inverse(t, x, u, params):
    return -np.linalg.pinv(M3) @ x + u[0]


@engineered(3)
def cholesky_constant(t, x, u, params):
    return -sl.cho_solve(sl.cho_factor(M3), x) + u[0]


@engineered(3)
def lu_constant(t, x, u, params):
    return -sl.lu_solve(sl.lu_factor(M3), x) + u[0]


@engineered(2)
def state_space_filter(t, x, u, params):
    A, B, C, D = ABCD
    return A @ x + B.ravel() * u[0]


@engineered(2)
def fitted_polynomial(t, x, u, params):
    return [x[1], -np.polyval(COEF, x[0]) - x[1] + u[0]]


@engineered(3)
def reversed_fancy(t, x, u, params):
    return -x[::-1] + x[[1, 2, 0]] * 0.1 + u[0]


@engineered(3)
def broadcast_none(t, x, u, params):
    return (x[:, None] - x[None, :]).sum(axis=1) * -0.3 - x + u[0]


@engineered(3)
def argsorted(t, x, u, params):
    return -x[np.argsort(x)] + u[0]


@engineered(4)
def triangular(t, x, u, params):
    return -np.tril(np.outer(x, x)).sum(axis=0) * 0.1 - x + u[0]


@engineered(3)
def taken_chosen(t, x, u, params):
    return -np.take(x, [2, 0, 1]) - np.ptp(x) * 0.1 + np.average(x, weights=[1, 2, 3]) + u[0]


@engineered(3)
def counted(t, x, u, params):
    return -x * np.count_nonzero(x > 0) + u[0]


@engineered(2)
def close_to(t, x, u, params):
    return [x[1], -(0.0 if np.isclose(x[0], 1.0) else 1.0) * x[0] + u[0]]


@engineered(3)
def reduce_logical(t, x, u, params):
    return np.where(np.logical_and.reduce(x > 0), -2 * x, -x) + u[0]


@engineered(3)
def mapped_filtered(t, x, u, params):
    return [-sum(map(math.sin, x)) + u[0], -x[1], -max(x, key=lambda v: v * v)]


@engineered(2)
def asserted(t, x, u, params):
    assert len(x) == 2
    return [x[1], -x[0] + u[0]]


@engineered(2)
def counted_nonlocal(t, x, u, params):
    total = 0.0

    def add(v):
        nonlocal total
        total += v

    for v in x:
        add(v * 0.5)
    return [x[1], -total + u[0]]


@engineered(2)
def keyword_only(t, x, u, params):
    return [x[1], saturate(-3 * x[0], high=2.0) - summed(x[1], x[0], k=0.3) + u[0]]


@engineered(2)
def cached_table(t, x, u, params):
    return [x[1], -np.interp(x[0], table(5), table(5) ** 2) - x[1] + u[0]]


@engineered(2)
def decorated(t, x, u, params):
    return [x[1], -x[0] - drag(x[1]) + u[0]]


@engineered(2)
def static_and_class(t, x, u, params):
    return [Unit.scale(x[1]), -Unit.gain(x[0]) - x[1] + u[0]]


@engineered(2)
def callable_object(t, x, u, params):
    return [x[1], -LAW(x[0]) - x[1] + u[0]]


@engineered(2)
def list_of_parts(t, x, u, params):
    return [x[1], sum(p.force(x[0]) for p in PARTS) - x[1] + u[0]]


@engineered(2)
def tank_with_default_list(t, x, u, params):
    return [u[0] - TANK.out(x[0]), TANK.out(x[0]) - TANK.out(x[1])]


@engineered(3)
def generator_function(t, x, u, params):
    def parts():
        for v in x:
            yield -v + u[0]

    return list(parts())


@engineered(2)
def loop_with_break(t, x, u, params):
    k = 0
    while True:
        k += 1
        if k > 3:
            break
    return [x[1], -k * x[0] + u[0]]


@engineered(2)
def loop_with_else(t, x, u, params):
    for limit in (0.5, 1.0, 2.0):
        if abs(x[0]) < limit:
            g = limit
            break
    else:
        g = 4.0
    return [x[1], -g * x[0] - x[1] + u[0]]


@engineered(2)
def rounded(t, x, u, params):
    return [x[1], -round(x[0], 1) - x[1] + u[0]]


@engineered(2)
def complex_math(t, x, u, params):
    z = cmath.rect(1.0 + 0.1 * abs(x[0]), x[1])
    return [z.real - x[0] + u[0], -z.imag]


@engineered(2)
def distances(t, x, u, params):
    return [
        x[1],
        -math.dist(x, [1.0, 0.0])
        - math.prod([1 + x[0] ** 2, 0.5])
        - math.degrees(x[1]) * 0.01
        + u[0],
    ]


@engineered(3)
def statistics_mean(t, x, u, params):
    return statistics.fmean(x) - x + u[0]


@engineered(3)
def item_getter(t, x, u, params):
    a, b = operator.itemgetter(0, 2)(x)
    return [b + u[0], -x[1], -a - b]


@engineered(3)
def copied_list(t, x, u, params):
    y = copy.copy(list(x))
    y[0] = u[0]
    y.append(1.0)
    y.pop()
    return [-a + b * 0.1 for a, b in zip(x, y)]


@engineered(2)
def list_methods(t, x, u, params):
    y = []
    y.extend(x)
    y.insert(0, u[0])
    y.reverse()
    return [y[0], -y[1] - y[0] + y[2]]


@engineered(2)
def dict_items(t, x, u, params):
    k = {"p": 2.0, "d": 0.5}
    s = {"p": x[0], "d": x[1]}
    return [x[1], -sum(v * s[n] for n, v in k.items()) + u[0]]


@engineered(2)
def in_set(t, x, u, params):
    kind = "a"
    return [x[1], -(2.0 if kind in {"a", "b"} else 1.0) * x[0] + u[0]]


@engineered(3)
def chained_itertools(t, x, u, params):
    return [-v for v in itertools.chain(x[:2], [x[2] * 2 - u[0]])]
