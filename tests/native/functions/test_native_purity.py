"""Functions are read before they are called: memory, changes and what cannot be read are found."""

import ast
import collections
import functools
import linecache
import operator
import random
import time

import control as ct
import numpy as np
import pytest
import scipy.stats
import source_text

import nlctl
from nlctl.errors import CompileError, EngineWarning, UsageError
from nlctl.expressions.source import Unreadable, definition
from nlctl.native.purity.check import check_pure
from nlctl.native.purity.registers import REMEMBERS
from nlctl.native.purity.values import FRESH, VECTOR, Impure, captured

GAIN, HISTORY, TABLE = 2.0, [], {"k": 1.0}
MATRIX = np.eye(2)
RNG = np.random.default_rng(0)
ENDLESS = iter(range(10**9))
PARAMS = {"flag": True, "n": 1, "k": 2.0, "f": lambda v: v * 2, "T": [1.0, 2.0]}


class Tank:
    """Somebody's model."""

    def __init__(self):
        self.gain, self.matrix, self.seen = 2.0, np.eye(2), collections.deque()
        self.law = np.sin

    @property
    def doubled(self):
        return self.gain * 2

    def update(self, t, x, u, params):
        return self.matrix.T @ x * self.doubled + self.helper(x) + self.law(x)

    def helper(self, x):
        return x * self.gain

    def not_reading_self(self, t, x, u, params):
        return -x

    def counting(self, t, x, u, params):
        self.gain += 1
        return x

    def remembering(self, t, x, u, params):
        self.seen.append(t)
        return x

    def __call__(self, t, x, u, params):
        return -x


class Counter:
    """An object whose special methods count."""

    def __init__(self):
        self.count = 0

    def __iter__(self):
        self.count += 1
        return iter([1.0])

    def __len__(self):
        self.count += 1
        return 1


class Heavy(Tank):
    def update(self, t, x, u, params):
        return super().update(t, x, u, params)


TANK, HEAVY, COUNTER = Tank(), Heavy(), Counter()


def fill(array, value):
    array[0] = value


def closed_over():
    step = 0

    def update(t, x, u, params):
        nonlocal step
        step += 1
        return x + step

    return update


