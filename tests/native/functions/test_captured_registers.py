"""Objects that functions write into: variables of the call where they are written before read.

python-control calls a function in any order and any number of times.  What is computed from what
the call before left is refused; all else has python-control's values.
"""

from __future__ import annotations

import dataclasses
import functools
from types import MappingProxyType, SimpleNamespace

import control as ct
import numpy as np
import pytest
from user_function_checks import Plain, Points, agrees, expected

import nlctl
from nlctl.errors import CompileError


class Controller:
    """A controller with fields, as many are written."""

    def __init__(self):
        self.error, self.integral, self.calls = 0.0, 0.0, 0
        self.work, self.matrix = np.zeros(2), np.zeros((2, 2))
        self.row, self.last, self.limits = self.matrix[0], None, [0.0, 0.0]

    def step(self, v):
        self.error = 1.0 - v
        self.calls += 1
        return 2.0 * self.error

    def integrate(self, v):
        self.integral += 0.1 * v
        return self.integral

    @property
    def command(self):
        return self._command

    @command.setter
    def command(self, v):
        self._command = 3.0 * v

    @functools.cached_property
    def first(self):
        return self.error


@dataclasses.dataclass
class Fields:
    gain: float = 1.0


LAST, RATES = 0.0, {"first": 0.0, "second": 1.0, "limit": 3.0, "unit": "m"}


def last_and(v):
    return LAST + v


def set_last(v):
    global LAST
    LAST = 2.0 * v


def block(update, name="block", inputs=1):
    """Return a block of two states and one input."""
    return ct.nlsys(update, None, states=2, inputs=inputs, outputs=2, name=name)


def local_functions():
    """Yield functions whose fields are variables of each call."""
    c, d, bodies, space = Controller(), Controller(), [Controller(), Controller()], Fields()
    names = SimpleNamespace(a=0.0, b=np.zeros(2))
    table, nested = {"a": 0.0, "b": 1.0, "unit": "m"}, {"inner": {"rate": 0.0}, "gain": 2.0}
    rate, count, filled = 0.0, 0, {}

    def rate_of(v):
        nonlocal rate, count
        count += 1
        rate = 2.0 * v
        return rate

    def of_a_dict(t, x, u, params):
        table["a"] = x[0]
        table["a"] += 1.0
        return [table["a"] * table["b"], table.get("a") * len(table["unit"])]

    def by_keys_in_a_loop(t, x, u, params):
        for key, v in zip(RATES, x, strict=False):
            if key in ("first", "second"):
                RATES["first" if key == "first" else "second"] = v
        return [RATES["first"] - RATES["second"], {**RATES}["first"] + dict(RATES)["second"]]

    def of_views_of_a_dict(t, x, u, params):
        RATES["first"], RATES["second"] = x
        keys, numbers, pairs = RATES.keys(), RATES.values(), RATES.items()
        RATES["first"] = np.sin(x[1])
        one, other, *_ = numbers
        return [one * len(keys), dict(pairs)["first"] + other * ("first" in keys)]

    def of_dicts_in_dicts(t, x, u, params):
        nested["inner"]["rate"] = x[0]
        return [nested["inner"]["rate"] * nested["gain"], x[1]]

    def of_keys_that_are_new(t, x, u, params):
        filled["first"] = x[0]
        filled["second"] = [filled["first"], x[1]]
        filled["second"].append(1.0)
        return [filled["first"], sum(filled["second"])]

    def of_a_function_around(t, x, u, params):
        one = rate_of(x[0])
        return [one + rate, rate_of(x[1]) - rate * one]

    def of_a_module(t, x, u, params):
        global LAST
        LAST = x[0]
        one = last_and(x[1])
        set_last(one)
        return [one, LAST]

    def of_a_module_in_ways(t, x, u, params):
        global LAST
        LAST = 1.0
        if x[0] > 0:
            set_last(x[1])
        one = LAST
        for LAST in x:
            if LAST > 1:
                break
        return [one, LAST]

    def cached(t, x, u, params):
        return [-c.step(x[0]), c.error * x[1]]

    def counted_and_not_asked(t, x, u, params):
        c.calls += 1
        c.integrate(x[0])
        return -x

    def whole_workspace(t, x, u, params):
        c.work[0] = x[1]
        c.work[1] = np.sin(x[0])
        return c.work * u[0]

    def by_slices(t, x, u, params):
        c.matrix[:] = np.outer(x, x)
        c.matrix[0, 0] += 1.0
        return c.matrix @ x

    def of_lists(t, x, u, params):
        c.limits[0] = x[0]
        c.limits[1] = 2.0
        return [min(c.limits), sum(c.limits)]

    def in_both_branches(t, x, u, params):
        if x[0] > 0:
            c.error = x[0]
        else:
            c.error = -2.0 * x[1]
        return [c.error, x[1]]

    def by_a_property(t, x, u, params):
        c.command = x[0]
        return [c.command, x[1]]

    def of_several_objects(t, x, u, params):
        for body, v in zip(bodies, x, strict=True):
            body.error = v
        return [bodies[1].error - body.error * u[0] for body in bodies]

    def of_a_namespace(t, x, u, params):
        names.a, names.b = x[0], 2.0 * x
        return names.a * names.b

    def what_does_not_count(t, x, u, params):
        before = d.limits[0]
        if params.get("limited"):
            x = np.minimum(x, before)
        d.limits[0] = x[0]
        return -x

    def of_a_dataclass(t, x, u, params):
        space.gain = x[0]
        return [space.gain, x[1]]

    def in_a_loop(t, x, u, params):
        c.error = 0.0
        for v in x:
            if v > 1:
                break
            c.error = c.error + v
        return x * c.error

    given = (v for v in list(locals().values()) if hasattr(v, "__code__"))
    yield from (v for v in given if v.__code__.co_varnames[0] == "t")


