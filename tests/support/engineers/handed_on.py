"""Laws of probability, classes in patterns, rotations of matrices, halving, flags, gains."""

import contextlib
import copy
import dataclasses
import itertools
import math
from collections import ChainMap
from enum import Flag

import control as ct
import numpy as np
import scipy.linalg
from scipy import stats
from scipy.spatial.transform import Rotation

from engineers.entry import engineered

LIFE = stats.weibull_min(1.5, scale=2.0)
ONSET = stats.gamma(a=2.5, scale=0.4)
NOISE = stats.norm(0.5, 2.0)


# -- laws of probability ---------------------------------------------------------------------------


@engineered(4)
def laws_with_their_numbers(t, x, u, params):
    hazard = ONSET.pdf(t) / max(ONSET.sf(t), 1e-9)
    first = [NOISE.pdf(x[0]), NOISE.cdf(x[1]), LIFE.sf(x[2]), LIFE.logpdf(x[3])]
    second = [ONSET.cdf(x[0]), ONSET.ppf(0.5) * x[1], LIFE.ppf(x[2]), NOISE.isf(x[3])]
    return np.add(first, second) + hazard


@engineered(4)
def families_of_laws(t, x, u, params):
    return [
        stats.expon.cdf(x[0], scale=0.5) + stats.uniform.pdf(x[1], -1, 2),
        stats.lognorm.pdf(x[1], 0.5) + stats.logistic.sf(x[2]),
        stats.beta.pdf(x[2], 2, 3) + stats.triang.pdf(x[3], 0.3),
        stats.t.pdf(x[3], 4) + stats.norm.logcdf(x[0], loc=u[0]),
    ]


@engineered(3)
def a_law_of_states(t, x, u, params):
    here = stats.norm(loc=x[0], scale=1 + abs(x[1]))
    return [here.pdf(u[0]), here.cdf(x[2]) - x[1], stats.chi2.sf(x[2], 3) - x[0]]


# -- classes ---------------------------------------------------------------------------------------


@dataclasses.dataclass
class Relay:
    level: float


@dataclasses.dataclass
class Slope(Relay):
    gain: float = 1.0


BRANCHES = (Relay(0.5), Slope(1.0, 2.0), "off", 3)


def level_of(thing, e):
    match thing:
        case Slope(level, gain=k):
            return min(k * e, level)
        case Relay(level=value) if e > 0:
            return value
        case Relay():
            return -1.0
        case str(word):
            return 0.1 * len(word)
        case int() | float() as number:
            return 0.01 * number
        case None:
            return 0.0


@engineered(2)
def classes_in_patterns(t, x, u, params):
    chosen = Relay(0.3) if x[1] > 0 else Slope(x[1])
    total = sum(level_of(thing, x[0]) for thing in (*BRANCHES, None))
    return [total - x[0], level_of(chosen, x[1]) + u[0]]


@engineered(2, gain="high")
def questions_for_types(t, x, u, params):
    gain = params["gain"]
    k = {"high": 2.0}[gain] if isinstance(gain, str) else gain
    kind = 1.0 if type(BRANCHES[0]) is Relay else 2.0
    other = 3.0 if type(BRANCHES[1]) is not Relay else 4.0
    whole = isinstance(BRANCHES[3], int | float)
    return [-k * x[0] + kind * whole, u[0] - other * x[1]]


class Fault(Flag):
    NONE = 0
    OVER = 1
    UNDER = 2


@engineered(2)
def combined_flags(t, x, u, params):
    fault = Fault(0)
    if x[0] > 1:
        fault |= Fault.OVER
    if x[1] < -1:
        fault |= Fault.UNDER
    derate = 0.5 if fault & Fault.OVER else 1.0
    return [derate * u[0] - x[0], -x[1] if fault == Fault.OVER | Fault.UNDER else x[1]]


# -- what is handed on -----------------------------------------------------------------------------

