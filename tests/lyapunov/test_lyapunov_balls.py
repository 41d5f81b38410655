"""Balls: they enclose what the equations compute, and never pick a branch."""

import math

import numpy as np
import pytest
from flint import arb
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.analysis.intervals.arithmetic import JUMPS, Ball, as_ball
from nlctl.analysis.intervals.branch_and_bound import Box, Undecided, enclose, prove
from nlctl.errors import ParameterError, UnknownNameError
from nlctl.expressions.functions import FUNCTIONS as TABLE
from nlctl.expressions.graph import numpy_function
from nlctl.params import equation_arguments

FUNCTIONS = {
    "sin": (np.sin, np.cos),
    "cos": (np.cos, lambda x: -np.sin(x)),
    "exp": (np.exp, np.exp),
    "log": (np.log, lambda x: 1 / x),
    "sqrt": (np.sqrt, lambda x: 0.5 / np.sqrt(x)),
    "sinh": (np.sinh, np.cosh),
    "cosh": (np.cosh, np.sinh),
    "tanh": (np.tanh, lambda x: 1 / np.cosh(x) ** 2),
    "arctan": (np.arctan, lambda x: 1 / (1 + x**2)),
    "cube": (lambda x: x**3, lambda x: 3 * x**2),
    "fourth root of a quotient": (
        lambda x: (2 / (1 + x)) ** 0.25,
        lambda x: -0.25 * 2**0.25 * (1 + x) ** -1.25,
    ),
}
PLANTS = {"duffing": nlctl.plants.ForcedDuffing(), "genesio": nlctl.plants.Genesio()}
share = st.floats(0, 1)


def interval(low, high, gradient=()):
    return Ball(arb(low).union(arb(high)), gradient)


def holds(ball, number):
    """Whether a ball contains a number, up to the rounding of the number itself."""
    return ball.overlaps(arb(float(number), 1e-12 * (1 + abs(float(number)))))


@pytest.mark.parametrize("name", FUNCTIONS)
@given(low=st.floats(0.1, 3), width=st.floats(0, 2), s=share)
def test_a_ball_encloses_the_function_and_its_derivative(name, low, width, s):
    """For every number in the ball, f(x) lies in the value and f'(x) in the gradient."""
    f, derivative = FUNCTIONS[name]
    x = low + s * width
    ball = f(interval(low, low + width, (arb(1),)))
    assert holds(ball.value, f(x))
    assert holds(ball.gradient[0], derivative(x))


@pytest.mark.parametrize("name", PLANTS)
@given(data=st.data())
def test_a_plant_equation_on_balls_encloses_itself_on_numbers(name, data):
    """f(x, v) and d(x, t) are called as they stand, with balls for numbers."""
    plant = PLANTS[name]
    p, n = equation_arguments(plant), len(plant.states)
    low = np.array(data.draw(st.lists(st.floats(-3, 3), min_size=n + 1, max_size=n + 1)))
    width = np.array(data.draw(st.lists(share, min_size=n + 1, max_size=n + 1)))
    point = low + data.draw(share) * width
    balls = tuple(map(interval, low, low + width))
    for term in (plant.f, plant.d):
        assert holds(as_ball(term(balls[:-1], balls[-1], p)).value, term(point[:-1], point[-1], p))


def test_the_gaussian_basis_works_on_balls():
    """Arrays of balls go through the equations of vector blocks."""
    basis = nlctl.controllers.GaussianBasis()
    p = equation_arguments(basis)
    balls = np.array([interval(0.1, 0.2), interval(-0.3, 0.0)], dtype=object)
    psi = basis.output(0.0, (), balls, p)
    exact = basis.output(0.0, (), np.array([0.15, -0.1]), p)
    assert all(holds(a.value, b) for a, b in zip(psi, exact, strict=True))


def test_a_square_is_not_negative():
    """Neither x*x nor x**2 forgets that both factors are the same."""
    x = interval(-1, 1)
    for square in (x * x, x**2):
        assert square.value.lower() >= -1e-8
        assert square.value.upper() <= 1 + 1e-8
    assert (x - x).value.is_zero()


@given(a=st.floats(-2, 2), b=st.floats(-2, 2), wa=share, wb=share, s=share, r=share)
def test_minimum_and_maximum_join_instead_of_choosing(a, b, wa, wb, s, r):
    """They are exact on overlapping balls, without a decision."""
    x, y = interval(a, a + wa), interval(b, b + wb)
    p, q = a + s * wa, b + r * wb
    assert holds(np.minimum(x, y).value, min(p, q))
    assert holds(np.maximum(x, y).value, max(p, q))
    assert holds(abs(x).value, abs(p))


@each_row("other", [interval(0.5, 2), 0.5, np.float64(0.5)])
def test_a_comparison_that_balls_cannot_decide_is_refused(other):
    """The error says so; decided comparisons are plain."""
    x = interval(0, 1)
    for compare in (np.less, np.less_equal, np.greater, np.greater_equal):
        with pytest.raises(Undecided, match="true for some points"):
            bool(compare(x, other))
    assert x < 3
    assert x >= -1
    assert x != 3


