"""Objects that a key chooses, that are gone through, methods of tuples: what they do is read."""

import math
import warnings
from typing import NamedTuple

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError, UsageError

SEEN = []
SCALE = 2.0
COUNT = {"n": 0}


class Spring:
    """A force, and one that remembers how often it was asked."""

    def __init__(self, stiffness):
        self.stiffness, self.asked = stiffness, 0

    def force(self, x):
        return -self.stiffness * math.tanh(x)

    def scaled(self, x):
        return -SCALE * x

    def counted(self, x):
        self.asked += 1
        return -x * self.asked


class Damper(Spring):
    def force(self, x):
        return -self.stiffness * x * abs(x)


PARTS = {"front": Spring(3.0), "rear": Damper(2.0)}
ROW = [Spring(1.0), Damper(4.0)]


class Row:
    """What goes through it reads a list, or notes that somebody does."""

    def __init__(self, *gains):
        self.gains = list(gains)

    def __iter__(self):
        return iter(self.gains)


class Noted(Row):
    def __iter__(self):
        COUNT.update(n=COUNT["n"] + 1)
        return iter(self.gains)


class Emptied(Row):
    def __iter__(self):
        while self.gains:
            yield self.gains.pop()


GAINS, NOTED, EMPTIED = Row(1.0, 2.0), Noted(1.0, 2.0), Emptied(1.0, 2.0)


class Point(NamedTuple):
    """A place, turned, scaled by what stands outside, or noted."""

    x: float
    y: float

    def turned(self, angle):
        c, s = math.cos(angle), math.sin(angle)
        return Point(self.x * c - self.y * s, self.x * s + self.y * c)

    def scaled(self):
        return SCALE * self.x

    def noted(self):
        SEEN.append(self.x)
        return self.x

    @property
    def size(self):
        return math.hypot(*self)


def by_key(x):
    return [PARTS[key].force(value) for key, value in zip(("rear", "front"), x, strict=True)]


def by_place(x):
    return [ROW[0 if x[0] > 0 else 1].force(x[0]), -x[1]]


def gone_through(x):
    return [-gain * value for gain, value in zip(GAINS, x, strict=True)]


def totalled(x):
    return [-sum(GAINS) * x[0], -list(GAINS)[1] * x[1]]


def turned_twice(x):
    place = Point(*x).turned(0.3).turned(0.4)
    return [-place.x, -place.y * Point(*x).size]


def without_warnings(x):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return list(-np.sqrt(np.abs(x)))


FOLLOWED = [by_key, by_place, gone_through, totalled, turned_twice, without_warnings]


def diagram(function):
    return ct.nlsys(lambda t, x, u, p: function(x), None, inputs=0, outputs=2, states=2, name="s")


@pytest.mark.parametrize("function", FOLLOWED)
def test_what_is_followed_has_the_values_of_the_function_itself(function):
    compiled, rng = nlctl.compile(diagram(function)), np.random.default_rng(2)
    assert not compiled.equations.calls
    for x in rng.normal(size=(40, 2)) * 3:
        assert compiled.dynamics(0.0, x) == pytest.approx(function(x), rel=1e-14, abs=1e-14)


def warned(x):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        SEEN.append(1)
    return list(-x)


def settings_for_everybody(x):
    warnings.simplefilter("ignore")
    return list(-x)


def records_of_warnings(x):
    with warnings.catch_warnings(record=True) as found:
        return [-x[0], len(found) - x[1]]


REFUSED = {
    "a method that a key chooses": lambda x: [PARTS[k].counted(v) for k, v in zip(PARTS, x)],  # noqa: B905
    "a method that a place chooses": lambda x: [ROW[0 if x[0] > 0 else 1].counted(x[0]), -x[1]],
    "an iterator that notes": lambda x: [-gain * v for gain, v in zip(NOTED, x, strict=True)],
    "a sum that notes": lambda x: [-sum(NOTED) * x[0], -x[1]],
    "an iterator that uses up": lambda x: [-sum(EMPTIED) * x[0], -x[1]],
    "a tuple's method that notes": lambda x: [-Point(*x).noted(), -x[1]],
    "what is between warnings": warned,
    "which warnings are shown": settings_for_everybody,
    "warnings that are kept": records_of_warnings,
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_remembers_or_changes_is_refused(name):
    with pytest.raises(CompileError):
        nlctl.compile(diagram(REFUSED[name]))
    assert SEEN == []
    assert COUNT == {"n": 0}
    assert [part.asked for part in (*PARTS.values(), *ROW)] == [0, 0, 0, 0]
    assert EMPTIED.gains == [1.0, 2.0]


READING = {
    "a chosen method": lambda x: [PARTS[k].scaled(v) for k, v in zip(PARTS, x)],  # noqa: B905
    "a tuple's method": lambda x: [-Point(*x).scaled(), -x[1]],
}


@pytest.mark.parametrize("name", READING)
def test_what_such_a_method_reads_outside_is_watched(name, monkeypatch):
    compiled = nlctl.compile(diagram(READING[name]))
    assert np.isfinite(compiled.dynamics(0.0, [1.0, 2.0])).all()
    monkeypatch.setitem(globals(), "SCALE", 3.0)
    with pytest.raises(UsageError, match="SCALE"):
        compiled.dynamics(0.0, [1.0, 2.0])


def test_an_attribute_of_a_chosen_object_is_watched(monkeypatch):
    compiled = nlctl.compile(diagram(by_key))
    assert np.isfinite(compiled.dynamics(0.0, [1.0, 2.0])).all()
    monkeypatch.setattr(PARTS["front"], "stiffness", 5.0)
    with pytest.raises(UsageError, match="stiffness"):
        compiled.dynamics(0.0, [1.0, 2.0])


def test_a_list_that_is_gone_through_is_watched(monkeypatch):
    compiled = nlctl.compile(diagram(gone_through))
    assert np.isfinite(compiled.dynamics(0.0, [1.0, 2.0])).all()
    monkeypatch.setattr(GAINS, "gains", [7.0, 2.0])
    with pytest.raises(UsageError):
        compiled.dynamics(0.0, [1.0, 2.0])
