"""Interval rules against python-flint: every function, at dense and at hard arguments."""

import functools

import numpy as np
import pytest
from flint import arb, ctx

from nlctl.expressions.functions import FUNCTIONS
from nlctl.expressions.graph import Graph
from nlctl.native.enclosures.boxes import enclosed
from nlctl.native.enclosures.rounding import FUNCTION_ERROR
from nlctl.native.enclosures.rules import CHOICE_RULES, JUMP_RULES, SMOOTH_RULES, STEPS

REACH = {"exp": 745, "exp2": 1074, "expm1": 700, "sinh": 700, "cosh": 700, "arcsin": 1,
         "arccos": 1, "arctanh": 1, "tanh": 30, "erf": 7, "erfc": 26}  # fmt: skip
SMOOTH = [n for n, row in FUNCTIONS.items() if row.count == 1 and n not in (*STEPS, "absolute")]


@functools.cache
def code_of(name):
    graph = Graph()
    args = [graph.leaf("x", i, None) for i in range(FUNCTIONS[name].count)]
    return enclosed([graph.op(name, *args)], len(args))


def arguments(name):
    """Numbers of all sizes, and those next to where a function is 0, turns or ends."""
    rng = np.random.default_rng(0)
    reach = REACH.get(name, 1e5)
    near = np.concatenate([np.arange(-40, 41) * (np.pi / 2), np.arange(-20, 21) / 20.0])
    large = rng.uniform(1e5, 1e15, 100) if name in ("sin", "cos", "log", "cbrt") else np.zeros(0)
    x = np.concatenate([
        rng.uniform(-reach, reach, 800), rng.uniform(-2, 2, 400), near,
        np.nextafter(near, 9), np.nextafter(near, -9), 1 + rng.normal(size=200) * 1e-8,
        10.0 ** rng.uniform(-300, 0, 200), -(10.0 ** rng.uniform(-300, 0, 100)), large,
        [0.0, 5e-324, -5e-324, 1e-310, reach, -reach],
    ])  # fmt: skip
    return x[np.abs(x) <= max(reach, 1e15 if large.size else reach)]


def exact(name, x):
    """The value, with digits to spare; no number outside of the domain."""
    with ctx.workprec(300):
        if name == "cbrt":
            return (arb(x).root(3) if x > 0 else -(-arb(x)).root(3)) if x else arb(0)
        return FUNCTIONS[name].enclosure(arb(x))


@pytest.mark.parted
@pytest.mark.parametrize("name", SMOOTH)
def test_an_enclosure_at_a_point_holds_the_value_and_little_more(name):
    """The stated error bound of the function in use is kept: nothing is outside."""
    x = arguments(name)
    low, high = (v[:, 0] for v in code_of(name).values(x[:, None], x[:, None]))
    for point, a, b in zip(x, low, high, strict=True):
        value = exact(name, float(point))
        if name == "tan" and abs(value) > 1e9 and np.isnan(a):  # whose pole is next to it
            continue
        if not value.is_finite():
            assert np.isnan(a) or not np.isfinite(b - a)
            continue
        assert not value < arb(a), (name, point, a, value)
        assert not value > arb(b), (name, point, b, value)
        if abs(point) <= 1e6 or name not in ("sin", "cos"):  # whose turns are far from 0
            assert b - a <= 2.5 * FUNCTION_ERROR * abs(b) + 1e-305, (name, point, a, b)


def test_every_function_of_the_table_has_a_rule():
    """A function that is added without one is named here."""
    known = {*CHOICE_RULES, *SMOOTH_RULES, *JUMP_RULES}
    assert {*FUNCTIONS} - known == set()
    assert known - {*FUNCTIONS} == set()


@pytest.mark.parametrize("name", [n for n, row in FUNCTIONS.items() if row.enclosure])
def test_a_range_holds_the_ranges_of_its_parts(name):
    """Inclusion is monotone: what a smaller box gives lies in what a larger one gives."""
    rng = np.random.default_rng(1)
    reach = REACH.get(name, 20.0)
    low = rng.uniform(-reach, reach, 400)
    high = np.minimum(low + rng.exponential(reach / 5, 400), reach)
    inner = low + (high - low) * np.sort(rng.random((2, 400)), axis=0)
    outside = code_of(name).values(low[:, None], high[:, None])
    inside = code_of(name).values(inner[0][:, None], inner[1][:, None])
    known = ~np.isnan(outside[0])
    assert known.any()
    assert np.all((outside[0] <= inside[0])[known])
    assert np.all((inside[1] <= outside[1])[known])


def test_a_sine_turns_where_it_turns():
    """sin [1.5, 1.6] ends at 1, sin [1.5, 1.57] does not."""
    low, high = code_of("sin").values(np.array([[1.5], [1.5]]), np.array([[1.6], [1.57]]))
    assert high[0, 0] == 1.0
    assert high[1, 0] < 1.0
    assert abs(low[0, 0] - np.sin(1.5)) < 1e-13


def test_outside_of_a_domain_there_is_no_value():
    """No tight interval is made up where a function has none."""
    for name, low, high in [
        ("sqrt", -1e-300, 4.0), ("log", -1.0, 1.0), ("arcsin", 0.5, 1.5), ("tan", 1.5, 1.6),
        ("arccosh", 0.5, 2.0), ("log1p", -2.0, 0.0), ("log", 0.0, 1.0), ("log2", 0.0, 0.0),
        ("log10", 0.0, 4.0), ("log1p", -1.0, 1.0), ("arctanh", -1.0, 0.5), ("arctanh", 0.5, 1.0),
    ]:  # fmt: skip
        found = code_of(name).values(np.array([[low]]), np.array([[high]]))
        assert np.isnan(found[0][0, 0])
        assert np.isnan(found[1][0, 0])
