"""Objects of which one is chosen: their methods are read, whatever these are called."""

import functools
import itertools
import operator

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError


class Kept:
    """What its methods change has the names that arrays' methods have, too."""

    def __init__(self, k):
        self.k, self.n, self.buffer, self.log = k, 0, np.zeros(2), []

    def count(self):
        self.n += 1
        return self.n

    def mean(self):
        self.buffer[0] += 1.0
        return self.buffer[0]

    def copy(self):
        self.log.append(self.k)
        return len(self.log)

    @property
    def counted(self):
        return self.mean()

    def __add__(self, other):
        return self.mean() + other

    def scaled(self, v):
        return self.k * v


def appended(x):
    parts = [x, np.eye(2)]
    parts.append(A)
    return parts[2]


def put_in(x):
    parts, more = [x, np.eye(2)], [[]]
    more[0].extend([A, x])
    parts[1:] = more[0]
    return parts[1]


A, B = Kept(1.0), Kept(2.0)
MANY = [Kept(k) for k in range(70)]
BY_NUMBER = dict(enumerate(MANY))
CHANGING = {
    "by a condition": lambda x: (A if x[0] > 0 else B).mean() * x,
    "in a list made here": lambda x: [A, B][0].count() * x,
    "next to a number": lambda x: [A, 1.0][0].copy() * x,
    "in a dict made here": lambda x: {"a": A, "b": B}["a"].mean() * x,
    "gone through": lambda x: sum(one.copy() for one in (A, B)) * x,
    "of many": lambda x: MANY[int(abs(x[0])) % 70].count() * x,
    "of many in a dict": lambda x: sum(one.mean() for one in BY_NUMBER.values()) * x,
    "the largest": lambda x: max(MANY, key=lambda one: one.k).count() * x,
    "in order": lambda x: sorted([A, B], key=lambda one: one.k)[0].mean() * x,
    "the next one": lambda x: next(iter(MANY)).copy() * x,
    "by itertools": lambda x: next(itertools.chain(MANY, MANY)).count() * x,
    "by operator": lambda x: operator.itemgetter(0)(MANY).mean() * x,
    "filtered": lambda x: sum(o.mean() for o in filter(lambda o: o.k > 1, [A, B])) * x,
    "appended to arrays": lambda x: appended(x).count() * x,
    "put among arrays": lambda x: put_in(x).count() * x,
    "a property of the next one": lambda x: next(iter(MANY)).counted * x,
    "a sum with one of many": lambda x: (operator.itemgetter(3)(MANY) + 1.0) * x,
    "folded": lambda x: functools.reduce(lambda a, b: b, [A, B]).mean() * x,
}


def compiled(function):
    update = lambda t, x, u, params: function(x)  # noqa: E731
    return nlctl.compile(ct.nlsys(update, None, inputs=0, outputs=2, states=2, name="s"))


@pytest.mark.parametrize("way", CHANGING)
def test_what_a_method_changes_is_seen(way):
    with pytest.raises(CompileError, match="cannot be compiled"):
        compiled(CHANGING[way])


GAINS = [np.array([[1.0, 0.5], [0.2, -1.0]]), np.array([[0.0, 1.0], [2.0, 0.3]])]
REGIONS = [(np.array([1.0, 0.5]), GAINS[0], 0.2), (np.array([-1.0, 0.5]), GAINS[1], -0.2)]
PLAIN = {
    "an attribute": lambda x: (A if x[0] > 0 else B).k * x,
    "a method": lambda x: (A if x[0] > 0 else B).scaled(x),
    "objects gone through": lambda x: sum(one.scaled(x) for one in (A, B)),
    "of a list of arrays": lambda x: GAINS[int(x[0] > 0)].dot(x),
    "rows of arrays": lambda x: next(M for h, M, _ in REGIONS if h.dot(x) >= -9).dot(x),
    "one of a list of arrays": lambda x: [*GAINS, x][int(x[0] > 0)].dot(x),
    "rows of numbers": lambda x: x * sum(h.sum() + g for h, _, g in REGIONS),
}


@pytest.mark.parametrize("way", PLAIN)
def test_what_changes_nothing_is_traced(way):
    assert not compiled(PLAIN[way]).equations.calls
