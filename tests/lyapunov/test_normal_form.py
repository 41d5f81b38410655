"""Sums of products: equal to the equation wherever it is evaluated, and 0 where it is 0."""

import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from examples import many
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import special

import nlctl
from nlctl.analysis.intervals.arithmetic import Ball, as_ball
from nlctl.analysis.intervals.normal_form import LARGEST_POWER, Sum, exact, indeterminate
from nlctl.analysis.intervals.paths import Undecided
from nlctl.expressions.functions import FUNCTIONS

X, Y = indeterminate("x"), indeterminate("y")
NUMBERS = st.floats(-2, 2).map(lambda v: round(v, 3))
OPERATIONS = ("add", "subtract", "multiply", "square", "negative", "sin", "absolute", "maximum")


@st.composite
def trees(draw, depth=4):
    """An expression of x, y and numbers as nested tuples."""
    if depth == 0 or draw(st.booleans()):
        return draw(st.one_of(st.sampled_from(["x", "y"]), NUMBERS))
    name = draw(st.sampled_from(OPERATIONS))
    count = 1 if name in ("square", "negative", "sin", "absolute") else 2
    return (name, *(draw(trees(depth - 1)) for _ in range(count)))


def value(tree, x, y):
    if not isinstance(tree, tuple):
        return {"x": x, "y": y}.get(tree, tree) if isinstance(tree, str) else tree
    return getattr(np, tree[0])(*(value(each, x, y) for each in tree[1:]))


def at(found, x, y):
    return as_ball(found.on({"x": Ball(arb(x)), "y": Ball(arb(y))})).value


@settings(max_examples=many(150), deadline=None)
@given(tree=trees(), x=NUMBERS, y=NUMBERS)
def test_it_is_the_equation(tree, x, y):
    """At points, against floating point; the difference to itself has no terms."""
    found = value(tree, X, Y)
    if not isinstance(found, Sum):  # a number alone
        return
    known = value(tree, x, y)
    assert abs(float(at(found, x, y).mid()) - known) <= 1e-9 * (1 + abs(known))
    assert not (found - value(tree, X, Y)).terms


ATOMS = [n for n, row in FUNCTIONS.items() if row.enclosure is not None and n != "sign"]


@pytest.mark.parametrize("name", ATOMS)  # NumPy's sign compares
def test_every_function_with_an_enclosure_is_an_atom(name):
    point = 1.5 if name == "arccosh" else 0.4
    function = getattr(np, name) if hasattr(np, name) else getattr(special, name)
    found = function(X)
    assert float(at(found, point, 0.0).mid()) == pytest.approx(float(function(point)))
    assert not (found - function(X)).terms


def test_polynomials_have_one_form():
    assert not ((X + Y) ** 2 - (X * X + 2 * X * Y + Y * Y)).terms
    assert not ((X - 0.1) * (X + 0.1) - (X * X - exact(0.1) ** 2)).terms
    assert (0.1 * X + 0.2 * X).terms != (0.3 * X).terms  # as doubles are, not as they are written


def test_division_by_what_may_be_zero_is_not_forgotten():
    """x / x is 1 but where x = 0, and 1/x - 1/x has no value there."""
    gone = 1 / X - 1 / X
    assert not gone.terms
    assert at(gone, 2.0, 0.0) == 0
    with pytest.raises(Undecided):
        gone.on({"x": Ball(arb(0, 1))})
    assert not (X / 4 - 0.25 * X).terms
    assert (np.sqrt(X) - np.sqrt(X)).partial


@pytest.mark.parametrize(
    "question",
    [
        lambda: bool(X > 0),
        lambda: bool(X == Y),
        lambda: bool(X != X),
        lambda: bool(Y),
        lambda: X ** (LARGEST_POWER + 1),
        lambda: np.where(X > 0, X, Y),
    ],
)
def test_a_comparison_has_no_answer(question):
    with pytest.raises(Undecided):
        question()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(bad):
    with pytest.raises((ValueError, OverflowError)):
        X * bad


def test_what_depends_on_what():
    assert (np.sin(X * Y) + 1).names == {"x", "y"}
    assert (X - X).names == set()
    assert (np.floor(X) - np.floor(X)).names == {"x"}


def test_blocks_compute_with_it():
    """The basis of the network and wing rock's own equation."""
    basis = nlctl.controllers.GaussianBasis(centres=((0.0, 1.0), (1.0, 0.0)), widths=(1.0,))
    made = nlctl.block(basis, "basis")
    u = np.array([X, Y], dtype=object)
    psi = made.outfcn(0.0, (), u, made._current_params)
    known = made.output(0.0, [], [0.3, 0.4])
    for one, number in zip(psi, known, strict=True):
        assert float(at(one, 0.3, 0.4).mid()) == pytest.approx(number)
    wing = nlctl.block(nlctl.plants.WingRock(), "wing")
    rate = wing.updfcn(0.0, u, np.array([indeterminate("v")], dtype=object), wing._current_params)[
        1
    ]
    by_v = next(iter(indeterminate("v").terms))
    assert rate.coefficient(by_v) == Fraction(3)


def test_an_enclosure_is_the_same_in_every_process():
    """Terms are sets, and sets of texts have another order where texts have other hashes."""
    program = (
        "import numpy as np\n"
        "from flint import arb\n"
        "from nlctl.analysis.intervals.arithmetic import as_ball\n"
        "from nlctl.analysis.intervals.normal_form import indeterminate\n"
        "a, b, c, d = map(indeterminate, 'abcd')\n"
        "sum_of = np.sin(a * b + c - 0.3 * d) * (a + b * c + np.tanh(d - b)) + a * c * d + b\n"
        "balls = {n: as_ball(arb(k, 0.1)) for k, n in enumerate('abcd', 1)}\n"
        "print(sum_of.on(balls).value.str(40, more=True))\n"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", program], env=os.environ | {"PYTHONHASHSEED": seed},
            capture_output=True, text=True, check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }  # fmt: skip
    assert len(texts) == 1
