"""Dicts in functions: updated by parameters, asked by members of enumerations, in an order."""

from collections import Counter, OrderedDict, defaultdict
from enum import Enum

import control as ct
import numpy as np
import pytest
from user_function_checks import Plain, Points, agrees, expected

import nlctl
from nlctl.errors import CompileError

ORDER = OrderedDict(b=2.0, a=1.0)
RATES, NUMBERS = defaultdict(float, first=0.5, second=0.3), Counter("abb")
MATRIX = np.array([[1.0, 2.0], [3.0, 4.0]])
SEEN = {"values": [], "set": set()}


class Phase(Enum):
    CLIMB = 1
    DESCENT = 2


class Pilot:
    """Has what it does in each phase in a dict."""

    def __init__(self):
        self.laws = {Phase.CLIMB: self.climb, Phase.DESCENT: self.descend}

    def climb(self, x):
        return 1.0 - x

    def descend(self, x):
        return -2.0 * x

    def phase(self, h):
        if h > 0.5:
            return Phase.DESCENT
        return Phase.CLIMB

    def update(self, t, x, u, params):
        return self.laws[self.phase(x[0])](x)


def updated(t, x, u, params):
    k = {"k": 1.0, "other": 2.0}
    k.update(params)
    rate = k["k"]
    rate *= x[0]
    return rate - k["other"] * x


def updated_by_pairs(t, x, u, params):
    k = dict.fromkeys("ab", 1.0)
    k.update(zip("ab", x, strict=True), c=params["k"])
    rate = k["a"]
    rate += k["c"]
    return rate - x * k["b"]


def in_order(t, x, u, params):
    rates = [v * ORDER[k] * i for i, (k, v) in enumerate(zip(ORDER, x, strict=True))]
    return sum(rates) - x * sum(RATES[k] for k in RATES) + sum(NUMBERS[k] for k in NUMBERS)


@pytest.mark.parametrize("update", [Pilot().update, updated, updated_by_pairs, in_order])
def test_what_is_in_a_dict_is_followed(update):
    system = ct.nlsys(update, None, states=2, inputs=0, outputs=2, params={"k": 2.0}, name="block")
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    at = Points(np.zeros(9), np.random.default_rng(1).normal(size=(2, 9)), np.zeros((0, 9)))
    rates, _ = Plain(compiled).run(at)
    for lane in range(9):
        assert agrees(rates[:, lane], expected(system, at.at(lane))[0])


def of_arrays(t, x, u, params):
    k = {}
    k.update(a=MATRIX)
    k["a"] *= 2.0
    return -k["a"][0, 0] * x


def of_a_dict_of_arrays(t, x, u, params):
    k = {}
    k.update({"a": MATRIX})
    rate = k["a"]
    rate *= 2.0
    return -rate[0, 0] * x


@pytest.mark.parametrize("update", [of_arrays, of_a_dict_of_arrays])
def test_arrays_of_others_are_not_changed_by_way_of_a_dict(update):
    with pytest.raises(CompileError, match="changes"):
        nlctl.compile(ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="block"))


def appended(t, x, u, params):
    SEEN["values"].append(x[0])
    return -x


def added(t, x, u, params):
    SEEN["set"].add(t)
    return -x


@pytest.mark.parametrize("update", [appended, added])
def test_what_a_function_records_is_an_output(update):
    with pytest.raises(CompileError, match="an output of the block") as error:
        nlctl.compile(ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="block"))
    assert "test_native_purity_dicts.py, line" in str(error.value)
