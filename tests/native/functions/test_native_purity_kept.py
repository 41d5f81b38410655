"""What outlives a call is nobody's to change: results of caches, what is handed on, classes."""

import collections
import copy
import functools
import itertools
import types

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError

COUNT = [0]
ROWS = [np.zeros(2), np.zeros(2)]
SETTINGS = {"k": 1.0}
GAIN = 2.0
TALKS = False


class Counting:
    """A model that is another after each call."""

    def __init__(self):
        self.n = 0

    def grown(self, v):
        self.n += 1
        return v * self.n

    @functools.cached_property
    def buffer(self):
        return np.zeros(2)


MODELS = [Counting()]


def counted(v):
    COUNT[0] += 1
    return v * COUNT[0]


VECTORIZED = np.vectorize(counted, otypes=[float])


@functools.lru_cache
def zeros(n):
    return np.zeros(n)


@functools.cache
def model():
    return Counting()


def adds_to_what_a_cache_returned(t, x, u, p):
    dx = zeros(2)
    dx += x
    return dx.copy()


def adds_to_a_row_of_it(t, x, u, p):
    rows = zeros((2, 2))
    rows[0][:] = x
    return rows[0] * 1.0


def adds_to_a_cached_property(t, x, u, p):
    dx = MODELS[0].buffer
    dx += x
    return dx.copy()


def changes_an_object_of_a_cache(t, x, u, p):
    return model().grown(x)


def adds_to_what_its_own_cache_returned(t, x, u, p):
    @functools.lru_cache(maxsize=None)  # noqa: UP033
    def own(n):
        return np.zeros(n)

    one, other = own(2), own(2)
    one += x
    return one + other


def hands_a_method_to_reduce(t, x, u, p):
    return functools.reduce(lambda v, m: m.grown(v), MODELS, x)


def hands_a_method_to_map(t, x, u, p):
    return sum(map(lambda m: m.grown(x), MODELS))  # noqa: C417


def calls_a_vectorized_function(t, x, u, p):
    return VECTORIZED(x)


def shuffles_its_argument(t, x, u, p):
    np.random.default_rng(3).shuffle(x)
    return x * 1.0


def draws_without_a_seed(t, x, u, p):
    return x + np.random.default_rng().normal(size=2)


def counts_in_a_class(t, x, u, p):
    class Law:
        gain = counted(1.0)

    return -Law.gain * x


def keeps_in_a_class(t, x, u, p):
    class Law:
        past = []

        def __call__(self, v):
            self.past.append(v)
            return v * len(self.past)

    return Law()(x) + Law()(x)


def writes_into_a_class(t, x, u, p):
    class Law:
        gain = 1.0

    Law.gain = x[0]
    return Law.gain * x


REFUSED = (
    adds_to_what_a_cache_returned, adds_to_a_row_of_it, adds_to_a_cached_property,
    changes_an_object_of_a_cache, adds_to_what_its_own_cache_returned, hands_a_method_to_reduce,
    hands_a_method_to_map, calls_a_vectorized_function, shuffles_its_argument,
    draws_without_a_seed, counts_in_a_class, keeps_in_a_class, writes_into_a_class,
)  # fmt: skip


def block(update):
    return ct.nlsys(update, None, inputs=1, outputs=2, states=2, name="b")


@pytest.mark.parametrize("update", REFUSED)
def test_what_outlives_a_call_is_not_changed(update):
    before = COUNT[0], MODELS[0].n
    with pytest.raises(CompileError, match="block 'b' cannot be compiled: its update function"):
        nlctl.compile(block(update))
    assert (COUNT[0], MODELS[0].n) == before


def gain_of_its_class(t, x, u, p):
    class Law:
        gain = GAIN

    return -Law.gain * x


def test_a_constant_of_a_class_is_looked_at_again(monkeypatch):
    compiled = nlctl.compile(block(gain_of_its_class))
    np.testing.assert_array_equal(compiled.dynamics(0.0, [1.0, 2.0], [0.0]), [-2.0, -4.0])
    monkeypatch.setitem(globals(), "GAIN", 3.0)
    with pytest.raises(nlctl.errors.UsageError, match="compile again"):
        nlctl.input_output_response(compiled, [0.0, 1.0], 0.0, [1.0, 2.0])


def prints_where_told(t, x, u, p):
    if TALKS:
        print(x)
    return -GAIN * x


