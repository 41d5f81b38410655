"""The recheck's own arithmetic encloses what it should, and nothing but Python takes part."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlctl.analysis.recheck import Refuted
from nlctl.analysis.recheck.equations import WrittenEquation, stays
from nlctl.analysis.recheck.integers import ALL, KNOWN_FUNCTIONS, PI_ENCLOSED, Interval

TRUE = {"exp": math.exp, "sin": math.sin, "cos": math.cos, "tanh": math.tanh, "sqrt": math.sqrt,
        "log": math.log, "arctan": math.atan, "absolute": abs}  # fmt: skip
NUMBERS = st.floats(-30, 30)
SHARES = st.floats(0, 1)


def holds(interval, value):
    """Whether an interval contains a float, whose last bits are not sure."""
    room = 1e-13 * (1 + abs(value))
    return interval.bottom - Fraction(room) <= value <= interval.top + Fraction(room)


def between(a, b):
    return Interval.of(Fraction(min(a, b)), Fraction(max(a, b)))


@pytest.mark.parametrize("name", KNOWN_FUNCTIONS)
@given(a=NUMBERS, b=NUMBERS, share=SHARES)
def test_functions_enclose_their_values_and_derivatives(name, a, b, share):
    """At points between the ends, and by difference quotients."""
    if name in ("sqrt", "log"):
        a, b = abs(a) + 1e-3, abs(b) + 1e-3
    x = min(max(a + share * (b - a), min(a, b)), max(a, b))
    value, derivative = KNOWN_FUNCTIONS[name]
    assert holds(value(between(a, b)), TRUE[name](x))
    assert holds(value(ALL), TRUE[name](x))
    tight = value(Interval.of(Fraction(x)))
    assert tight.top - tight.bottom <= Fraction(1, 2**60) * (1 + abs(Fraction(TRUE[name](x))))
    if abs(b - a) > 1e-2:
        slope = (TRUE[name](b) - TRUE[name](a)) / (b - a)  # the derivative somewhere between
        assert holds(derivative(between(a, b)), slope) or holds(
            derivative(between(a, b)) + Interval.of(Fraction(-1, 10**9), Fraction(1, 10**9)), slope
        )


POWERS = st.lists(st.sampled_from([2, 3, 63, 64]), min_size=1, max_size=9)


@given(st.lists(NUMBERS, min_size=2, max_size=2), SHARES, POWERS)
def test_powers_of_powers_end_and_enclose(ends, share, powers):
    """2^(64^9) has no digits that anybody keeps: its ends are rounded outward."""
    x = between(*ends)
    a = x.bottom + Fraction(share) * (x.top - x.bottom)
    nodes = [["symbol", "x"], *(["power", i, n] for i, n in enumerate(powers))]
    found = WrittenEquation(nodes).on({"x": x})
    sign = -1 if a < 0 and all(n % 2 for n in powers) else 1
    bits = math.log2(abs(a.numerator)) - math.log2(a.denominator) if a else -math.inf
    size = math.prod(powers) * bits
    if size < 200:
        power = Fraction(a) ** math.prod(powers) if size > -200 and math.prod(powers) < 500 else 0
        assert found.bottom - Fraction(1, 2**60) <= power <= found.top + Fraction(1, 2**60)
    elif size > 2100 and sign > 0:
        assert found.top == math.inf
    elif size > 2100:
        assert found.bottom == -math.inf


def test_an_equation_that_nobody_can_read_is_refused():
    """Sums of itself, forty times: its text would fill the memory."""
    nodes = [["symbol", "x"], *(["+", i, i] for i in range(40))]
    with pytest.raises(Refuted, match="too long to be read"):
        str(WrittenEquation(nodes))


def test_pi_is_enclosed():
    assert (
        PI_ENCLOSED.bottom
        < Fraction(math.pi) + Fraction(1, 2**51)
        < PI_ENCLOSED.top + Fraction(1, 2**50)
    )
    assert holds(PI_ENCLOSED, math.pi)
    assert PI_ENCLOSED.top - PI_ENCLOSED.bottom < Fraction(1, 2**80)


@given(st.lists(NUMBERS, min_size=4, max_size=4), SHARES, SHARES, st.integers(0, 7))
def test_operations_enclose_their_values(ends, s, r, n):
    """Sums, products, quotients and powers."""
    x, y = between(*ends[:2]), between(*ends[2:])
    a, b = (float(i.bottom) + t * float(i.top - i.bottom) for i, t in ((x, s), (y, r)))
    assert holds(x + y, a + b)
    assert holds(x - y, a - b)
    assert holds(x * y, a * b)
    assert holds(x.power(n), a**n)
    if b:
        assert holds(x / y, a / b)


# x1^2 sin(t) + (1 + 0.2 cos v) v + |x1| v
NODES = [["symbol", "x1"], ["symbol", "t"], ["symbol", "v"], ["power", 0, 2], ["sin", 1],
         ["*", 3, 4], ["number", "1"], ["number", "1/5"], ["cos", 2], ["*", 7, 8], ["+", 6, 9],
         ["*", 10, 2], ["+", 5, 11], ["absolute", 0], ["*", 13, 2], ["+", 12, 14]]  # fmt: skip


def formula(x1, t, v):
    return x1**2 * np.sin(t) + (1 + 0.2 * np.cos(v)) * v + abs(x1) * v


@given(st.lists(NUMBERS, min_size=6, max_size=6), st.lists(SHARES, min_size=3, max_size=3))
def test_an_equation_is_enclosed_on_a_box(ends, shares):
    """Its value, plainly and by the mean value, and its difference quotient in v."""
    box = dict(zip(("x1", "t", "v"), (between(*ends[i : i + 2]) for i in (0, 2, 4)), strict=True))
    point = {
        name: float(side.bottom) + s * float(side.top - side.bottom)
        for (name, side), s in zip(box.items(), shares, strict=True)
    }
    equation, value = WrittenEquation(NODES), formula(**point)
    assert holds(equation.on(box), value)
    assert holds(equation.near_middle(box), value)
    if abs(point["v"]) > 1e-3:
        quotient = (value - formula(**{**point, "v": 0.0})) / point["v"]
        room = Interval.of(Fraction(-1, 10**7), Fraction(1, 10**7))
        assert holds(equation.quotient_on(box) + room, quotient)


def test_a_bound_is_proved_or_not():
    """x (1 - x) <= 1/4 on [0, 1]: a thousandth above it is, a thousandth below it is not."""
    nodes = [
        ["symbol", "x"],
        ["number", "-1"],
        ["*", 0, 1],
        ["number", "1"],
        ["+", 2, 3],
        ["*", 0, 4],
    ]
    equation, box = WrittenEquation(nodes), {"x": Interval.of(0, 1)}
    stays(equation.near_middle, box, Fraction(-1, 10**6), Fraction(251, 1000), "x (1 - x)")
    with pytest.raises(Refuted, match="x \\(1 - x\\)"):
        stays(equation.near_middle, box, Fraction(-1, 10**6), Fraction(249, 1000), "x (1 - x)")


X, Y = ["symbol", "x"], ["symbol", "y"]
NONE = [[], [["+", 0, 0]], [X, ["+", 0, 2], Y], [X, ["eval", 0]], [X, ["power", 0, -1]],
        [X, ["power", 0, 10**9]], [X, ["sin", 0, 0]], [X, ["*", 0, -1]], [X, ["sin", "0"]],
        [X, []], [X, 3], [X, [["sin"], 0]], {}, "x"]  # fmt: skip


@pytest.mark.parametrize("nodes", NONE)
def test_nodes_are_of_nodes_before_them(nodes):
    """Anything else is no equation."""
    with pytest.raises(Refuted):
        WrittenEquation(nodes)
