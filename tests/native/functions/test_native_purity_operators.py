"""What operators and functions of Python ask the classes of objects; attributes that are found."""

import copy
import functools
import math
import operator

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError, UsageError


class Amount:
    def __init__(self, v):
        self.v = v

    def __float__(self):
        return float(self.v)

    def __int__(self):
        return int(self.v)

    def __round__(self, n=None):
        return round(self.v, n)

    def __add__(self, other):
        return Amount(self.v + getattr(other, "v", other))

    __radd__ = __add__

    def __lt__(self, other):
        return self.v < other.v

    def __gt__(self, other):
        return self.v > other.v


@functools.total_ordering
class Job:
    def __init__(self, urgency, force):
        self.urgency, self.force = urgency, force

    def __eq__(self, other):
        return self.urgency == other.urgency

    def __lt__(self, other):
        return self.urgency < other.urgency

    __hash__ = None


class Row:
    def __init__(self, numbers):
        self.numbers = numbers

    def __contains__(self, v):
        return v in self.numbers

    def __getitem__(self, k):
        return self.numbers[k]

    def __len__(self):
        return len(self.numbers)

    def __reversed__(self):
        return reversed(self.numbers)


class Counted:
    def __init__(self, end):
        self.end, self.k = end, 0

    def __iter__(self):
        return self

    def __next__(self):
        if self.k >= self.end:
            raise StopIteration
        self.k += 1
        return self.k


class Named:
    """A state whose parts are found by their names."""

    _names = ("position", "speed")

    def __init__(self, x):
        self._x = x

    def __getattr__(self, name):
        try:
            return self._x[self._names.index(name)]
        except ValueError:
            raise AttributeError(name) from None


class Values:
    def __init__(self, values):
        self._values = values

    def __getattr__(self, name):
        return self._values[name]


class Restless:
    """An object that is another after each question."""

    def __init__(self):
        self.n = 0

    def grown(self, *_):
        self.n += 1
        return float(self.n)

    __float__ = __round__ = __getattr__ = grown

    def __contains__(self, v):
        return self.grown() > 3

    def __lt__(self, other):
        return self.grown() > 3

    def __radd__(self, other):
        return self.grown()


class Vector:
    def __init__(self, *parts):
        self.parts = np.array(parts)

    def __array__(self, dtype=None, copy=None):
        return self.parts


class Pair:
    def __init__(self, *parts):
        self.parts = parts

    def __len__(self):
        return len(self.parts)

    def __getitem__(self, k):
        return self.parts[k]


class Held(Vector):
    def __init__(self, parts):
        self.parts = parts


def shared_array(t, x, u, p):
    vector = Vector(*x)
    as_it_is, left_to_it = np.asarray(vector), np.array(vector)
    as_it_is[0] = 3.0 * x[1]
    left_to_it[1] += 1.0  # of which it makes no copy, so that NumPy has none either
    return -vector.parts


def array_of_the_state(t, x, u, p):
    whole = np.array(Held(x))
    whole[0] = 1.0
    return -x


class Agreeing:
    """An object that is equal to anything, and another after each call."""

    __hash__ = None

    def __eq__(self, other):
        return True

    def __call__(self, v):
        LOG[0] += 1.0
        return v * LOG[0]


class Logging(Counted):
    """An iterator that counts how often all of its kind are asked."""

    def __init__(self):
        super().__init__(2)

    def __next__(self):
        LOG[0] += 1.0
        return super().__next__() * LOG[0]


class Rows:
    def __init__(self, x):
        self.x = x

    def __iter__(self):
        return iter(self.x.reshape(2, 1))


def doubled(values):
    values *= 2.0
    return values


def first_of(values):
    first, *others = values
    return first + 0.1 * len(others)