def test_nan_is_never_compared():
    """A ball that is not a number leaves every comparison undecided."""
    nan = as_ball(1.0) / interval(-1, 1)
    for compare in (np.less, np.greater, np.equal):
        with pytest.raises(Undecided, match="not a number"):
            bool(compare(nan, 0.0))


def test_a_range_is_tight_to_the_tolerance():
    """x1^2 + x1 x2 on [-1, 2] x [-1, 1] has the range [-1/4, 6] (corner, and x1 = 1/2)."""
    box = Box.of(x1=(-1, 2), x2=(-1, 1))
    for tol in (1e-1, 1e-3, 1e-6):
        found = enclose(lambda x: x[0] * x[0] + x[0] * x[1], box, tol=tol)
        assert found.low <= -0.25 <= found.least
        assert found.greatest <= 6 <= found.high
        assert found.least - found.low <= tol
        assert found.high - found.greatest <= tol
        assert found.undecided == 0


def test_every_branch_is_followed():
    """A jump inside the box is in the range, whichever side is narrow."""

    def step(x):
        return 1.0 if x[0] >= 0.3 else -2.0

    found = enclose(step, Box.of(x=(0, 0.3)), tol=1e-6)
    assert found.low <= -2
    assert found.high >= 1


@given(b_r=st.floats(0.1, 2), b_l=st.floats(-2, -0.1), u=st.floats(-3, 3))
def test_the_dead_zone_lies_in_its_proved_range(b_r, b_l, u):
    """The actuator's own equation, with break points in the box."""
    zone = nlctl.DeadZone(b_r=b_r, b_l=b_l)
    p = equation_arguments(zone)
    found = enclose(lambda x: zone.output(0.0, (), x, p)[0], Box.of(u=(-3, 3)), tol=0.05)
    assert found.low <= zone.output(0.0, (), (u,), p)[0] <= found.high


def test_a_function_without_value_has_no_bound():
    """0/0 in the box: the range is infinite, and boxes are counted as undecided."""
    found = enclose(lambda x: x[0] / x[0] / x[0], Box.of(x=(-1, 1)), max_boxes=300)
    assert found.high == np.inf
    assert found.undecided > 0


def test_a_disturbance_is_bounded_for_all_time():
    """q cos(w t) with q = 5 + 0.1 cos t stays within 5.1, chirp or not."""
    for integrate in (False, True):
        plant = nlctl.plants.ForcedDuffing(integrate_w=integrate, d_amplitude=0.0)
        p = equation_arguments(plant)
        found = enclose(lambda z, f=plant.d, p=p: f((0, 0), z[0], p), Box.of(t=(0, np.inf)))
        assert found.magnitude == pytest.approx(5.1, abs=1e-6)


def test_a_true_claim_is_proved_and_a_false_one_refuted_at_a_point():
    """sin x <= 1 - 1e-4 fails near pi/2, and 1 + 1e-9 is an upper bound."""
    box = Box.of(x=(0, 3))
    assert prove(lambda x: np.sin(x[0]), box, high=1 + 1e-8).holds is True
    false = prove(lambda x: np.sin(x[0]), box, high=1 - 1e-4)
    assert false.holds is False
    assert np.sin(false.where["x"]) > 1 - 1e-4


def test_what_the_boxes_leave_open_is_undecided():
    """With too few boxes a claim is neither proved nor refuted, and the rest is counted."""
    left = prove(lambda x: x[0] - x[0] * x[0], Box.of(x=(0, 1)), high=0.25 + 1e-9, max_boxes=5)
    assert left.holds is None
    assert left.undecided > 0


@pytest.mark.slow
@given(x=st.floats(-1, 1), y=st.floats(-1, 1))
def test_a_proof_on_a_box_holds_at_its_points(x, y):
    """x^2 + y^2 - x y >= 0 with a margin, on numbers as on balls."""

    def f(z):
        return z[0] * z[0] + z[1] * z[1] - z[0] * z[1]

    proof = prove(f, Box.of(x=(-1, 1), y=(-1, 1)), low=-1e-3, high=3 + 1e-3)
    assert proof.holds
    assert -1e-3 <= f((x, y)) <= 3 + 1e-3