IMPURE_TEXT = """
def writes_a_global(t, x, u, params):
    global GAIN
    GAIN = 3.0
    return x

def appends(t, x, u, params):
    HISTORY.append(t)
    return x

def counts(t, x, u, params):
    TABLE["k"] += 1
    return x

def writes_its_argument(t, x, u, params):
    x[0] = 1.0
    return x

def writes_a_view(t, x, u, params):
    part = np.asarray(x)[1:]
    part[0] = 1.0
    return x

def adds_in_place(t, x, u, params):
    x += 1.0
    return x

def changes_a_row(t, x, u, params):
    row = MATRIX[0]
    row += 1.0
    return x

def lets_others_write(t, x, u, params):
    fill(x, 0.0)
    return x

def writes_a_list_of_views(t, x, u, params):
    parts = [x[:1], x[1:]]
    parts[0][0] = 1.0
    return x

def writes_through_a_ufunc(t, x, u, params):
    return np.sin(x, out=x)

def adds_at_places(t, x, u, params):
    np.add.at(x, 0, 1.0)
    return x

def sorts(t, x, u, params):
    x.sort()
    return x

def draws(t, x, u, params):
    return x + np.random.randn()

def draws_from_a_generator(t, x, u, params):
    return x + RNG.normal()

def draws_from_python(t, x, u, params):
    return x + random.random()

def looks_at_the_clock(t, x, u, params):
    return x + time.time()

def uses_up(t, x, u, params):
    return x + next(ENDLESS)

def uses_up_in_a_loop(t, x, u, params):
    for value in ENDLESS:
        return x + value

def remembers_in_a_default(t, x, u, params, seen={}):
    seen[t] = x
    return x

def remembers_in_itself(t, x, u, params):
    remembers_in_itself.count = 1
    return x

def writes_a_parameter(t, x, u, params):
    params["n"] = 3
    return x

def prints(t, x, u, params):
    print(x)
    return x

def tests_identity(t, x, u, params):
    return x if params["flag"] is x else -x

def orders_by_what_remembers(t, x, u, params):
    return sorted(x, key=lambda v: HISTORY.append(v) or v)

def least_by_what_remembers(t, x, u, params):
    return min([x, -x], key=lambda v: HISTORY.append(v) or 0.0)

def reduces_by_what_remembers(t, x, u, params):
    return functools.reduce(lambda a, b: HISTORY.append(a) or b, [np.sin, np.cos])(x)

def draws_from_a_law(t, x, u, params):
    return scipy.stats.norm(0.0, 1.0).rvs() + x

def sorts_a_table_in_place(t, x, u, params):
    params["table"].sort_values("k", inplace=True)
    return x

def keeps_in_a_class_inside(t, x, u, params):
    class Keeper:
        def keep(self, v):
            HISTORY.append(v)
            return v
    class Heir(Keeper):
        def keep(self, v):
            return super().keep(v)
    return Heir().keep(x)

def writes_in_a_lambda(t, x, u, params):
    keep = lambda v: HISTORY.append(v)
    keep(t)
    return x

def writes_in_a_comprehension(t, x, u, params):
    return [HISTORY.append(v) or v for v in x]

def evaluates_text(t, x, u, params):
    return eval("x")

def sets_an_attribute(t, x, u, params):
    setattr(TANK, "gain", 3.0)
    return x

def sums_an_iterator(t, x, u, params):
    return x + sum(ENDLESS)

def unpacks_an_iterator(t, x, u, params):
    a, b = ENDLESS
    return x + a

def looks_for_it_in_an_iterator(t, x, u, params):
    return x if 3 in ENDLESS else -x

def makes_an_array_of_an_iterator(t, x, u, params):
    return x + np.fromiter(ENDLESS, float)[0]

def adds_with_a_function(t, x, u, params):
    return operator.iadd(x, 1.0)

def keeps_a_view_in_a_list(t, x, u, params):
    parts, other = [], []
    also = parts
    also.append(x[:1])
    parts[0][0] = 1.0
    return x

def takes_a_view_by_a_tuple(t, x, u, params):
    places = (slice(0, 1),)
    part = x[places]
    part[0] = 1.0
    return x

def goes_through_an_object(t, x, u, params):
    return x + [v for v in COUNTER][0]

def asks_an_object(t, x, u, params):
    return x if COUNTER else -x

def measures_an_object(t, x, u, params):
    return x * len(COUNTER)

def keeps_a_row_by_adding(t, x, u, params):
    rows = {"a": []}
    rows["a"] += [x]
    rows["a"][0][0] = 1.0
    return x

def sorts_rows_into_one(t, x, u, params):
    rows = [np.zeros(2)]
    list.extend(rows, [x])
    rows[1][0] = 1.0
    return x

def keeps_a_row_by_a_library(t, x, u, params):
    rows = [np.zeros(2)]
    operator.iconcat(rows, [x])
    rows[1][0] = 1.0
    return x

def takes_a_row_by_key(t, x, u, params):
    row = params["T"]
    row += [1.0]
    return x

def yields(t, x, u, params):
    yield x
"""

