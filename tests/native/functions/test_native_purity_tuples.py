"""What named tuples do by themselves is read: properties, operators, and how they are made."""

from typing import NamedTuple

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError, UsageError

SCALE = 1.0
SEEN = []


class Value(NamedTuple):
    """Numbers whose size depends on what stands outside."""

    a: float

    @property
    def scaled(self):
        return self.twice() * SCALE / 2

    def twice(self):
        return 2 * self.a

    def __add__(self, other):
        return Value(self.a + other.a * SCALE)

    def __neg__(self):
        return Value(-self.a * SCALE)

    def __abs__(self):
        return self.a * SCALE

    def __matmul__(self, other):
        return self.a * SCALE

    def __bool__(self):
        return SCALE < 1.5


class Heir(Value):
    """Has them from its parent."""


class Noted(NamedTuple):
    a: float

    @property
    def seen(self):
        SEEN.append(self.a)
        return self.a


class Grown(NamedTuple("Plain", [("a", float)])):
    def __new__(cls, a):
        return super().__new__(cls, a * SCALE)


class Plain2(NamedTuple):
    a: float
    b: float = 2.0

    @property
    def product(self):
        return self.a * self.b


OUTSIDE = {  # all are -x
    "a property": lambda x: -Value(x[0]).scaled,
    "of a parent": lambda x: -Heir(x[0]).scaled,
    "in a list": lambda x: -sum([Value(v).scaled for v in x]),
    "replaced": lambda x: -Value(0.0)._replace(a=x[0]).scaled,
    "unpacked arguments": lambda x: -Value(*x).scaled,
    "a sum": lambda x: -(Value(0.0) + Value(x[0])).a,
    "a sign": lambda x: (-Value(x[0])).a,
    "abs": lambda x: -abs(Value(x[0])),
    "@": lambda x: -(Value(x[0]) @ Value(x[0])),
    "truth": lambda x: -x[0] if Value(x[0]) else -2 * x[0],
}


def decay(rate):
    def update(t, x, u, params):
        return [rate(x)]

    return ct.nlsys(update, None, states=1, inputs=0, outputs=1, name="decay")


def end(system):
    return nlctl.input_output_response(system, [0, 1], 0, [1.0]).states[0, -1]


@pytest.mark.parametrize("name", OUTSIDE)
def test_what_they_read_from_outside_is_watched(name, monkeypatch):
    compiled = nlctl.compile(decay(OUTSIDE[name]))
    assert end(compiled) == pytest.approx(np.exp(-1), rel=1e-5)
    monkeypatch.setitem(globals(), "SCALE", 2.0)
    with pytest.raises(UsageError, match=r"'SCALE' was 1.0 when"):
        end(compiled)


@pytest.mark.parametrize("rate", [lambda x: -Noted(x[0]).seen, lambda x: -Grown(x[0]).a])
def test_side_effects_and_makers_are_refused(rate):
    with pytest.raises(CompileError, match="cannot be compiled"):
        nlctl.compile(decay(rate))


def test_plain_ones_are_traced():
    compiled = nlctl.compile(decay(lambda x: -Plain2(x[0]).product * 0.5))
    assert "Jacobian     exact" in str(compiled)
    assert end(compiled) == pytest.approx(np.exp(-1), rel=1e-5)


class Moving(NamedTuple):
    """A state that makes the next of itself."""

    a: float
    b: float = 0.0

    def rate(self, force):
        return self._replace(a=self.b, b=force - self.a).halved()

    def halved(self):
        return Moving(*(v / 2 for v in self._asdict().values()))


class Recording(Moving):
    def _replace(self, **new):
        SEEN.append(new)
        return super()._replace(**new)


def test_a_method_makes_another_by_replacing_fields():
    system = ct.nlsys(lambda t, x, u, params: list(Moving(*x).rate(np.tanh(x[1]))), None,
                      states=2, inputs=0, outputs=2, name="block")  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    for x in ([0.3, -2.0], [1.0, 0.5]):
        want = [x[1] / 2, (np.tanh(x[1]) - x[0]) / 2]
        np.testing.assert_allclose(system.dynamics(0, np.array(x), []), want, rtol=1e-14)
        np.testing.assert_allclose(compiled.dynamics(0, x, []), want, rtol=1e-12)


def test_what_an_heir_replaces_is_walked():
    system = ct.nlsys(lambda t, x, u, params: list(Recording(*x).rate(1.0)), None,
                      states=2, inputs=0, outputs=2, name="block")  # fmt: skip
    with pytest.raises(CompileError):
        nlctl.compile(system)