def test_a_box_refuses_what_is_no_interval():
    """Ends in order, no NaN, and known sides."""
    for ends in ((1, 0), (np.nan, 1)):
        with pytest.raises(ParameterError, match="side x1"):
            Box.of(x1=ends)
    with pytest.raises(UnknownNameError, match="x1"):
        Box.of(x1=(0, 1))["x_1"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [n for n, row in TABLE.items() if row.enclosure and n not in JUMPS]
)
@given(data=st.data())
def test_every_function_of_the_table_is_enclosed_with_its_derivative(name, data):
    """A ball of an interval holds the values inside it, its gradient their difference quotients."""
    low, high = {"arccosh": (1.1, 4.0), "log1p": (-0.9, 4.0)}.get(name, (-0.95, 0.95))
    low = 0.1 if name in ("log", "log2", "log10", "sqrt") else low
    ends = data.draw(st.lists(st.floats(low, high), min_size=2, max_size=2))
    a, b = sorted(ends)
    function = numpy_function(name)
    ball = function(Ball(arb(a).union(arb(b)), (arb(1),)))
    inside = np.linspace(a, b, 9)
    for x in inside:
        value = float(function(x))
        assert (ball.value + arb(0, 4e-15 * max(1.0, abs(value)))).contains(arb(value))
    if b - a > 1e-3:
        quotient = (function(b) - function(a)) / (b - a)
        assert (ball.gradient[0] + arb(0, 1e-11)).contains(arb(float(quotient)))


@given(ends=st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2))
def test_the_cube_root_of_a_ball_undoes_the_cube(ends):
    """It rises, also through 0: it holds the roots, and is wider by roundings of radii alone."""
    a, b = sorted(ends)
    ball = interval(a, b)
    root, room = np.cbrt(ball).value, 1e-7 * (max(abs(a), abs(b)) + 1e-9)
    assert holds(root, np.cbrt(0.5 * (a + b)))
    assert abs(float(root.lower()) ** 3 - float(ball.value.lower())) <= room
    assert abs(float(root.upper()) ** 3 - float(ball.value.upper())) <= room


@pytest.mark.parametrize(("name", "largest"), [("sin", 1), ("cos", 1), ("tanh", 1), ("arctan", 2)])
def test_what_is_bounded_everywhere_is_bounded_on_the_whole_line(name, largest):
    """Also where a side of the box is infinite, as time is; what is not a number stays none."""
    assert abs(numpy_function(name)(Ball(arb(0, "inf"))).value) <= largest + 0.1
    assert numpy_function(name)(Ball(arb("nan"))).value.is_nan()


def test_numbers_of_numpy_on_the_left_of_a_ball():
    """np.float64 and arrays compute with balls as plain numbers do."""
    ball = Ball(arb(2), (arb(1),))
    for made in (np.float64(3.0) * ball, np.int64(3) * ball, ball * np.float64(3.0)):
        assert made.value == arb(6)
    assert [b.value for b in np.array([1.0, 2.0]) - ball] == [arb(-1), arb(0)]
    jumps = np.floor(Ball(arb(1.5).union(arb(2.5)), (arb(1),)))
    assert jumps.value.contains(1)
    assert jumps.value.contains(2)
    assert not jumps.gradient[0].is_finite()
    assert np.floor(Ball(arb(1.25))).value == arb(1)


PARTLY_NO_NUMBERS = {
    "the smaller of a root": (lambda x: np.minimum(np.sqrt(x[0]), 1.0), {"x": (-1, 1)}),
    "the smaller of a root and of another side": (
        lambda x: np.minimum(np.minimum(x[1], np.sqrt(x[0])), 2.0), {"x": (-1, 1), "y": (0, 1)}),
    "the larger of a logarithm": (lambda x: np.maximum(np.log(x[0]), 0.0), {"x": (-1, 1)}),
    "the smaller, as Python has it": (lambda x: min(np.sqrt(x[0]), 1.0), {"x": (-1, 1)}),
    "0 log(0)": (lambda x: x[0] * np.log(x[0]), {"x": (0, 4)}),
    "a logarithm that begins at its pole": (lambda x: np.log(x[0]), {"x": (0, 4)}),
}  # fmt: skip


@each_row("function, sides", PARTLY_NO_NUMBERS.values(), ids=PARTLY_NO_NUMBERS)
def test_nothing_is_proved_of_what_is_no_number_somewhere(function, sides):
    """NaN is below no bound, and above none; a pole is no value."""
    box = Box.of(**sides)
    for claim in ({"high": 1e3}, {"low": -1e3}):
        assert prove(function, box, **claim, max_boxes=2_000).status != "proved"
    found = enclose(function, box, max_boxes=2_000)
    assert (found.low, found.high) == (-np.inf, np.inf)


def test_the_least_of_numbers_keeps_its_bounds():
    """x^2 - x + 0.3 >= 0.05 has a root, which boxes show once they are small enough."""
    box = Box.of(x=(0, 1), y=(0, 2))
    least = lambda x: np.minimum(x[1], np.sqrt(x[0] * x[0] - x[0] + 0.3))  # noqa: E731
    assert prove(least, box, high=0.56).holds
    assert prove(least, box, low=-1e-9).holds
    assert prove(least, box, high=0.54).holds is False


def test_functions_of_floats_alone_are_refused_with_those_that_take_any_number():
    with pytest.raises(ParameterError, match=r"np\.sin and not math\.sin"):
        enclose(lambda x: math.sin(x[0]), Box.of(x=(0.0, 1.0)))
    assert enclose(lambda x: np.sin(x[0]), Box.of(x=(0.0, 1.0))).high >= math.sin(1.0)