LOG, UNITS, AGREEING = [0.0], Vector(1.0, 0.5), Agreeing()
JOBS = [Job(1.0, 2.0), Job(3.0, 0.5)]
ROW, VALUES, RESTLESS = Row([1.0, 2.0, 0.5]), Values({"k": 2.0, "c": 0.3}), Restless()
LEGAL = {
    "float": lambda t, x, u, p: [float(Amount(x[0])) - x[0] * 2],
    "int": lambda t, x, u, p: [int(Amount(3.0 * x[0])) * 0.1 - x[0]],
    "round": lambda t, x, u, p: [round(Amount(x[0])) - x[0]],
    "sum": lambda t, x, u, p: [-sum((Amount(k * x[0]) for k in range(3)), Amount(0.0)).v],
    "sum from nothing": lambda t, x, u, p: [-sum([Amount(x[0]), Amount(x[1])]).v],
    "max": lambda t, x, u, p: [-max(Amount(x[0]), Amount(x[1])).v],
    "min": lambda t, x, u, p: [-min([Amount(x[0]), Amount(x[1])]).v],
    "sorted": lambda t, x, u, p: [-a.v for a in sorted([Amount(x[0]), Amount(x[1])])],
    "by numbers": lambda t, x, u, p: [-min([Amount(x[0]), Amount(x[1])], key=float).v],
    "total ordering": lambda t, x, u, p: [max([Job(x[0], 1.0), Job(x[1], 2.0)]).force - x[0]],
    "in": lambda t, x, u, p: [-x[0] * (2.0 if 2.0 in ROW else 1.0)],
    "in what is gone through": lambda t, x, u, p: [-x[0] * (2.0 if 3 in Counted(3) else 1.0)],
    "truth": lambda t, x, u, p: [-x[0] if ROW else 0.0, -x[1] if not Row([]) else 1.0],
    "reversed": lambda t, x, u, p: [sum(k * a for k, a in enumerate(reversed(ROW))) - x[0]],
    "found by names": lambda t, x, u, p: [Named(x).speed, -Named(x).position],
    "found in a dict": lambda t, x, u, p: [x[1], -VALUES.k * x[0] - VALUES.c * x[1]],
}
TIMES = {0.0: 1.0, 0.2: -1.0, 0.4: 2.0}
LEGAL |= {
    "attributes by names": lambda t, x, u, p: [
        sum(f * v for f, v in map(operator.attrgetter("force", "urgency"), JOBS)) - x[0]
    ],
    "order by an attribute": lambda t, x, u, p: [
        max(JOBS, key=operator.attrgetter("urgency")).force - x[0]
    ],
    "greatest that is left": lambda t, x, u, p: [TIMES[max(k for k in TIMES if k <= t)] - x[0]],
    "first that is left": lambda t, x, u, p: [first_of([v for k, v in TIMES.items() if k <= t])],
    "objects that are left": lambda t, x, u, p: [
        (near[0].force if (near := [job for job in JOBS if job.urgency < 2 + t]) else 1.0) - x[0]
    ],
    "next": lambda t, x, u, p: [-next(iter(Counted(2))) * x[0] + next(Counted(0), 1.0)],
    "list": lambda t, x, u, p: [-sum(list(Counted(3))) * x[0]],
    "array": lambda t, x, u, p: -np.array(Vector(*x)) + np.asarray(UNITS),
    "array that is shared": shared_array,
    "array of a list": lambda t, x, u, p: -np.array(Pair(x[1], x[0])) + np.array(Pair(1.0, 2.0)),
    "copy of a dict of numbers": lambda t, x, u, p: [copy.deepcopy({**TIMES, 0.0: x[1]})[0.0]],
}
REFUSED = {
    "float": lambda t, x, u, p: [-x[0] * float(RESTLESS)],
    "round": lambda t, x, u, p: [-x[0] * round(RESTLESS)],
    "in": lambda t, x, u, p: [-x[0] if 1.0 in RESTLESS else x[0]],
    "min": lambda t, x, u, p: [-x[0] if min(RESTLESS, RESTLESS) is None else x[0]],
    "attribute": lambda t, x, u, p: [-x[0] * RESTLESS.gain],
    "start of a sum": lambda t, x, u, p: [-x[0] * sum([1.0], start=RESTLESS)],
    "array": array_of_the_state,
    "call of what equals all": lambda t, x, u, p: [-AGREEING(1.0) * x[0]],
    "sum of nothing": lambda t, x, u, p: -doubled(sum([], x)),
    "rows": lambda t, x, u, p: -doubled(list(Rows(x))[1]),
    "loop": lambda t, x, u, p: [-x[0] * sum(k for k in Logging())],
    "list": lambda t, x, u, p: [-x[0] * list(Logging())[1]],
    "next": lambda t, x, u, p: [-x[0] * next(Logging())],
    "taken apart": lambda t, x, u, p: [-x[0] * k for k in [*Logging()]],
}


def block(update):
    return ct.nlsys(update, lambda t, x, u, p: x, inputs=0, outputs=2, states=2, name="s")


def padded(update):
    def both(t, x, u, p):
        return (list(update(t, x, u, p)) + [-x[1]])[:2]

    return both


@pytest.mark.parametrize("name", LEGAL)
def test_what_objects_are_asked_is_traced(name):
    system = block(padded(LEGAL[name]))
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    times = np.linspace(0.0, 0.5, 6)
    run = nlctl.input_output_response(compiled, times, X0=[1.3, 0.4])
    how = {"rtol": 1e-10, "atol": 1e-12, "max_step": 0.01}
    plain = ct.input_output_response(system, times, X0=[1.3, 0.4], solve_ivp_kwargs=how)
    np.testing.assert_allclose(run.y, plain.y, rtol=1e-5)


@pytest.mark.parametrize("name", REFUSED)
def test_an_object_that_counts_what_it_is_asked_is_refused(name):
    with pytest.raises(CompileError, match=r"test_native_purity_operators.py, line"):
        nlctl.compile(block(padded(REFUSED[name])))


def test_what_an_object_finds_is_looked_for_again_before_each_run():
    values = Values({"k": 2.0})
    system = block(lambda t, x, u, p: [x[1], -values.k * x[0]])
    compiled, times = nlctl.compile(system), np.linspace(0.0, math.pi, 5)
    first = nlctl.input_output_response(compiled, times, X0=[1.0, 0.0])
    np.testing.assert_allclose(first.y[0], np.cos(math.sqrt(2.0) * times), atol=1e-6)
    values.k = 1.0  # now it is an attribute
    with pytest.raises(UsageError, match="'k' was absent"):
        nlctl.input_output_response(compiled, times, X0=[1.0, 0.0])
    again = nlctl.input_output_response(nlctl.compile(system), times, X0=[1.0, 0.0])
    np.testing.assert_allclose(again.y[0], np.cos(times), atol=1e-6)
