"""What classes, lists of functions and partials do is found, however they are reached."""

import functools
import operator
from collections import defaultdict
from dataclasses import dataclass, field, replace

import control as ct
import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PPoly

import nlctl
from nlctl.errors import CompileError

SEEN = []
COUNT = {"n": 0}


class Noting:
    """Its start is noted outside."""

    def __init__(self, x):
        SEEN.append(x)
        self.x = x


class Heir(Noting):
    def __init__(self, x):
        super().__init__(x)


class Sum:
    """An operator that counts how often it is asked."""

    asked = 0

    def __init__(self, x):
        self.x = x

    def __add__(self, other):
        Sum.asked += 1
        return Sum(self.x + other.x)

    def __radd__(self, other):
        COUNT.update(n=COUNT["n"] + 1)
        return self

    def __neg__(self):
        SEEN.append(self.x)
        return self

    def __getitem__(self, i):
        COUNT.update(n=COUNT["n"] + i)
        return self.x

    @property
    def noted(self):
        SEEN.append(1)
        return self.x

    @staticmethod
    def of(x):
        SEEN.append(x)
        return Sum(x)


@dataclass
class Kept:
    x: float
    past: list = field(default_factory=list)

    def __post_init__(self):
        SEEN.append(self.x)


class Holder:
    def __init__(self, array):
        self.array = array

    def write(self):
        self.array[0] = 1.0

    def grow(self):
        self.array[0] += 1.0
        return self.array[0]


def noting(v):
    SEEN.append(v)
    return v


FUNCTIONS = [np.sin, noting]
TABLE = {"a": np.sin, "b": noting}
ROWS = [("a", 1.0), ("b", noting)]
GLOBAL = Sum(1.0)
OBJECTS = [Sum(1.0), Sum(2.0)]
HOLDER = Holder(np.zeros(2))
SPLINE = CubicSpline([0.0, 1.0, 2.0], [0.0, 1.0, 0.0])


def reduced(t, x, u, p):
    return [functools.reduce(lambda a, b: noting(a + b), x)]


def by_vectorize(t, x, u, p):
    return np.vectorize(noting)(x)


def keeps_an_array_of_the_caller(t, x, u, p):
    h = Holder(p["A"])
    h.write()
    return [-x[0]]


def writes_what_itemgetter_found(t, x, u, p):
    a = operator.itemgetter("A")(p)
    a[0] = 1.0
    return [-x[0]]


def writes_into_a_polynomial_of_the_caller(t, x, u, p):
    s = PPoly(p["c"], [0.0, 1.0])
    s.c[0] = 2.0
    return [s(x[0])]


def writes_into_a_spline(t, x, u, p):
    SPLINE.c[0] = 1.0
    return [SPLINE(x[0])]


def sets_an_attribute_of_a_class(t, x, u, p):
    Sum.asked = 1
    return [-x[0]]


def takes_out_a_parameter(t, x, u, p):
    try:
        return [p.pop("A")[0]]
    except KeyError:
        return [-x[0]]


def notes_in_a_handler(t, x, u, p):
    try:
        return [p["missing"]]
    except KeyError:
        SEEN.append(x[0])
    return [-x[0]]


def through_a_loop(t, x, u, p):
    s = Sum(x[0])
    for _ in range(3):
        s = s + Sum(1.0)
    return [s.x]


def by_a_default_factory(t, x, u, p):
    d = defaultdict(lambda: noting(0.0))
    return [d["a"] - x[0]]


def changes_a_list_of_functions(t, x, u, p):
    laws = [np.sin]
    laws[0] = noting
    return [laws[0](x[0])]


def adds_to_a_list_of_functions(t, x, u, p):
    laws = [np.sin]
    laws.append(noting)
    return [sum(f(x[0]) for f in laws)]


def adds_to_a_dict_of_functions(t, x, u, p):
    laws = {"a": np.sin}
    laws["b"] = noting
    return [laws["b"](x[0])]


class Given:
    """Takes attributes by names that are only known when it runs."""

    array = np.zeros(2)

    def __init__(self, given):
        for name, value in given.items():
            setattr(self, name, value)

    def law(self, v):
        return -v


class Cached:
    """A method that remembers, and says so."""

    asked = 0.0

    @functools.cache  # noqa: B019
    def law(self, v):
        self.asked += v
        return [self.asked]


