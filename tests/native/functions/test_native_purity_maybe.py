"""None or an object, defaults of what finds nothing, functions by names that are put together."""

import math

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError


class Stage:
    def __init__(self, begin, end, thrust):
        self.begin, self.end, self.thrust = begin, end, thrust

    def burns(self, t):
        return self.begin <= t < self.end

    def force(self, v):
        return self.thrust / (1 + abs(v))


class Counting:
    """An object that is another after each question."""

    def __init__(self):
        self.n = 0

    def __bool__(self):
        self.n += 1
        return True

    def __getitem__(self, k):
        self.n += 1
        return float(self.n)


class Laws:
    gain = 2.0

    @staticmethod
    def law_low(v):
        return 2 * v

    @staticmethod
    def law_high(v):
        return math.atan(v)

    @classmethod
    def law_mid(cls, v):
        return cls.gain * v

    @staticmethod
    def other(v):
        print(v)


STAGES = [Stage(0.0, 0.5, 3.0), Stage(0.7, 2.5, 2.0)]
IDLE = Stage(0.0, 9.0, 0.1)
COUNTING = Counting()


def next_or_none(t, x, u, p):
    stage = next((s for s in STAGES if s.burns(t)), None)
    return [stage.force(x[0]) - x[0] if stage is not None else -x[0]]


def next_or_another(t, x, u, p):
    stage = next((s for s in STAGES if s.burns(1.0 + 0.1 * x[0])), IDLE)
    return [stage.force(x[0]) - x[0]]


def last_of_a_loop(t, x, u, p):
    burning = None
    for stage in STAGES:
        if stage.burns(t):
            burning = stage
    if not burning:
        return [-x[0]]
    return [burning.force(x[0]) - x[0]]


def greatest_or_none(t, x, u, p):
    stage = max((s for s in STAGES if s.begin >= 0), key=lambda s: s.thrust, default=None)
    return [(stage and stage.force(x[0])) - x[0]]


def own_object_or_none(t, x, u, p):
    stage = Stage(0.0, 1.0, 2.0) if t < 0.5 else None
    return [(stage.force(x[0]) if stage else 0.5) - x[0]]


def function_of_a_class(t, x, u, p):
    return [-getattr(Laws, "law_" + ("high" if x[0] > 1 else "low"))(x[0])]


def function_of_a_class_by_parameter(t, x, u, p):
    return [-getattr(Laws, f"law_{p['kind']}")(x[0])]


def function_of_a_module(t, x, u, p):
    name = "a" + ("tan" if x[0] < 9 else "sinh")
    return [-getattr(np, f"arc{name[1:]}")(x[0])]


def number_of_an_iterator(t, x, u, p):
    rows = iter(x.reshape(1, 1))
    v = next(rows)[0]
    v += 1.0
    return [-v]


LEGAL = [
    next_or_none, next_or_another, last_of_a_loop, greatest_or_none, own_object_or_none,
    function_of_a_class, function_of_a_class_by_parameter, function_of_a_module,
    number_of_an_iterator,
]  # fmt: skip


@pytest.mark.parametrize("update", LEGAL, ids=lambda f: f.__name__)
def test_what_may_be_none_and_what_texts_name_is_traced(update):
    system = ct.nlsys(update, None, inputs=0, outputs=1, states=1, params={"kind": "mid"})
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    times = np.linspace(0.0, 1.0, 11)
    run = nlctl.input_output_response(compiled, times, X0=[1.5])
    how = {"rtol": 1e-10, "atol": 1e-12, "max_step": 0.01}
    plain = ct.input_output_response(system, times, X0=[1.5], solve_ivp_kwargs=how)
    np.testing.assert_allclose(run.y, np.atleast_2d(plain.y), rtol=1e-4)


def default_of_next(t, x, u, p):
    r = next(iter([]), x)
    r *= 2.0
    return -x


def default_of_max(t, x, u, p):
    r = max([], default=x)
    r *= 2.0
    return -x


def truth_that_counts(t, x, u, p):
    thing = None if t < 0 else COUNTING
    return -x * COUNTING.n if thing else -x


def first_that_counts(t, x, u, p):
    thing = None if t < 0 else COUNTING
    return -x * (thing and COUNTING.n)


def items_that_count(t, x, u, p):
    thing = None if t < 0 else COUNTING
    return -x * thing[0]


def writes_where_there_is_none(t, x, u, p):
    stage = Stage(0.0, 1.0, 2.0) if t < -1 else None
    if isinstance(stage, Stage):
        return -x
    x[0] = 3.0
    return -x


def any_function_of_a_class(t, x, u, p):
    return [getattr(Laws, str(p["kind"]))(x[0])]


REFUSED = [
    default_of_next, default_of_max, truth_that_counts, first_that_counts, items_that_count,
    writes_where_there_is_none, any_function_of_a_class,
]  # fmt: skip


@pytest.mark.parametrize("update", REFUSED, ids=lambda f: f.__name__)
def test_what_comes_from_elsewhere_after_all_is_refused(update):
    system = ct.nlsys(update, None, inputs=0, outputs=1, states=1, params={"kind": "other"})
    with pytest.raises(CompileError, match=r"test_native_purity_maybe.py, line"):
        nlctl.compile(system)


PLACES = ([0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0, 1.0, 2.0, 2.0],
          [0.0, 1.0, 1.0, 1.0, 2.0])  # fmt: skip


@pytest.mark.parametrize("how", [{}, {"left": 7.0, "right": 8.0}, {"period": 2.0}], ids=str)
@pytest.mark.parametrize("places", PLACES, ids=str)
def test_a_table_jumps_where_a_place_comes_twice(places, how):
    values = [3.0, -1.0, 2.0, 0.5, 4.0, 1.0][: len(places)]
    system = ct.nlsys(
        lambda t, x, u, p: [0.0], lambda t, x, u, p: np.interp(u, places, values, **how),
        inputs=1, outputs=1, states=1,
    )  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    times = np.linspace(0.0, 6.0, 49)
    run = nlctl.input_output_response(compiled, times, times - 3.0)
    np.testing.assert_allclose(run.y[0], np.interp(times - 3.0, places, values, **how), rtol=1e-12)
