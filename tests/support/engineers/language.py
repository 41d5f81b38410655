"""Python as it is written: loops, comprehensions, functions of functions."""

import functools
import itertools
import operator
from functools import partial, reduce

import numpy as np

from engineers.entry import engineered

FORCES = [lambda q: -q, lambda q: -0.1 * q**3, np.sin]
TERMS = {"spring": lambda x: -x[0], "damper": lambda x: -0.2 * x[1]}


@engineered(2)
def sum_of_forces(t, x, u, params):
    return [x[1], sum(f(x[0]) for f in FORCES) + u[0]]


@engineered(2)
def loop_over_forces(t, x, u, params):
    total = u[0]
    for force in FORCES:
        total += force(x[0])
    return np.array([x[1], total])


@engineered(2)
def terms_by_name(t, x, u, params):
    return [x[1], sum(term(x) for term in TERMS.values()) + u[0]]


@engineered(2)
def terms_with_their_names(t, x, u, params):
    a = 0
    for name, term in TERMS.items():
        a += term(x) * (2.0 if name == "spring" else 1.0)
    return [x[1], a + u[0]]


@engineered(2, m=1.0, k=2.0, c=0.3)
def parameters_by_map(t, x, u, params):
    m, k, c = map(params.get, ["m", "k", "c"])
    return [x[1], (u[0] - k * x[0] - c * x[1]) / m]


@engineered(2, m=1.0, k=2.0, c=0.3)
def parameters_by_itemgetter(t, x, u, params):
    m, k, c = operator.itemgetter("m", "k", "c")(params)
    return [x[1], (u[0] - k * x[0] - c * x[1]) / m]


@engineered(2, m=1.0, k=2.0, c=0.3)
def parameters_by_comprehension(t, x, u, params):
    m, k, c = [params[name] for name in ("m", "k", "c")]
    return [x[1], (u[0] - k * x[0] - c * x[1]) / m]


@engineered(2, m=1.0, k=2.0, c=0.3)
def parameters_by_values(t, x, u, params):
    m, k, c = params.values()
    return [x[1], (u[0] - k * x[0] - c * x[1]) / m]


def oscillator(x, v, *, m, k, c):
    return [v, -(k * x + c * v) / m]


@engineered(2, m=1.0, k=2.0, c=0.3)
def parameters_by_stars(t, x, u, params):
    dx = oscillator(*x, **params)
    return [dx[0], dx[1] + u[0]]


@engineered(2)
def default_parameters(t, x, u, params):
    p = {"k": 1.0, "c": 0.1} | params
    return [x[1], -p["k"] * x[0] - p.get("c", 1.0) * x[1] + u[0]]


@engineered(3)
def product_by_reduce(t, x, u, params):
    return [reduce(lambda a, b: a * b, x) - x[0], x[0] - x[1], u[0] - x[2]]


@engineered(3)
def sum_by_operator(t, x, u, params):
    return [reduce(operator.add, x) * -0.1, -operator.itemgetter(1)(x), operator.sub(u[0], x[2])]


def spring(q, k, k3=0.0):
    return -k * q - k3 * q**3


@engineered(2)
def partials_inside(t, x, u, params):
    soft = partial(spring, k=1.0)
    hard = functools.partial(spring, k=1.0, k3=0.5)
    return [x[1], soft(x[0]) + hard(x[0]) + u[0]]


@engineered(4)
def running_sums(t, x, u, params):
    sums = list(itertools.accumulate(x))
    return [u[0] - sums[-1], sums[0] - x[1], sums[1] - x[2], sums[2] - x[3]]


@engineered(4)
def neighbours_by_pairwise(t, x, u, params):
    return [u[0] - x[0], *(a - b for a, b in itertools.pairwise(x))]


@engineered(4)
def neighbours_by_zip(t, x, u, params):
    dx = [u[0] - x[0]]
    for a, b in zip(x[:-1], x[1:]):
        dx.append(a - b)
    return dx


@engineered(6, n=3)
def chain_by_a_loop(t, x, u, params):
    n = params["n"]
    dx = np.zeros(2 * n)
    for i in range(n):
        left = x[i - 1] if i > 0 else 0.0
        right = x[i + 1] if i < n - 1 else u[0]
        dx[i] = x[n + i]
        dx[n + i] = left - 2 * x[i] + right - 0.1 * x[n + i]
    return dx


@engineered(2)
def inner_function(t, x, u, params):
    def saturate(v, limit=1.0):
        return max(-limit, min(limit, v))

    return [x[1], saturate(u[0], limit=0.5) - saturate(x[0])]


@engineered(2)
def closure_made_inside(t, x, u, params):
    def gain(k):
        return lambda e: k * e

    p, d = gain(2.0), gain(0.5)
    return [x[1], p(u[0] - x[0]) - d(x[1])]


@engineered(2)
def newton_inside(t, x, u, params):
    z = x[0]
    for _ in range(5):
        z = z - (z + 0.1 * z**3 - u[0]) / (1 + 0.3 * z**2)
    return [z - x[0], x[0] - x[1]]


@engineered(2, mode="soft")
def mode_by_text(t, x, u, params):
    k = {"soft": 1.0, "hard": 10.0}[params["mode"]]
    return [x[1], -k * x[0] + u[0]]


@engineered(2, terms=("spring", "damper"))
def terms_that_are_asked_for(t, x, u, params):
    a = u[0]
    if "spring" in params["terms"]:
        a -= x[0]
    if "damper" in params["terms"]:
        a -= 0.2 * x[1]
    return x[1], a


@engineered(3)
def star_assignment(t, x, u, params):
    first, *rest = x
    return [u[0] - first, *[first - r for r in rest]]


@engineered(2)
def keys_tried(t, x, u, params):
    try:
        k = params["k"]
    except KeyError:
        k = 2.0
    return [x[1], -k * x[0] + u[0]]


@engineered(2)
def conditional_expression_of_functions(t, x, u, params):
    f = np.sin if params.get("exact", True) else (lambda z: z)
    return [x[1], -f(x[0]) + u[0]]


@engineered(3)
def enumerated(t, x, u, params):
    dx = np.empty(3)
    for i, v in enumerate(x):
        dx[i] = -(i + 1) * v + u[0]
    return dx


@engineered(2)
def vectorised(t, x, u, params):
    f = np.vectorize(lambda v: -v if v > 0 else -2 * v)
    return f(x) + u[0]


@engineered(2)
def global_dispatch(t, x, u, params):
    f = FORCES[1]
    return [x[1], f(x[0]) + u[0]]