CACHED = Cached()
HIDES = {"law": noting, "gain": 1.0}
KEPT = {"array": np.zeros(2)}


def changes_what_it_was_given_by_name(t, x, u, p):
    g = Given(KEPT)
    g.array[0] += x[0]
    return [g.array[0]]


def changes_what_its_class_has(t, x, u, p):
    g = Given({})
    g.array += x[0]
    return [Given.array[0]]


def hides_a_method_in_a_dict(t, x, u, p):
    g = Given({})
    vars(g).update(HIDES)
    return [g.law(x[0])]


def has_another_dict(t, x, u, p):
    g = Given({})
    g.__dict__ = HIDES
    return [g.law(x[0])]


def changes_what_a_dict_of_attributes_has(t, x, u, p):
    g = Given({"array": np.zeros(2)})
    g.__dict__.update(KEPT)
    g.array[0] += x[0]
    return [g.array[0]]


def makes_itself_without_end(t, x, u, p):
    return [Endless({"a": {"a": 1.0}}).a.a * x[0]]


class Endless:
    def __init__(self, given):
        for name, value in given.items():
            setattr(self, name, Endless(value) if isinstance(value, dict) else value)


class Hidden:
    """Names that are private, and classes that are asked for by an object."""

    made = 0

    def __init__(self):
        self.__count, self.__buffer = 0, np.zeros(1)

    def counted(self):
        self.__count += 1
        return self.__count

    def added(self, x):
        self.__buffer[0] += x
        return self.__buffer

    def __noted(self, x):
        SEEN.append(x)
        return x

    def noted(self, x):
        return self.__noted(x)

    def of_class(self):
        self.__class__.made += 1
        return self.made

    def of_type(self):
        type(self).made += 1
        return self.made

    @property
    def asked(self):
        SEEN.append(1)
        return 1.0


def early(x):
    """What follows an early return is noted."""
    if x > 0:
        return x
    size = SEEN.append(x)
    return x if size is None else 0.0