def test_a_branch_that_is_off_is_looked_at_again(monkeypatch):
    compiled = nlctl.compile(block(prints_where_told))
    np.testing.assert_array_equal(compiled.dynamics(0.0, [1.0, 2.0], [0.0]), [-2.0, -4.0])
    monkeypatch.setitem(globals(), "TALKS", True)
    with pytest.raises(nlctl.errors.UsageError, match="compile again"):
        nlctl.input_output_response(compiled, [0.0, 1.0], 0.0, [1.0, 2.0])
    (call,) = nlctl.compile(block(prints_where_told)).equations.calls.values()
    assert "print()" in call.reason


def cache_of_what_changes(t, x, u, p):
    k = 1.0

    @functools.lru_cache
    def scaled(v):
        return k * v

    one = scaled(1.0)
    k = 2.0
    return [one * x[0], scaled(1.0) * x[1]]


def vectorized_to_the_kind_of_the_first(t, x, u, p):
    return np.vectorize(lambda v: 0 if abs(v) < 0.5 else v - 0.5)(x)


def array_of_integers_or_floats(t, x, u, p):
    y = np.asarray([1 if v > 0 else 0.0 for v in x])
    y[0] = x[0]
    return y


def quotient_of_what_may_be_numpys(t, x, u, p):
    try:
        return [1.0 / np.sqrt(float(x[0])), x[1]]
    except ZeroDivisionError:
        return [0.0, x[1]]


@pytest.mark.parametrize("update", [
    cache_of_what_changes, vectorized_to_the_kind_of_the_first, array_of_integers_or_floats,
    quotient_of_what_may_be_numpys,
])  # fmt: skip
def test_what_is_not_known_is_called_as_it_stands(update):
    assert nlctl.compile(block(update)).equations.calls


def chained_rows(t, x, u, p):
    for row in itertools.chain(ROWS):
        row[0] += 1.0
    return -x * ROWS[0][0]


def rows_of_several(t, x, u, p):
    for rows in itertools.chain.from_iterable([ROWS]):
        rows[0] += 1.0
    return -x * ROWS[0][0]


def pairs_of_rows(t, x, u, p):
    for one, _ in itertools.product(ROWS, ROWS):
        one[0] += 1.0
    return -x * ROWS[0][0]


def row_of_a_copy(t, x, u, p):
    rows = copy.copy(ROWS)
    rows[0][0] += 1.0
    return -x * ROWS[0][0]


def settings_behind_a_chain(t, x, u, p):
    known = collections.ChainMap(SETTINGS, {"c": 1.0})
    known["k"] = known["k"] + 1.0
    return -x * SETTINGS["k"]


def row_by_name(t, x, u, p):
    for row in dict([], a=ROWS[0]).values():
        row[0] += 1.0
    return -x * ROWS[0][0]


def row_as_a_default(t, x, u, p):
    {}.setdefault("a", ROWS)[0][0] += 1.0
    return -x * ROWS[0][0]


def row_if_there_is_none(t, x, u, p):
    {}.pop("a", ROWS)[0][0] += 1.0
    return -x * ROWS[0][0]


def row_of_a_namespace(t, x, u, p):
    held = types.SimpleNamespace(rows=ROWS)
    held.rows[0] += 1.0
    return -x * ROWS[0][0]


def state_by_name(t, x, u, p):
    dict([], a=x)["a"][0] = 5.0
    return -x


@pytest.mark.parametrize("update", [
    chained_rows, rows_of_several, pairs_of_rows, row_of_a_copy, settings_behind_a_chain,
    row_by_name, row_as_a_default, row_if_there_is_none, row_of_a_namespace, state_by_name,
])  # fmt: skip
def test_what_is_handed_on_is_still_somebody_elses(update):
    """They remember how often they were called, in what they did not make."""
    with pytest.raises(CompileError, match=r"did not make|changes an element"):
        nlctl.compile(block(update))


def parameters_of_its_own(t, x, u, p):
    mine = {**SETTINGS, **p}
    mine["k"] *= 2.0
    return -x * mine["k"]


def test_numbers_among_parameters_are_its_own_and_rows_are_not():
    """A copy of the dict has the same rows in it."""
    made = [ct.nlsys(parameters_of_its_own, None, inputs=1, outputs=2, states=2, name="b",
                     params={"k": k}) for k in (3.0, np.ones(2))]  # fmt: skip
    assert nlctl.compile(made[0]).dynamics(0.0, [1.0, 2.0], [0.0]) == pytest.approx([-6.0, -12.0])
    with pytest.raises(CompileError, match="changes an element"):
        nlctl.compile(made[1])
