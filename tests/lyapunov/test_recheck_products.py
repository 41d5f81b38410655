"""Sums of products: the recheck's algebra says what an equation says; what is equal cancels."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlctl.analysis.intervals.written import operations
from nlctl.analysis.recheck import Refuted
from nlctl.analysis.recheck.equations import WrittenEquation
from nlctl.analysis.recheck.integers import Interval
from nlctl.analysis.recheck.reference_model import as_equation, multiplied_out, plus

NAMES = ("x", "y")
FUNCTIONS = {
    "a polynomial": lambda x, y: (x - 2 * y) ** 3 * (1 + x) - x**2 / 4,
    "a function of a sum": lambda x, y: np.sin(2 * x - y) * (x + y) + np.exp(-(y**2)),
    "a quotient": lambda x, y: (x + y) / (2 + x**2) - 1 / (1 + y**2) ** 2,
    "the larger one": lambda x, y: np.maximum(x, y - 1) * abs(x) - np.minimum(y, 0.5) ** 2,
    "one in another": lambda x, y: np.tanh(x * np.cos(y) + np.sqrt(1 + x**2)) * x,
    "a number": lambda x, y: 0 * x + 3,
}
NUMBERS = st.floats(-3, 3)


def made(function):
    return WrittenEquation(operations(NAMES, lambda s: function(s["x"], s["y"])))


@pytest.mark.parted
@pytest.mark.parametrize("name", FUNCTIONS)
@given(x=NUMBERS, y=NUMBERS)
def test_it_has_the_value_of_the_equation(name, x, y):
    """At points, to the rounding of floats; as the equation that it was made of has."""
    equation, box = (
        made(FUNCTIONS[name]),
        {"x": Interval.of(Fraction(x)), "y": Interval.of(Fraction(y))},
    )
    value, true = as_equation(multiplied_out(equation)).on(box), FUNCTIONS[name](x, y)
    room = 1e-12 * (1 + abs(true)) + 1e-9
    assert value.bottom - Fraction(room) <= true <= value.top + Fraction(room)
    assert value.bottom <= equation.on(box).top
    assert equation.on(box).bottom <= value.top


SAME = {
    "a square": (lambda x, y: (x + y) ** 2, lambda x, y: x * x + 2 * x * y + y * y),
    "angles": (
        lambda x, y: np.sin(x + x) * (y + 1), lambda x, y: y * np.sin(2 * x) + np.sin(x * 2)
    ),
    "absolute values": (lambda x, y: abs(x) * y * 3, lambda x, y: y * (abs(x) + 2 * abs(x))),
    "a quotient": (lambda x, y: (x + y) / (1 + y), lambda x, y: x / (y + 1) + y / (1 + y)),
    "a number": (lambda x, y: x / 4 + y * 0.5, lambda x, y: (x + 2 * y) / 4),
}  # fmt: skip
OTHER = {
    "a rounded number": (lambda x, y: 0.1 * x, lambda x, y: x / 10),
    "another order": (lambda x, y: np.maximum(x, 2 * y), lambda x, y: np.maximum(2 * x, y)),
    "a power": (lambda x, y: x**3 * y, lambda x, y: x**2 * y),
    "an inner term": (lambda x, y: np.sin(x + y), lambda x, y: np.sin(x - y)),
}


@pytest.mark.parametrize("name", [*SAME, *OTHER])
def test_what_is_equal_cancels_and_nothing_else(name):
    """Exactly: the double 0.1 is not a tenth."""
    one, other = (multiplied_out(made(f)) for f in (SAME | OTHER)[name])
    assert (plus(one, other, Fraction(-1)) == {}) == (name in SAME)


@pytest.mark.parted
@pytest.mark.parametrize(
    "nodes",
    [
        [["symbol", "x"], ["number", "1"], ["+", 0, 1], *(["power", i, 64] for i in range(2, 6))],
        [["number", "3/7"], *(["power", i, 64] for i in range(8))],
        [["symbol", "x"], ["+", 0, 0], *(["*", i, i] for i in range(1, 60))],
    ],
)  # fmt: skip
def test_what_grows_without_end_is_refused(nodes):
    """Soon, and as the answer no."""
    with pytest.raises(Refuted):
        multiplied_out(WrittenEquation(nodes))
