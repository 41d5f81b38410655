"""Gamma functions, matrix functions, statistics, and tables of pandas with labels."""

import enum
import math
import statistics
from fractions import Fraction

import numpy as np
import pandas as pd
from scipy import linalg, special

from engineers.entry import engineered


@engineered(2)
def gamma_functions(t, x, u, params):
    return [special.gammaln(x[0]), special.gamma(0.3 + np.tanh(x[1]))]


@engineered(2)
def logarithm_of_factorials(t, x, u, params):
    return [math.lgamma(1.5 + x[0] ** 2), math.gamma(1 + math.tanh(x[1]) ** 2)]


@engineered(3)
def exponential_of_a_matrix(t, x, u, params):
    A = np.array([[0, 1, 0], [-math.tanh(x[0]), -0.5, 1], [0, 0, -1]])
    return (linalg.expm(0.1 * A) - np.eye(3)) @ x


@engineered(2)
def least_squares_of_two(t, x, u, params):
    slopes = np.array([[-np.sin(x[0]), 0.2], [np.cos(x[0]), 1.0], [0.1, np.cos(x[1])]])
    rates, *_ = np.linalg.lstsq(slopes, np.array([u[0], 1.0, x[1]]), rcond=None)
    return rates


@engineered(2)
def regular_enough(t, x, u, params):
    A = np.array([[0.0, 1.0], [-1.0 - 0.1 * x[0] ** 2, -0.5]])
    if np.linalg.cond(A) > 3.0:
        A = A + 0.5 * np.eye(2)
    return A @ x


@engineered(4)
def spread_of_agents(t, x, u, params):
    spread = statistics.pstdev(x) + 0.1 * statistics.stdev(list(x))
    return [statistics.mean(x) - v + spread * statistics.variance(x, 0.5) for v in x]


RATIO = Fraction(3, 7)


@engineered(1)
def ratio_of_gears(t, x, u, params):
    return [-float(RATIO) * x[0] + float(Fraction(1, 3) * 2) * x[0] ** 2]


PROPERTIES = pd.DataFrame({"cp": [4180.0, 2300.0], "k": [0.6, 0.15]}, index=["water", "oil"])
VALVES = pd.DataFrame({"name": ["v1", "v2"], "Cv": [0.1, 0.2], "at": [0.0, 0.5]})
STEAM = pd.DataFrame({"T": [0.0, 1.0, 2.0], "h": [26.0, 27.0, 29.0]})
RATES = pd.Series({"k1": 0.5, "k2": 0.3, "volume": 2.0})


@engineered(2)
def rows_of_a_table(t, x, u, params):
    water, oil = PROPERTIES.loc["water"], PROPERTIES.loc["oil"]
    flow = 50 * math.sqrt(water["k"] * oil.k) * (x[1] - x[0])
    return [flow / water["cp"], -flow / PROPERTIES.at["oil", "cp"]]


@engineered(2)
def each_row_of_a_table(t, x, u, params):
    flow = 0.0
    for row in VALVES.itertuples():
        flow += row.Cv * np.sqrt(max(x[0], 0)) * special.expit(10 * (x[1] - row.at))
    return [u[0] - flow, 0.5 - x[1]]


@engineered(1)
def columns_as_arrays(t, x, u, params):
    return [np.interp(x[0], STEAM["T"].values, STEAM["h"].to_numpy()) + STEAM["h"].values[1] * x[0]]


@engineered(2)
def labels_of_a_column(t, x, u, params):
    rate = RATES.k1 * x[0] - RATES["k2"] * x[1]
    return [u[0] / RATES["volume"] - rate, rate]


class Fault(enum.IntFlag):
    NONE = 0
    HOT = 1
    FAST = 2


@engineered(2)
def flags(t, x, u, params):
    fault = Fault.NONE
    if x[0] > 1.0:
        fault |= Fault.HOT
    if abs(x[1]) > 1.5:
        fault |= Fault.FAST
    command = 0.5 * u[0] if fault else u[0]
    if fault & Fault.HOT and fault & Fault.FAST:
        command = 0.0
    return [command - x[0], x[0] - x[1]]


@engineered(3)
def sums_by_name(t, x, u, params):
    names = ["a", "b", "c"]
    level = dict(zip(names, x, strict=True))
    rate = {k: 0.0 for k in names}  # noqa: C420 (as users write it)
    for source, target in [("a", "b"), ("b", "c"), ("c", "a")]:
        rate[target] += 1 / (1 + level[source] ** 2)
    return [rate[k] - level[k] for k in names]


@engineered(20)
def every_other_state(t, x, u, params):
    v, w = x[::2], x[1::2]
    rates = np.empty_like(x)
    rates[::2] = v - v**3 / 3 - w + np.roll(v, 1)
    rates[1::2] = 0.08 * (v + 0.7 - 0.8 * w)
    return rates


COUPLING = 0.02 * np.random.default_rng(3).normal(size=(30, 30)) - np.eye(30)


@engineered(30, A=COUPLING, r=np.ones(30))
def many_species(t, x, u, params):
    return x * (params["r"] + params["A"] @ x)


@engineered(4)
def places_and_elements(t, x, u, params):
    X, rates = x.reshape(2, 2), np.zeros((2, 2))
    for (i, j), v in np.ndenumerate(X):
        rates[i, j] = -v + 0.1 * X[j, i]
    return rates.ravel()