TABLES = [np.array([1.0, 2.0]), np.array([0.5, 1.5])]
SHAPES = [np.tanh, lambda z: z / (1 + abs(z))]


@engineered(4)
def iterators_of_itertools(t, x, u, params):
    flat = list(itertools.chain.from_iterable((v, -v) for v in x[:2]))
    steps = sum(c * (a - b) for (a, b), c in zip(itertools.pairwise(x), itertools.count(1)))
    both = sum(shape(v) for shape, v in itertools.product(SHAPES, x[:2]))
    sums = list(itertools.accumulate(x))
    joined = np.concatenate(list(itertools.chain(TABLES, TABLES[:1])))
    return [flat[1] + steps, both, sums[-1] + u[0], joined @ np.r_[x, x[:2]]]


@engineered(2)
def settings_in_layers(t, x, u, params):
    own = ChainMap({}, dict.fromkeys(("k", "c"), 2.0), params)
    own["c"] = 0.5
    copied = copy.copy({"k": 1.0})
    copied["k"] += own["k"]
    return [x[1], -copied["k"] * x[0] - own["c"] * x[1] + u[0]]


@engineered(4)
def flows_into_nodes(t, x, u, params):
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]])
    flow = np.array([1.0, 0.5, 0.8, 0.2, 0.4]) * (x[edges[:, 0]] - x[edges[:, 1]])
    change, largest = np.zeros(4), np.full(2, -1.0)
    np.subtract.at(change, edges[:, 0], flow)
    np.add.at(change, edges[:, 1], flow)
    np.maximum.at(largest, [0, 1, 1], x[:3])
    change[:2] += largest + u[0]
    return change


# -- matrices --------------------------------------------------------------------------------------


@engineered(6)
def stresses_and_rotations(t, x, u, params):
    stress = np.array([[x[0], x[1], x[2]], [x[1], x[3], x[4]], [x[2], x[4], x[5]]])
    sizes = np.linalg.svd(x.reshape(3, 2), compute_uv=False)
    return np.r_[np.linalg.eigvalsh(stress), sizes, np.linalg.norm(stress, 2)]


@engineered(4)
def rows_of_four(t, x, u, params):
    return scipy.linalg.eigvalsh(np.diag(x) + np.diag(x[1:], 1) + np.diag(x[1:], -1))


@engineered(4)
def rotations_of_matrices(t, x, u, params):
    turned = Rotation.from_rotvec(x[:3]).as_matrix() @ Rotation.from_euler("z", x[3]).as_matrix()
    return Rotation.from_matrix(turned).as_quat() - x


A, B = np.array([[0.0, 1.0], [-1.0, -0.3]]), np.array([[0.0], [1.0]])


@engineered(2)
def gains_of_constants(t, x, u, params):
    K, _, _ = ct.lqr(A, B, np.diag([10, 1]), 1)
    plant = ct.ss(A, B, np.eye(2), np.zeros((2, 1)))
    return plant.A @ x + plant.B @ (u - K @ x)


W = np.array([[0.1, -0.25], [0.3, 1.0]], dtype=np.float32)
OFFSETS = np.array([3, -1], dtype=np.int8)


@engineered(2)
def weights_of_single_precision(t, x, u, params):
    shifted = np.tanh(W @ x + OFFSETS) + OFFSETS.astype(float)
    return shifted - np.float32(0.1) * x + W[0] / (1 + x**2)


# -- loops and errors ------------------------------------------------------------------------------


@engineered(2)
def powers_within_suppress(t, x, u, params):
    ratio = 0.0
    with contextlib.suppress(ZeroDivisionError, OverflowError):
        ratio = 1 / (float(x[0]) ** 2 - 1)
    try:
        large = float(10 * x[1]) ** 60 * 10.0**200
    except OverflowError:
        large = math.inf
    return [ratio - x[0], min(large, 5.0) + u[0]]