def remembering_functions():
    """Yield functions whose results depend on the calls before, with what each says of it."""
    c, other, own = Controller(), Controller(), Fields()
    alias = c.work
    table, mean, bytes_of, fields = {"first": alias}, c.work.mean, memoryview(c.work), vars(own)
    row, pair, bound, held = [0.0, 0.0], {"a": 0.0, "b": 0.0}, {"a": 0.0}, {"a": 0.0}
    value_of, proxy, number, filled = bound.get, MappingProxyType(held), 0.0, {}
    second = row.__getitem__

    @functools.cache
    def of_the_first_call():
        return c.error

    def integral(t, x, u, params):
        return x * c.integrate(x[0])

    def read_first(t, x, u, params):
        before = c.error
        c.error = x[0]
        return [before, x[1]]

    def in_one_branch(t, x, u, params):
        if x[0] > 0:
            c.error = x[0]
        return [c.error, x[1]]

    def one_element(t, x, u, params):
        c.work[0] = x[0]
        return -c.work

    def element_that_is_computed(t, x, u, params):
        c.work[int(x[0] > 0)] = x[0]
        return -c.work

    def counted(t, x, u, params):
        other.calls += 1
        return x if other.calls > 3 else -x

    def first_call(t, x, u, params):
        if c.last is None:
            c.last = x[0]
        return x * c.last

    def view(t, x, u, params):
        c.matrix[0, 0] = x[0]
        return x + c.row

    def another_name(t, x, u, params):
        c.work[0] = x[0]
        return x + table["first"]

    def size(t, x, u, params):
        count = np.size(c.integral)
        c.integral = x
        return x * count

    def first_property(t, x, u, params):
        c.error = x[0]
        return x * c.first

    def method_of_an_array(t, x, u, params):
        c.work[:] = x
        return x * mean()

    def method_of_a_list(t, x, u, params):
        row[0], row[1] = x
        return x * second(1)

    def memory(t, x, u, params):
        c.work[:] = x
        return x * bytes_of[0]

    def dict_of_an_object(t, x, u, params):
        own.gain = x[0]
        return x * fields["gain"]

    def result_of_the_first_call(t, x, u, params):
        c.error = x[0]
        return x * of_the_first_call()

    def length(t, x, u, params):
        count = len(row)
        row[:] = [x[0]]
        return x * count

    def truth(t, x, u, params):
        sign = 1.0 if row else -1.0
        row[:] = []
        return x * sign

    def type_of_a_field(t, x, u, params):
        sign = 1.0 if isinstance(c.integral, float) else -1.0
        c.integral = 3
        return x * sign

    def type_of_an_element(t, x, u, params):
        sign = 1.0 if type(row[0]) is float else -1.0
        row[0] = row[1] = 3
        return x * sign

    def left_in_the_other_way(t, x, u, params):
        before = row[0]
        row[0] = row[1] = x[0]
        return [1.0, x[1]] if x[1] > 0 else [before, x[1]]

    def key(t, x, u, params):
        before = pair["a"]
        pair["a"] = x[0]
        return x * before

    def key_in_one_branch(t, x, u, params):
        if x[0] > 0:
            pair["b"] = x[0]
        return x * pair["b"]

    def key_that_is_there_later(t, x, u, params):
        if "first" not in filled:
            filled["first"] = x[0]
        return x * filled["first"]

    def number_of_keys(t, x, u, params):
        count = len({**filled})
        filled["first"] = x[0]
        return x * count

    def equal_dicts(t, x, u, params):
        sign = 1.0 if filled == {} else -1.0
        filled["first"] = x[0]
        return x * sign

    def values_of_the_other_call(t, x, u, params):
        before = sum(pair.values())
        pair["a"] = pair["b"] = x[0]
        return x * before

    def method_of_a_dict(t, x, u, params):
        bound["a"] = x[0]
        return x * value_of("a")

    def proxy_of_a_dict(t, x, u, params):
        held["a"] = x[0]
        return x * proxy["a"]

    def fields_by_keys(t, x, u, params):
        fields["gain"] = x[0]
        return x * own.gain

    def variable_around(t, x, u, params):
        nonlocal number
        before, number = number, x[0]
        return x * before

    def variable_of_the_module(t, x, u, params):
        global LAST
        if x[0] > 0:
            LAST = x[0]
        return x * LAST

    def type_of_a_variable(t, x, u, params):
        nonlocal number
        sign = 1.0 if isinstance(number, float) else -1.0
        number = 3
        return x * sign

    def copied_fields(t, x, u, params):
        own.gain = x[0]
        return x * dataclasses.asdict(own)["gain"]

    yield from (v for v in list(locals().values()) if hasattr(v, "__code__"))