PURE_TEXT = """
def heat(t, x, u, params):
    dx = -x
    dx[1:-1] = x[2:] - 2 * x[1:-1] + x[:-2]
    dx[0] += u[0]
    return dx

def copies_first(t, x, u, params):
    x = np.array(x)
    x[0] = 1.0
    y = x.copy()
    y += 1.0
    return y

def numbers_are_not_arrays(t, x, u, params):
    a, b = x
    a += 1.0
    total = 0.0
    for i, v in enumerate(x):
        total += v * i
    return [a + b, total]

def elements_are_numbers(t, x, u, params):
    value = MATRIX[0, 1]
    value += 1.0
    row = MATRIX[0] * 1.0
    row += value
    return row

def lets_others_fill(t, x, u, params):
    dx = np.zeros(2)
    fill(dx, x[0])
    return dx

def has_functions_inside(t, x, u, params):
    def twice(v):
        return v * 2
    more = lambda v: twice(v) + 1
    found = []
    for i in range(3):
        found.append(more(x[i % 2]))
    count = 0
    def step():
        nonlocal count
        count += 1
    step()
    return [sum([v for v in found]), count]

def takes_functions_from_tables(t, x, u, params):
    laws = {"a": lambda v: v, "b": np.sin}
    return laws["b"](params["f"](x)) * params["T"][0]

def silences_numpy(t, x, u, params):
    with np.errstate(all="ignore"):
        return np.log(x)

def has_none(t, x, u, params):
    k = params.get("missing")
    return x if k is None else x * k

def reduces(t, x, u, params):
    return functools.reduce(lambda a, b: a + b, x) * np.array([1.0, 2.0])

def matches(t, x, u, params):
    match int(params["n"]):
        case 1:
            return x
        case _:
            return -x

def takes_away_from_rows(t, x, u, params):
    rows = {"a": np.zeros(2), "b": np.ones(2)}
    rows["a"] -= x
    rows["b"] *= x
    rows["a"][0] = 1.0
    return rows["a"] * rows["b"]

def sorts_what_is_outside(t, x, u, params):
    sums = dict.fromkeys("ab", 0.0)
    for name in sorted(params):
        sums["a"] += x[0]
    return [sums["a"], sums["b"]]

def imports(t, x, u, params):
    import math
    from math import sin as sine
    return [sine(x[0]), math.cos(x[1])]
"""

NAMES = {
    "np": np, "GAIN": GAIN, "HISTORY": HISTORY, "TABLE": TABLE, "MATRIX": MATRIX, "RNG": RNG,
    "ENDLESS": ENDLESS, "TANK": TANK, "fill": fill, "random": random, "time": time,
    "functools": functools, "operator": operator, "COUNTER": COUNTER, "scipy": scipy,
    "__name__": __name__,
}  # fmt: skip
ARGUMENTS = [FRESH, VECTOR, VECTOR, captured(PARAMS)]


def functions(text):
    before = set(NAMES) | {"__builtins__"}
    return {k: v for k, v in source_text.run(text, dict(NAMES)).items() if k not in before}


IMPURE = functions(IMPURE_TEXT) | {
    "closure": closed_over(), "method that counts": TANK.counting,
    "method that remembers": TANK.remembering,
}  # fmt: skip
PURE = functions(PURE_TEXT) | {
    "method": TANK.update, "method without self": TANK.not_reading_self, "object": TANK,
    "inherited": HEAVY.update, "partial": functools.partial(lambda k, t, x, u, p: k * x, 2.0),
    "bound keyword": functools.partial(lambda t, x, u, p, k: k * x, k=2.0),
    "lambda": lambda t, x, u, params: -GAIN * x,
}  # fmt: skip


def test_what_is_no_function_of_its_arguments_is_found():
    """Every kind of memory, change and chance, with the line; nothing is called for that."""
    missed = []
    for name, function in IMPURE.items():
        try:
            reading = check_pure(function, ARGUMENTS)  # refused if one of these is reached
            errors = (*reading.messages, *reading.registers)
        except Impure as error:
            errors = (error,)
        missed += [] if errors else [name]
        for error in errors:
            if "line" not in error.place or not getattr(error, "advice", REMEMBERS):
                missed.append(f"{name} without a place or advice: {error.place}")
    assert not missed
    assert GAIN == 2.0
    assert HISTORY == []
    assert TABLE == {"k": 1.0}
    assert next(ENDLESS) == 0
    assert COUNTER.count == 0


def test_what_is_a_function_of_its_arguments_is_accepted():
    """Local changes, functions inside, methods, objects: nothing outside notices."""
    refused = {}
    for name, function in PURE.items():
        try:
            check_pure(function, ARGUMENTS)
        except Impure as error:
            refused[name] = f"{error.reason} ({error.place})"
    assert not refused


def test_the_message_names_block_reason_line_and_remedy():
    system = ct.nlsys(IMPURE["closure"], None, inputs=0, outputs=1, states=1, name="counter")
    message = (
        r"block 'counter' cannot be compiled: its update function remembers 'step' from one call "
        r"to the next \(.*test_native_purity.py, line \d+\): integrators call it several times a "
        r"step, in any order: make what it remembers a state of the block, of one with dt= where "
        r"it is sampled; the diagram still runs in python-control"
    )
    with pytest.raises(CompileError, match=message):
        nlctl.compile(system)


