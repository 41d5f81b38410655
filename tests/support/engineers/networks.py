"""Networks of reactions and rooms, rules of fuzzy logic, curves in space, and roots inside."""

import collections
import dataclasses
import functools
import math
import operator
from dataclasses import astuple, dataclass

import numpy as np
from scipy import interpolate, optimize

from engineers.entry import engineered

EDGES = {("gut", "blood"): 0.5, ("blood", "tissue"): 0.2, ("tissue", "blood"): 0.1}
ROOMS = ["gut", "blood", "tissue"]
TABLE = [(0.0, 1.0, 10.0), (1.0, 2.0, 9.0), (2.0, 4.0, 7.5)]
S = np.linspace(0.0, 6.0, 7)
PATH = interpolate.CubicSpline(S, np.c_[S, np.sin(S)])
ROWS = interpolate.CubicSpline(S, np.array([S, np.cos(S)]), axis=1)
SHAPED = interpolate.make_interp_spline(S, np.array([S, np.sin(S)]), axis=1)
LINES = interpolate.interp1d(S, np.array([S, np.cos(S)]), axis=1, fill_value="extrapolate")
DEFAULTS = {"k": 2.0, "c": 0.5}
KNOTS, POINTS = [0, 0, 0, 1, 2, 3, 3, 3], [0.0, 1.0, 0.5, 2.0, 1.0]
LEGS = {1: (1, 0, 0), 2: (1, 1, 0), 3: (0, 1, 0), 4: (0, 1, 1), 5: (0, 0, 1), 6: (1, 0, 1)}


@dataclass(frozen=True)
class Drive:
    low: float
    high: float
    cost: float = 1.0

    def limited(self, v):
        return min(max(v, self.low), self.high)


DRIVES = (Drive(-1.0, 1.0), Drive(-0.5, 0.5, cost=2.0))


class Bell:
    def __init__(self, center):
        self.center = center

    def __call__(self, v):
        return math.exp(-((v - self.center) ** 2))


class Rules:
    def __init__(self, rules):
        self.rules = rules

    def output(self, *inputs):
        weights = [
            functools.reduce(operator.mul, (bell(v) for bell, v in zip(r["if"], inputs)))
            for r in self.rules
        ]
        values = [r["then"](*inputs) for r in self.rules]
        return sum(a * b for a, b in zip(weights, values)) / (1e-9 + sum(weights))


RULES = Rules([
    {"if": (Bell(-1.0), Bell(0.0)), "then": lambda e, d: -e - 0.1 * d},
    {"if": (Bell(1.0), Bell(0.0)), "then": lambda e, d: -2 * e - 0.3 * d},
])  # fmt: skip


@engineered(3)
def compartments(t, x, u, params):
    amounts, rates = dict(zip(ROOMS, x, strict=True)), collections.defaultdict(float)
    for (source, target), k in EDGES.items():
        flow = k * amounts[source]
        rates[source] -= flow
        rates[target] += flow
    rates["gut"] += u[0]
    return [rates[name] for name in ROOMS]


@engineered(3)
def counted_amounts(t, x, u, params):
    amounts, total = dict(zip(ROOMS, x, strict=True)), {}
    for source, target in EDGES:
        total[source] = total.get(source, 0.0) - amounts[target]
        total[source] += 1.0
    return [total.get(name, 0.0) for name in ROOMS]


def looked_up(v):
    for low, high, value in TABLE:
        if low <= v < high:
            return value
        if v >= high and high == TABLE[-1][1]:
            return value
    if v < 0:
        return 0.0


@engineered(1)
def without_else(t, x, u, params):
    return looked_up(x[0]) * u


@engineered(3)
def along_a_path(t, x, u, params):
    s = np.clip(x[2], 0, 6)
    apart, tangent = PATH(s) - x[:2], PATH(s, 1)
    return np.append(apart, 0.5 + tangent @ apart / (tangent @ tangent) + u[0])


@engineered(4)
def rows_of_splines(t, x, u, params):
    s = np.clip(x[:2], 0, 6)
    return (ROWS(s) + ROWS(s, 1) + SHAPED(s, 1) + LINES(s)).ravel()


@engineered(2)
def replaced_before(t, x, u, params):
    rest, out = u[0] - x[0], []
    for drive in sorted(DRIVES, key=lambda d: d.cost):
        wider = dataclasses.replace(drive, high=drive.high + 0.1 * x[1] ** 2)
        out.append(wider.limited(rest) + dataclasses.asdict(drive)["cost"])
        rest -= out[-1]
    return out


@engineered(2)
def as_a_tuple(t, x, u, params):
    return np.array(astuple(Drive(x[1], u[0] - x[0]))[:2])


@engineered(2)
def fuzzy_rules(t, x, u, params):
    return x[1], RULES.output(x[0] - u[0], x[1])


@engineered(1, k=3.0)
def with_defaults(t, x, u, params):
    p = {**DEFAULTS, **params}
    p["k"] *= 2
    p["c"] += 1.0
    return p["k"] * (u - x) - p["c"] * x


@engineered(2, 2)
def sectors(t, x, u, params):
    angle = np.arctan2(u[1], u[0]) % (2 * np.pi)
    sector = int(angle // (np.pi / 3)) + 1 if np.isfinite(angle) else 0
    a, b, c = LEGS.get(sector, (0, 0, 0))
    return np.array([2 * a - b - c, b - c]) - x


@engineered(1)
def by_de_boor(t, x, u, params):
    s = min(max(x[0], 0.0), 2.999)
    k = 2 + int(s)
    d = [POINTS[j + k - 2] for j in range(3)]
    for r in range(1, 3):
        for j in range(2, r - 1, -1):
            part = (s - KNOTS[j + k - 2]) / (KNOTS[j + 1 + k - r] - KNOTS[j + k - 2])
            d[j] = (1 - part) * d[j - 1] + part * d[j]
    return [d[2] - u[0]]


@engineered(1)
def diode(t, x, u, params):
    excess = lambda i: u[0] - x[0] - i * 10 - 0.26 * np.arctan(i)  # noqa: E731
    return optimize.fsolve(excess, 0.01)


@engineered(1)
def found_by_root(t, x, u, params):
    found = optimize.root(lambda y, a: y + np.sinh(y) - a, 0.0, args=(x[0] + u[0],))
    return -found.x if found.success else np.array([np.nan])
