"""Tuples of functions and numbers, and what functions put into lists and objects."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError

KEPT = [np.zeros(2)]


def compiled(update):
    return nlctl.compile(ct.nlsys(update, None, inputs=0, outputs=2, states=2, name="s"))


def adds(rows):
    rows.append(KEPT[0])


def adds_given(rows, value):
    rows.append(value)


class Log:
    def __init__(self):
        self.rows = []

    def add(self):
        self.rows.append(KEPT[0])


class Plain:
    def __init__(self, gain):
        self._gain = gain

    @property
    def gain(self):
        return self._gain

    @gain.setter
    def gain(self, value):
        self._gain = value

    def __call__(self, v):
        return self.gain * v


class Squared(Plain):
    def __call__(self, v):
        return self.gain * v * v


def weighted_terms(t, x, u, p):
    terms = [(np.sin, 2.0), (lambda v: v**3, -1.0)]
    return sum(weight * term(x) for term, weight in terms)


def named_terms(t, x, u, p):
    terms = {"spring": (lambda v: -np.sin(v), 2.0), "drag": (lambda v: -v * abs(v), 0.5)}
    total, names = 0.0 * x, ""
    for name, (term, weight) in terms.items():
        total, names = total + weight * term(x), names + name
    return total * len(names)


def states_of_a_machine(t, x, u, p):
    table = {"idle": (0.0, lambda v: v > 1, "run"), "run": (1.0, lambda v: v < 0.2, "idle")}
    state = "idle"
    for _ in range(2):
        _output, leaves, following = table[state]
        if leaves(x[0]):
            state = following
    return [table[state][0] - x[0], -x[1]]


def ranges_in_rows(t, x, u, p):
    for i, (low, high, law) in enumerate([(-9.0, 0.0, np.sin), (0.0, 9.0, lambda v: v * v)]):
        if low <= x[0] < high:
            return [law(x[0]) + i, -x[1]]
    return [0.0, -x[1]]


def set_by_a_property(t, x, u, p):
    laws = [Plain(1.0), Squared(2.0)]
    laws[0].gain = 3.0
    return sum(law(x) for law in laws)


def numbers_by_names(t, x, u, p):
    totals = dict.fromkeys("ab", 0.0)
    values = dict(zip("ab", x, strict=True))
    laws = {"a": lambda c: c["a"] * 2, "b": lambda c: c["b"] ** 2}
    for name in totals:
        totals[name] += laws[name](values)
    return [totals["a"], totals["b"]]


@pytest.mark.parametrize(
    "update",
    [weighted_terms, named_terms, states_of_a_machine, ranges_in_rows, set_by_a_property,
     numbers_by_names],
)  # fmt: skip
def test_rows_of_functions_and_numbers_are_followed(update):
    machine = compiled(update)
    assert not machine.equations.calls
    for x in ([0.0, 0.0], [0.3, -2.0], [1.5, 0.1], [-4.0, 1.0]):
        expected = update(0.0, np.array(x), None, {})
        assert machine.dynamics(0.0, x) == pytest.approx(np.asarray(expected), abs=1e-15)


def through_a_row(t, x, u, p):
    for law, v in [(np.cos, x), (np.sin, 2 * x)]:
        v[0] = law(1.0)
    return 1.0 * x


def through_a_row_of_a_dict(t, x, u, p):
    for name, row in {"a": (np.cos, x), "b": (np.sin, x)}.items():
        row[1][0] = float(len(name))
    return 1.0 * x


def through_a_starred_name(t, x, u, p):
    law, *rest = np.sin, x
    rest[0][0] = 3.0
    return law(x)


def through_a_function(t, x, u, p):
    rows = []
    adds(rows)
    rows[0][0] = x[0]
    return 1.0 * rows[0]


def through_a_function_again(t, x, u, p):
    first, second = [], []
    adds(first)
    adds(second)
    second[0][0] = x[0]
    return 1.0 * x


def through_another_name(t, x, u, p):
    rows = []
    adds_given(rows, x)
    rows[0][0] = 2.0
    return 1.0 * x


def through_a_closure(t, x, u, p):
    rows = {}

    def put(name):
        rows[name] = KEPT[0]

    put("a")
    rows["a"][0] = x[0]
    return 1.0 * x


def through_a_method(t, x, u, p):
    log = Log()
    log.add()
    log.rows[0][0] = x[0]
    return 1.0 * x


def through_an_attribute(t, x, u, p):
    log = Log()
    log.rows.append(x)
    log.rows[0][0] = 3.0
    return 1.0 * x


@pytest.mark.parametrize(
    "update",
    [through_a_row, through_a_row_of_a_dict, through_a_starred_name, through_a_function,
     through_a_function_again, through_another_name, through_a_closure, through_a_method,
     through_an_attribute],
)  # fmt: skip
def test_nothing_is_written_into_what_a_call_has_not_made(update):
    with pytest.raises(CompileError, match="which it did not make"):
        compiled(update)


def test_numbers_that_a_function_puts_into_a_list_may_be_changed():
    def update(t, x, u, p):
        rows = []
        adds_given(rows, x[0])
        adds_given(rows, np.sin(x[1]))
        rows[0] += 1.0
        return rows

    assert compiled(update).dynamics(0.0, [2.0, 0.0]) == pytest.approx([3.0, 0.0])