def test_a_refused_function_leaves_no_trace_and_python_control_takes_over():
    """python-control's own notebook on discrete systems has such a counter."""
    calls = []

    def update(t, x, u, params):
        calls.append(t)
        return 0.5 * x

    system = ct.nlsys(update, None, inputs=0, outputs=1, states=1, dt=1, name="counter")
    with pytest.raises(CompileError):
        nlctl.compile(system)
    assert calls == []
    with pytest.warns(EngineWarning, match="counter"):
        run = nlctl.input_output_response(system, np.arange(4), 0, [8.0], engine="auto")
    np.testing.assert_array_equal(run.states[0], [8, 4, 2, 1])


def decorated(function):
    @functools.wraps(function)
    def inner(*args):
        return function(*args)

    return inner


@decorated
def wrapped(x):
    return x


PAIR = (lambda x: x + 1, lambda x: x + 2)
NESTED = lambda y: lambda x: x * 2  # noqa: E731


@pytest.mark.parametrize(
    ("function", "body"),
    [
        (PAIR[0], "lambda x: x + 1"), (PAIR[1], "lambda x: x + 2"),
        (NESTED, "lambda y: lambda x: x * 2"), (NESTED(1), "lambda x: x * 2"),
        (wrapped.__wrapped__, "@decorated\ndef wrapped(x):\n    return x"),
        (Tank.doubled.fget, "@property\ndef doubled(self):\n    return self.gain * 2"),
    ],
)  # fmt: skip
def test_the_source_of_a_function_is_its_own(function, body):
    """Also of one among several on a line, nested, decorated, or of a property."""
    assert ast.unparse(definition(function)) == body


def test_a_source_that_was_edited_since_is_not_believed(tmp_path):
    """The code must be what the text compiles to."""
    file = tmp_path / "edited.py"
    file.write_text("def law(x):\n    return x + 1\n", encoding="utf-8")
    names = {}
    exec(compile(file.read_text(encoding="utf-8"), str(file), "exec"), names)
    definition(names["law"])
    file.write_text("def law(x):\n    return x - 1\n# more\n", encoding="utf-8")
    with pytest.raises(Unreadable, match="is not what it was made of"):
        definition(names["law"])


def test_a_function_without_source_is_refused():
    """What cannot be read may do anything."""
    names = {}
    exec(compile("def law(t, x, u, params):\n    return -x", "<nowhere>", "exec"), names)
    assert not linecache.getlines("<nowhere>")
    system = ct.nlsys(names["law"], None, inputs=0, outputs=1, states=1, name="hidden")
    with pytest.raises(CompileError, match=r"block 'hidden' cannot be compiled.*cannot be found"):
        nlctl.compile(system)


class Gauge:
    def __init__(self, gain, matrix):
        self.gain, self.matrix = gain, matrix

    def update(self, t, x, u, params):
        return self.gain * self.matrix[0] @ x * np.ones(2) + OFFSETS[0]


OFFSETS = [1.0, 2.0]


def change_attribute(gauge):
    gauge.gain = 3.0


def change_array(gauge):
    gauge.matrix[0, 1] = 7.0


def change_global_list(gauge):
    OFFSETS[0] = 5.0


@pytest.mark.parametrize("change", [change_attribute, change_array, change_global_list])
def test_what_is_read_from_around_a_function_must_stay_what_it_was(change, monkeypatch):
    """Machine code has it as a constant, python-control reads it anew."""
    monkeypatch.setitem(globals(), "OFFSETS", [1.0, 2.0])
    gauge = Gauge(2.0, np.eye(2))
    system = ct.nlsys(gauge.update, None, inputs=0, outputs=2, states=2, name="gauge")
    times = np.linspace(0, 0.1, 3)
    compiled = nlctl.compile(system)
    before = nlctl.input_output_response(compiled, times, 0, [1.0, 2.0])
    change(gauge)
    with pytest.raises(UsageError, match="compile again, or make it a parameter"):
        nlctl.input_output_response(compiled, times, 0, [1.0, 2.0])
    after = nlctl.input_output_response(nlctl.compile(system), times, 0, [1.0, 2.0])
    assert np.abs(after.outputs - before.outputs).max() > 1e-3