HIDDEN = Hidden()
CASES = {
    "private number": lambda t, x, u, p: [HIDDEN.counted() * x[0]],
    "private array": lambda t, x, u, p: HIDDEN.added(x[0]),
    "private method": lambda t, x, u, p: [HIDDEN.noted(x[0])],
    "class of an object": lambda t, x, u, p: [HIDDEN.of_class() * x[0]],
    "class of an object inside": lambda t, x, u, p: [Hidden().of_class() * x[0]],
    "type of an object": lambda t, x, u, p: [HIDDEN.of_type() * x[0]],
    "type of an object inside": lambda t, x, u, p: [Hidden().of_type() * x[0]],
    "a property that is asked for": lambda t, x, u, p: [x[0] if hasattr(HIDDEN, "asked") else 0.0],
    "a property inside": lambda t, x, u, p: [x[0] if hasattr(Hidden(), "asked") else 0.0],
    "after an early return": lambda t, x, u, p: [early(x[0])],

    "method that is hidden": lambda t, x, u, p: [Given(HIDES).law(x[0])],
    "cached method": lambda t, x, u, p: CACHED.law(1.0),
    "number of an object": lambda t, x, u, p: [hash(object()) * x[0]],
    "start": lambda t, x, u, p: [Noting(x[0]).x],
    "start of a parent": lambda t, x, u, p: [Heir(x[0]).x],
    "operator": lambda t, x, u, p: [(Sum(x[0]) + Sum(1.0)).x],
    "operator of the right": lambda t, x, u, p: [(1.0 + Sum(x[0])).x],
    "operator of an object outside": lambda t, x, u, p: [(GLOBAL + Sum(x[0])).x],
    "sign": lambda t, x, u, p: [(-Sum(x[0])).x],
    "item": lambda t, x, u, p: [Sum(x[0])[0]],
    "property": lambda t, x, u, p: [Sum(x[0]).noted],
    "static method": lambda t, x, u, p: [Sum.of(x[0]).x],
    "dataclass": lambda t, x, u, p: [Kept(x[0]).x],
    "replaced dataclass": lambda t, x, u, p: [replace(Kept(0.0), x=x[0]).x],
    "list of functions": lambda t, x, u, p: [sum(f(x[0]) for f in FUNCTIONS)],
    "dict of functions": lambda t, x, u, p: [sum(f(x[0]) for f in TABLE.values())],
    "items": lambda t, x, u, p: [sum(f(x[0]) for _, f in TABLE.items())],
    "rows": lambda t, x, u, p: [[f(x[0]) if n == "b" else x[0] for n, f in ROWS][1]],
    "enumerated": lambda t, x, u, p: [sum(f(x[0]) for _, f in enumerate(FUNCTIONS))],
    "zipped": lambda t, x, u, p: [sum(f(v) for f, v in zip(FUNCTIONS, x, strict=False))],
    "mapped": lambda t, x, u, p: list(map(noting, x)),
    "partial": lambda t, x, u, p: [functools.partial(noting, x[0])()],
    "one of two": lambda t, x, u, p: [(np.sin if p.get("a") else noting)(x[0])],
    "looked up": lambda t, x, u, p: [TABLE.get(p.get("name", "b"))(x[0])],
    "sum of objects": lambda t, x, u, p: [sum([Sum(x[0]), Sum(1.0)], Sum(0.0)).x],
    "sum of objects outside": lambda t, x, u, p: [sum(OBJECTS, Sum(x[0])).x],
    "list inside": lambda t, x, u, p: [sum(f(x[0]) for f in [np.sin, noting])],
    "list inside by index": lambda t, x, u, p: [[np.sin, noting][1](x[0])],
    "list in a list": lambda t, x, u, p: [[[np.sin, noting]][0][1](x[0])],
    "method of an object outside": lambda t, x, u, p: [HOLDER.grow() - x[0]],
} | {
    f.__name__: f
    for f in (reduced, by_vectorize, keeps_an_array_of_the_caller, writes_what_itemgetter_found,
              writes_into_a_polynomial_of_the_caller, writes_into_a_spline,
              sets_an_attribute_of_a_class, takes_out_a_parameter, notes_in_a_handler,
              through_a_loop, by_a_default_factory, changes_a_list_of_functions,
              adds_to_a_list_of_functions, adds_to_a_dict_of_functions,
              changes_what_it_was_given_by_name, changes_what_its_class_has,
              hides_a_method_in_a_dict, has_another_dict, changes_what_a_dict_of_attributes_has,
              makes_itself_without_end)
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_it_is_refused(name):
    """Nothing has been called for that: no list has grown."""
    before = len(SEEN), dict(COUNT), Sum.asked
    params = {"A": np.array([3.0, 4.0]), "c": np.array([[1.0], [0.0]])}
    block = ct.nlsys(CASES[name], None, inputs=1, outputs=1, states=1, params=params, name="b")
    with pytest.raises(CompileError, match="block 'b' cannot be compiled: its update function"):
        nlctl.compile(block)
    assert (len(SEEN), dict(COUNT), Sum.asked) == before


class Vector:
    def __init__(self, x, y):
        self.x, self.y = x, y

    def __add__(self, other):
        return Vector(self.x + other.x, self.y + other.y)

    def grown(self, by):
        self.x = self.x + by
        return self


def summed(t, x, u, p):
    r = Vector(0.0, 0.0)
    for v in (Vector(x[0], 1.0), Vector(x[0], u[0])):
        r = r + v
    return [-r.grown(2.0).x + r.y]


def test_objects_of_its_own_may_change():
    """x' = -(2 x + 2) + 1 + u."""
    block = ct.nlsys(summed, None, inputs=1, outputs=1, states=1, name="b")
    compiled = nlctl.compile(block)
    assert not compiled.equations.calls
    np.testing.assert_array_equal(compiled.dynamics(0.0, [0.5], [0.25]), [-1.75])
    np.testing.assert_array_equal(block.dynamics(0.0, [0.5], [0.25]), [-1.75])


def test_a_method_that_is_replaced_afterwards_is_noticed(monkeypatch):
    """Its code was a constant of the program."""
    compiled = nlctl.compile(ct.nlsys(summed, None, inputs=1, outputs=1, states=1, name="b"))
    monkeypatch.setattr(Vector, "__add__", lambda self, other: other)
    with pytest.raises(nlctl.errors.UsageError, match="compile again"):
        nlctl.input_output_response(compiled, [0.0, 1.0], 0.0, 0.0)
