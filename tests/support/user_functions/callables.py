"""Partials, lambdas, decorators, closures, recursion, caches."""

import functools
import operator

import numpy as np

from . import helpers
from ._entry import entry, pieces
from .helpers import saturate


@entry
def partial_positional(n):
    def update(gain, t, x, u, params):
        return -gain * x + u[0]

    return pieces(functools.partial(update, 2.5), states=n)


@entry(discrete=True)
def partial_keyword(n):
    def update(t, x, u, params, gain=1.0, table=(0.0,)):
        return -gain * x + table[1] * u[0]

    return pieces(functools.partial(update, gain=0.4, table=[1.0, 3.0]), states=n)


@entry
def partial_of_a_partial_of_a_method(n):
    class Plant:
        k = 2.0

        def update(self, a, t, x, u, params, b=0.0):
            return -self.k * x + a * u[0] + b

    inner = functools.partial(Plant().update, 3.0)
    return pieces(functools.partial(inner, b=0.7), states=n)


@entry
def partial_called_within(n):
    clip = functools.partial(np.clip, a_min=-0.5, a_max=0.5)
    cube = functools.partial(pow, exp=3)

    def update(t, x, u, params):
        return clip(x) + cube(u[0])

    return pieces(update, states=n)


@entry
def lru_cache_of_constants(n):
    @functools.lru_cache
    def weights(m):
        return np.linspace(0, 1, m)

    def update(t, x, u, params):
        return -x * weights(n) + u[0]

    return pieces(update, states=n)


@entry
def lru_cache_of_the_state(n):
    @functools.lru_cache(maxsize=None)
    def curve(v):
        return v**2 + 1

    def update(t, x, u, params):
        return -x + curve(u[0]) * curve(round(x[0], 3))

    return pieces(update, states=n)


@entry
def lambdas_in_a_dict(n):
    laws = {"p": lambda e: 2 * e, "pd": lambda e: 3 * e - 1}

    def update(t, x, u, params):
        return laws[params["law"]](u[0] - x)

    return pieces(update, states=n, law="pd")


@entry
def lambdas_on_one_line(n):
    # fmt: off
    update, output, unused = (lambda t, x, u, params: -2 * x), (lambda t, x, u, params: x + u[0]), (lambda t, x, u, params: x * 0)
    # fmt: on
    return pieces(update, output, states=n, outputs=n)


@entry
def the_same_lambda_twice_on_a_line(n):
    # fmt: off
    a, b = [lambda t, x, u, params, k=k: -k * x for k in (1.0, 2.0)], [lambda t, x, u, params: 5 * x]
    # fmt: on
    return pieces(a[1], b[0], states=n, outputs=n)


@entry
def late_binding_of_a_loop_variable(n):
    """All of them see the last k."""
    functions = []
    for k in (1.0, 2.0, 3.0):
        functions.append(lambda v: k * v)

    def update(t, x, u, params):
        return -functions[0](x) + functions[1](u[0])

    return pieces(update, states=n)


@entry
def default_binds_the_loop_variable(n):
    functions = [lambda v, k=k: k * v for k in (1.0, 2.0, 3.0)]

    def update(t, x, u, params):
        return -functions[0](x) + functions[2](u[0])

    return pieces(update, states=n)


@entry
def decorated_with_wraps(n):
    @helpers.squared
    def update(t, x, u, params):
        return -x + u[0]

    return pieces(update, states=n)


@entry
def decorated_with_arguments(n):
    def scaled(k):
        def decorate(function):
            @functools.wraps(function)
            def inner(*args):
                return [k * v for v in function(*args)]

            return inner

        return decorate

    @scaled(0.5)
    @scaled(3.0)
    def update(t, x, u, params):
        return list(-x + u[0])

    return pieces(update, states=n)


@entry
def wraps_another_function(n):
    """functools.wraps points at a function that is never called."""

    def shown(t, x, u, params):
        return 100 * x

    @functools.wraps(shown)
    def update(t, x, u, params):
        return -x

    return pieces(update, states=n)


@entry
def function_of_another_module(n):
    return pieces(helpers.drift, states=n, metal="copper")


@entry
def imported_helper(n):
    def update(t, x, u, params):
        return -x * saturate(u[0]) + helpers.saturate(u[1], limit=0.2) + helpers.LIMIT

    return pieces(update, states=n)


@entry
def closure_over_closure(n):
    def make(k):
        def law(e):
            return k * e

        return law

    inner, outer = make(2.0), make(0.1)

    def update(t, x, u, params):
        return -outer(inner(x)) + inner(u[0])

    return pieces(update, states=n)


@entry
def closure_variable_set_afterwards(n):
    """The value when it is called counts."""

    def update(t, x, u, params):
        return -gain * x + later(u[0])

    gain = 1.0

    def later(v):
        return 3 * v

    gain = 2.0
    return pieces(update, states=n)


@entry
def recursion_over_a_number(n):
    def power(v, k):
        return 1.0 if k == 0 else v * power(v, k - 1)

    def update(t, x, u, params):
        return -power(x, 3) + power(u[0], n)

    return pieces(update, states=n)


@entry
def recursion_over_data(n):
    def reduced(v):
        return v if abs(v) < 1 else reduced(v / 2)

    def update(t, x, u, params):
        return -x + reduced(u[0])

    return pieces(update, states=n)


@entry
def recursion_over_a_tree(n):
    tree = ("+", ("*", "x", 2.0), ("sin", "x"))

    def value(node, x):
        if node == "x":
            return x
        if isinstance(node, float):
            return node
        if node[0] == "sin":
            return np.sin(value(node[1], x))
        op = operator.add if node[0] == "+" else operator.mul
        return op(value(node[1], x), value(node[2], x))

    def update(t, x, u, params):
        return -value(tree, x) + u[0]

    return pieces(update, states=n)


@entry
def function_attribute_as_constant(n):
    def update(t, x, u, params):
        return -update.gain * x + u[0]

    update.gain = 2.2
    return pieces(update, states=n)


@entry
def map_filter_reduce(n):
    def update(t, x, u, params):
        doubled = list(map(lambda v: 2 * v, x))
        kept = list(filter(lambda v: v is not None, doubled))
        total = functools.reduce(lambda a, b: a + b * u[0], kept, 0.0)
        return [-v for v in kept] + np.array(total)

    return pieces(update, states=n)


@entry
def vectorized_function(n):
    @np.vectorize
    def dead_zone(v):
        return 0.0 if abs(v) < 0.3 else v

    def update(t, x, u, params):
        return -dead_zone(x) + u[0]

    return pieces(update, states=n)


@entry
def apply_along_axis(n):
    def update(t, x, u, params):
        m = np.outer(x, u)
        return np.apply_along_axis(lambda r: r[0] - r[1], 1, m) + np.fromiter((v for v in x), float)

    return pieces(update, states=n)


@entry
def function_as_parameter(n):
    def update(t, x, u, params):
        return -params["f"](x) + u[0]

    return pieces(update, states=n, f=np.tanh)


@entry
def memo_dictionary(n):
    """A table that fills itself: the numbers are the same whether it is full or empty."""
    memo = {}

    def update(t, x, u, params):
        key = float(u[0])
        if key not in memo:
            memo[key] = key**2
        return -x + memo[key]

    return pieces(update, states=n)
