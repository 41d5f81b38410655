"""An array that a library hands on is whose it was: what writes into it is refused."""

import collections
import heapq
import operator
import types

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError

ROW = np.array([1.0, 2.0])
ROWS = [ROW, np.array([3.0, 4.0])]
NAMED = {"a": ROW}


def written(row, x):
    """Write into an array, and return what depends on it."""
    row[0] += 1.0
    return -x * row[0]


HANDED_ON = {
    "getitem": lambda t, x, u, p: written(operator.getitem(ROWS, 0), x),
    "nlargest": lambda t, x, u, p: written(heapq.nlargest(1, ROWS, key=sum)[0], x),
    "merge": lambda t, x, u, p: written(next(heapq.merge(ROWS[:1])), x),
    "asmatrix": lambda t, x, u, p: written(np.asmatrix(ROW).A1, x),
    "frombuffer": lambda t, x, u, p: written(np.frombuffer(ROW), x),
    "require": lambda t, x, u, p: written(np.require(ROW), x),
    "masked": lambda t, x, u, p: written(np.ma.array(ROW), x),
    "split": lambda t, x, u, p: written(np.split(ROW, 1)[0], x),
    "split of states": lambda t, x, u, p: written(np.array_split(x, 2)[0], x),
    "meshgrid": lambda t, x, u, p: written(np.meshgrid(ROW, ROW, copy=False)[0], x),
    "einsum": lambda t, x, u, p: written(np.einsum("i->i", ROW), x),
    "astype": lambda t, x, u, p: written(ROW.astype(float, copy=False), x),
    "sum of lists": lambda t, x, u, p: written(([] + ROWS)[0], x),
    "list several times": lambda t, x, u, p: written((ROWS * 2)[0], x),
    "union of dicts": lambda t, x, u, p: written(({} | NAMED)["a"], x),
    "proxy": lambda t, x, u, p: written(types.MappingProxyType(NAMED)["a"], x),
    "factory": lambda t, x, u, p: written(collections.defaultdict(lambda: ROW)["b"], x),
    "third argument": lambda t, x, u, p: -x * np.add(ROW, 1.0, ROW),
    "out of a tuple": lambda t, x, u, p: -x * np.add(ROW, 1.0, out=(ROW,)),
    "in place": lambda t, x, u, p: -x * np.nan_to_num(ROW, copy=False),
}

MADE = {
    "getitem": lambda t, x, u, p: written(operator.getitem([x.copy(), ROW + 1.0], 0), x),
    "split": lambda t, x, u, p: written(np.split(x.copy(), 1)[0], x),
    "sum of lists": lambda t, x, u, p: written(([] + [x.copy()])[0], x),
    "factory": lambda t, x, u, p: written(collections.defaultdict(lambda: np.ones(2))["b"], x),
    "third argument": lambda t, x, u, p: -x * np.add(ROW, 1.0, np.zeros(2)),
    "parts of states": lambda t, x, u, p: np.concatenate([-2.0 * v for v in np.split(x, 2)]),
}


def system(update):
    """A block of two states."""
    return ct.nlsys(update, None, states=2, inputs=1, outputs=2, name="s")


@pytest.mark.parametrize("name", HANDED_ON)
def test_what_a_library_hands_on_is_not_written_into(name):
    with pytest.raises(CompileError, match=r"did not make|changes an element|written into"):
        nlctl.compile(system(HANDED_ON[name]))


@pytest.mark.parametrize("name", MADE)
def test_what_a_call_has_made_is_its_own(name):
    """Each value is python-control's."""
    made = system(MADE[name])
    compiled = nlctl.compile(made)
    for x in ([0.5, -1.0], [2.0, 3.0]):
        np.testing.assert_allclose(compiled.dynamics(0.0, x, [0.0]), made.dynamics(0.0, x, [0.0]))
