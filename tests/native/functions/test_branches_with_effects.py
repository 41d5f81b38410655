"""Branches that change lists, arrays, objects and variables: the taken one alone does.

Functions with too many ways through them are traced with both branches at once.
"""

from __future__ import annotations

import control as ct
import numpy as np
import pytest
from user_function_checks import Plain, Points, agrees, expected

import nlctl


class Count:
    """An object that its methods change."""

    def __init__(self):
        self.n, self.q = 0.0, np.zeros(2)

    def bump(self, v):
        self.n += v
        return self.n

    @property
    def asked(self):
        self.q[0] = self.q[0] + 1
        return self.q[0]

    def __add__(self, other):
        self.q[1] += 1
        return other

    def __call__(self, v):
        self.q[0] = v
        return v


def saturated(v):
    return 1.0 if v > 1 else -1.0 if v < -1 else v


def put(values, v):
    values.append(v)
    return v


def add_to(array, v):
    array[0] += v
    return array[0]


def turn(angle):
    matrix = np.zeros((2, 2))
    matrix[0, 0] = matrix[1, 1] = np.cos(angle)
    matrix[0, 1], matrix[1, 0] = -np.sin(angle), np.sin(angle)
    return matrix


def by_a_method(x):
    count = Count()
    y = count.bump(x[0]) if x[1] > 0 else count.bump(2 * x[0])
    return count.n + y


def in_statements(x):
    count, y = Count(), 0.0
    if x[1] > 0:
        y = count.bump(x[0])
    elif x[1] > -1:
        y = x[2]
    return count.n + y


def a_list_of_another(x):
    values = [1.0]
    y = put(values, x[0]) if x[1] > 0 else x[2]
    return y + len(values) + sum(values)


def an_array_of_another(x):
    array = np.zeros(2)
    y = add_to(array, x[0]) if x[1] > 0 else x[2]
    return array[0] + y


def in_a_condition(x):
    array = np.zeros(1)
    holds = (x[0] > 1 and add_to(array, 1.0) > 0) or add_to(array, 2.0) > 10
    return array[0] + holds


def what_is_taken_out(x):
    values = [1.0, 2.0, 3.0]
    y = values.pop() if x[1] > 0 else 0.0
    return y + sum(values)


def an_iterator(x):
    values = iter([1.0, 2.0, 3.0])
    y = next(values) if x[1] > 0 else 0.0
    return y + next(values)


def a_variable_around(x):
    n = 0.0

    def up():
        nonlocal n
        n += 1
        return n

    y = up() if x[1] > 0 else 0.0
    return y + n


def another_name(x):
    array = np.zeros(2)

    def up(v):
        same = array
        same[1] = v
        return v

    y = up(x[0]) if x[1] > 0 else 0.0
    return y + array[1]


def what_was_missing(x):
    table = {"a": 1.0}
    y = table.setdefault("b", x[0]) if x[1] > 0 else table.setdefault("b", 5.0)
    return y + table["b"]


def operators_and_properties(x):
    count = Count()
    y = count.asked if x[1] > 0 else 2.0
    z = (count + x[2]) if x[1] > 0.5 else count(3.0)
    return y + count.q[0] + count.q[1] * z


def arrays_of_its_own(x):
    return turn(x[0])[0, 1] if x[1] > 0 else turn(x[2])[0, 0]


CASES = [v for v in list(globals().values()) if getattr(v, "__module__", "") == __name__
         and getattr(v, "__code__", None) and v.__code__.co_varnames[:1] == ("x",)]  # fmt: skip


@pytest.mark.parametrize("branches", CASES, ids=lambda f: f.__name__)
def test_the_branch_that_is_taken_has_its_effects_alone(branches):
    """Values are python-control's, whether it is traced or called."""

    def update(t, x, u, params):
        many = [saturated(v) for v in x]  # more ways than are followed one by one
        return [v + branches(x) for v in many]

    system = ct.nlsys(update, None, states=8, inputs=1, outputs=8, name="block")
    compiled = nlctl.compile(system)
    rng = np.random.default_rng(5)
    x = rng.normal(size=(8, 40)) * np.resize([0.5, 2.0], (8, 1))
    x[:, 0], x[:, 1] = 0.0, 1.0
    at = Points(np.zeros(40), x, np.zeros((1, 40)))
    rates, _ = Plain(compiled).run(at)
    for lane in range(40):
        want, _ = expected(system, at.at(lane))
        assert agrees(rates[:, lane], want), at.x[:, lane]


@pytest.mark.parametrize("branches", CASES, ids=lambda f: f.__name__)
def test_they_become_expressions(branches):
    """A branch with effects is followed on its own, all others at once."""

    def update(t, x, u, params):
        return [saturated(v) + branches(x) for v in x]

    system = ct.nlsys(update, None, states=8, inputs=1, outputs=8, name="block")
    assert not nlctl.compile(system).equations.calls