@pytest.mark.parametrize("update", list(local_functions()), ids=lambda f: f.__name__)
def test_fields_that_are_written_first_are_variables(update):
    """All values are python-control's, whatever the order of calls."""
    system = block(update)
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    rng = np.random.default_rng(3)
    at = Points(np.zeros(40), rng.normal(size=(2, 40)), rng.normal(size=(1, 40)))
    rates, _ = Plain(compiled).run(at)
    for lane in rng.permutation(40):
        want, _ = expected(system, at.at(lane))
        assert agrees(rates[:, lane], want), (update.__name__, at.x[:, lane])


@pytest.mark.parametrize("update", list(remembering_functions()), ids=lambda f: f.__name__)
def test_what_depends_on_the_call_before_is_refused(update):
    """The message has the block, the field, a line, and what to write instead."""
    with pytest.raises(
        CompileError, match=r"block 'block' cannot be compiled: .*line \d+"
    ) as error:
        nlctl.compile(block(update))
    assert "state of the block" in str(error.value) or "variables" in str(error.value)


def test_nobody_else_reads_what_is_written():
    """An output function, or another block, would read what the last call has left."""
    one = Controller()

    def update(t, x, u, params):
        one.error = x[0]
        return -one.error * x

    def output(t, x, u, params):
        return x * one.error

    def other(t, x, u, params):
        return -x + one.error

    def another(t, x, u, params):
        one.error = u[0]
        return -x + one.error

    whole = ct.nlsys(update, output, states=2, inputs=1, outputs=2, name="both")
    with pytest.raises(CompileError, match=r"'one.error'"):
        nlctl.compile(whole)
    apart = [block(update, "one", inputs="a"), block(other, "other", inputs="b")]
    wires = {
        "connections": [["other.b", "one.y[0]"]],
        "inplist": ["one.a"],
        "outlist": ["other.y", "one.y"],
    }
    with pytest.raises(CompileError, match=r"'one.error'"):
        nlctl.compile(ct.interconnect(apart, **wires))
    apart[1] = block(another, "other", inputs="b")
    assert not nlctl.compile(ct.interconnect(apart, **wires)).equations.calls


def test_what_others_write_into_the_fields_changes_nothing():
    """python-control writes them at each of its calls, and the program stands as it is."""
    one = Controller()

    def update(t, x, u, params):
        one.step(x[0])
        one.work[:] = x
        return [-one.error, one.work[1] - x[1] ** 3]

    system = block(update)
    compiled, times = nlctl.compile(system), np.linspace(0.0, 1.0, 5)
    run = nlctl.input_output_response(compiled, times, 0.0, [0.5, -0.2])
    reference = ct.input_output_response(
        system, times, 0.0, [0.5, -0.2], solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12}
    )
    one.work[:] = 7.0
    again = nlctl.input_output_response(compiled, times, 0.0, [0.5, -0.2])
    np.testing.assert_array_equal(again.states, run.states)
    np.testing.assert_allclose(run.states, reference.states, atol=1e-5)


FIELDS = ("gain", "rate")


def test_attributes_that_a_loop_names_are_fields():
    """By names in brackets, or in a tuple around the function; also those of a dict."""
    one = SimpleNamespace(gain=1.0, rate=2.0, offset=0.5, work=np.zeros(2))

    def update(t, x, u, params):
        for name in FIELDS:
            setattr(one, name, params.get(name, 1.0) * x[0])
        for name in ["work"]:
            setattr(one, name, 2.0 * x)
        return one.gain * one.work - one.rate * x + one.offset

    def remembers(t, x, u, params):
        for name in FIELDS:
            setattr(one, name, getattr(one, name) + x[0])
        return -one.gain * x

    system = ct.nlsys(update, None, states=2, inputs=0, outputs=2, params={"rate": 3.0}, name="a")
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    for x in np.random.default_rng(0).normal(size=(5, 2)):
        want = 2.0 * x[0] * x - 3.0 * x[0] * x + 0.5
        np.testing.assert_allclose(system.dynamics(0.0, x, []), want, rtol=1e-12)
        np.testing.assert_allclose(compiled.dynamics(0.0, x), want, rtol=1e-12)
    with pytest.raises(CompileError, match=r"remembers 'one\.gain'"):
        nlctl.compile(block(remembers))
