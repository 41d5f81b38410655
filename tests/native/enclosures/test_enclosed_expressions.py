"""Enclosures of random expressions: no sample outside, the verdicts of balls, and bounds."""

from fractions import Fraction

import numpy as np
import pytest
from examples import many
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st
from random_expressions import ball_of, random_boxes, random_graph, random_points

from nlctl.analysis.intervals.arithmetic import Ball
from nlctl.expressions.derivatives import tangents
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Graph, needed
from nlctl.native.enclosures.boxes import enclosed, expressions_of
from nlctl.native.enclosures.divide import decide_claim, enclose_supremum
from nlctl.native.enclosures.scalars import UnroundedGraph

ROUNDING = 1e-9  # of a sample's own floats, relative: they are rounded at every step


def outside(code, low, high, points):
    """How many samples of each expression lie outside, and how many were taken."""
    count, boxes, sides = points.shape
    ends = code.values(low, high)
    assert np.array_equal(np.isnan(ends[0]), np.isnan(ends[1]))
    assert not np.any(ends[0] > ends[1])
    missed = taken = 0
    arrays = {"x": points.reshape(-1, sides).T}
    for k, expr in enumerate(code.expressions):
        nodes = needed([expr])
        found = evaluate_expressions(nodes, arrays)
        every = [np.broadcast_to(v.astype(float), count * boxes) for v in found]
        overflown = np.isinf(every).any(axis=0).reshape(count, boxes)
        value = every[-1].reshape(count, boxes)
        a, b = (v[:, k] for v in ends)
        with np.errstate(all="ignore"):
            room = ROUNDING * (1 + np.abs(value))
            holds = (a - room <= value) & (value <= b + room)
        holds |= np.isnan(a) | (overflown & np.isnan(value))
        missed, taken = missed + np.sum(~holds), taken + count * np.sum(~np.isnan(a))
    return missed, taken


@pytest.mark.parted
@pytest.mark.parametrize("seed", range(6))
def test_no_sample_of_a_random_expression_is_outside(seed):
    """All operations, with poles, jumps, ends of domains, points and sides without an end."""
    rng = np.random.default_rng(seed)
    taken = 0
    for _ in range(6):
        exprs, sides = random_graph(rng)
        low, high = random_boxes(rng, 40, sides, unbounded=0.05)
        missed, n = outside(enclosed(exprs, sides), low, high, random_points(rng, low, high, 100))
        assert missed == 0
        taken += n
    assert taken > 20_000


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=many(25, part=3))
def test_a_smaller_box_has_a_smaller_range(seed):
    """Inclusion is monotone, to the rounding of functions: and what has a value keeps it."""
    rng = np.random.default_rng(seed)
    exprs, sides = random_graph(rng)
    low, high = random_boxes(rng, 24, sides)
    inner = np.sort(random_points(rng, low, high, 2), axis=0)
    code = enclosed(exprs, sides)
    outside, inside = code.values(low, high), code.values(*inner)
    known = ~np.isnan(outside[0])
    with np.errstate(all="ignore"):
        room = ROUNDING * (1 + np.abs(inside[0]) + np.abs(inside[1]))
        holds = (outside[0] - room <= inside[0]) & (inside[1] <= outside[1] + room)
    holds |= (outside[0] == -np.inf) & (outside[1] == np.inf)
    assert np.all((holds | (room == np.inf))[known])
    assert not np.any(np.isnan(inside[0]) & known)


@pytest.mark.weekly
def test_none_of_a_hundred_million_samples_is_outside():
    """The same for 1e8 samples."""
    rng, taken = np.random.default_rng(99), 0
    while taken < 100_000_000:
        exprs, sides = random_graph(rng)
        low, high = random_boxes(rng, 400, sides, unbounded=0.05)
        code = enclosed(exprs, sides)
        missed, n = outside(code, low, high, random_points(rng, low, high, 1_000))
        assert missed == 0
        taken += n


def ball_box(low, high):
    return [
        Ball(arb(a) if a == b else arb(a).union(arb(b))) for a, b in zip(low, high, strict=True)
    ]


def compared_with_balls(rng, expressions):
    """How often the sign of a value is proved by floats and refuted by balls, and how often both.

    For points, at which balls are sharp, floats must hold them.
    """
    both = against = 0
    for _ in range(expressions // 4):
        exprs, sides = random_graph(rng, depth=3)
        low, high = random_boxes(rng, 4, sides)
        high[:2] = low[:2]
        code = enclosed(exprs, sides)
        ends = code.values(low, high)
        for box in range(4):
            for k, expr in enumerate(code.expressions):
                a, b = ends[0][box, k], ends[1][box, k]
                ball = ball_of(expr, ball_box(low[box], high[box]))
                if not ball.is_finite() or np.isnan(a):
                    continue
                both += 1
                against += (a > 0 and bool(ball < 0)) or (b < 0 and bool(ball > 0))
                assert ball.overlaps(arb(a).union(arb(b)) if np.isfinite(b - a) else ball)
    return both, against


def test_floats_and_balls_do_not_contradict_each_other():
    """Two enclosures of one set meet, and so no sign is proved against the other."""
    both, against = compared_with_balls(np.random.default_rng(5), 200)
    assert against == 0
    assert both > 300


@pytest.mark.weekly
def test_ten_thousand_expressions_have_the_verdict_of_balls():
    """The same for 10,000 expressions."""
    both, against = compared_with_balls(np.random.default_rng(6), 10_000)
    assert against == 0
    assert both > 10_000


def function_code(function, sides):
    return enclosed(expressions_of(function, sides)[1], sides)


BOX = np.array([-1.0, -2.0]), np.array([2.0, 1.5])


@pytest.mark.parted
@pytest.mark.parametrize(
    ("function", "supremum"),
    [
        (lambda x: x[0] * (1 - x[0]) + 0.0 * x[1], 0.25),
        (lambda x: -((x[0] - 0.3) ** 2) - (x[1] + 0.7) ** 2, 0.0),
        (lambda x: np.sin(3 * x[0]) * np.cos(x[1]), 1.0),
        (lambda x: np.exp(-x[0] * x[0]) - np.abs(x[1]), 1.0),
        (lambda x: np.minimum(x[0], -x[1]) + np.maximum(0.0, x[1]), 2.0),
        (lambda x: np.where(x[0] > 0.5, 1.0, x[1]), 1.5),
        (lambda x: np.floor(2.5 * x[0]) + np.tanh(x[1]), 5 + np.tanh(1.5)),
    ],
)
def test_a_supremum_has_its_closed_form(function, supremum):
    """To nine digits where that is what is asked for, and never below."""
    found = enclose_supremum(
        function_code(function, 2), *BOX, tol=1e-9, max_boxes=200_000, hopeless=5_000
    )
    assert supremum - 1e-15 <= found.high <= supremum + 1.1e-9
    assert found.attained <= supremum + 1e-15


def test_a_supremum_in_time_without_end():
    """sin t for all t >= 0 has 1, t itself none."""
    low, high = np.array([0.0, 0.0]), np.array([1.0, np.inf])
    code = function_code(lambda x: x[0] * np.sin(x[1]), 2)
    assert (
        1.0
        <= enclose_supremum(code, low, high, tol=1e-6, max_boxes=5_000, hopeless=500).high
        < 1.00001
    )
    code = function_code(lambda x: x[0] + x[1], 2)
    found = enclose_supremum(code, low, high, tol=1e-6, max_boxes=5_000, hopeless=500)
    assert found.high == np.inf
    assert found.unbounded


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_a_verdict_is_the_same_for_any_number_of_threads(threads):
    """Also in what it has cost, and where a claim is refuted."""
    code = function_code(lambda x: np.sin(20 * x[0]) * np.sin(20 * x[1]) - 1e-3 * (x[0] + x[1]), 2)
    for bound in (1.0032, 1.0):
        one, other = (
            decide_claim(code, *BOX, bound, max_boxes=300_000, threads=n) for n in (1, threads)
        )
        assert (one.holds, one.boxes, one.undecided) == (other.holds, other.boxes, other.undecided)
        assert np.array_equal(one.point, other.point, equal_nan=True)


def test_what_is_attained_is_not_decided_by_a_strict_claim():
    """(x - y)^2 > 0 fails where x = y: boxes get as small as floats, and that is said."""
    code = function_code(lambda x: -np.abs(x[0] - x[1]) + 0.0 * x[0], 2)
    found = decide_claim(code, *BOX, -1e-30, max_boxes=3_000)
    assert found.holds is not True


def test_a_parabola_with_a_margin_is_proved_and_refuted_at_a_point():
    """x (1 - x) <= 0.2500001 holds, <= 0.2499999 does not, and a point shows it."""
    code = function_code(lambda x: x[0] * (1 - x[0]), 1)
    ends = np.array([0.0]), np.array([1.0])
    assert decide_claim(code, *ends, 0.2500001, max_boxes=1_000).holds is True
    found = decide_claim(code, *ends, 0.2499999, max_boxes=1_000)
    assert found.holds is False
    assert found.point[0] * (1 - found.point[0]) > 0.2499999


def test_vectors_are_enclosed_element_by_element():
    """A sum over a vector of twelve is that of its elements."""
    graph = Graph()
    vector = graph.node("leaf", data=("x", 0, 1), size=12, varies=True)
    total = graph.sum(graph.op("mul", vector, graph.table(range(12))), 12)
    low = np.zeros((1, 12))
    a, b = enclosed([total], 12).values(low, low + 1.0)
    assert abs(a[0, 0]) < 1e-300
    assert 66.0 <= b[0, 0] < 66.0 + 1e-12


def test_constants_of_a_derivative_are_not_rounded():
    """(0.1 (0.3 x))' is the product of two floats, which is not a float."""
    graph = UnroundedGraph()
    inner = graph.op("mul", graph.const(0.3), graph.leaf("x", 0, None))
    outer = graph.op("mul", graph.const(0.1), inner)
    (slope,) = tangents(graph, [outer], lambda leaf: graph.const(1.0))
    at = np.zeros((1, 1))
    low, high = enclosed([slope], 1).values(at, at)
    exact = Fraction(0.1) * Fraction(0.3)
    assert Fraction(float(low[0, 0])) < exact < Fraction(float(high[0, 0]))
    assert high[0, 0] - low[0, 0] < 1e-16
    half = graph.op("mul", graph.const(0.5), graph.const(0.3))
    assert half.op == "const"  # nothing is rounded


def above_supremum(rng, expressions, boxes=20, count=100):
    """How many samples are above a supremum, for which boxes are divided; and how many were taken.

    Bounds are those of the mean-value form, too, where nothing jumps.
    """
    missed = taken = 0
    for _ in range(expressions // 2):
        exprs, sides = random_graph(rng, count=2, depth=4)
        low, high = random_boxes(rng, boxes, sides, unbounded=0.03)
        points = random_points(rng, low, high, count)
        for expr in exprs:
            code = enclosed([expr], sides)
            limits = {"tol": 1e-6, "max_boxes": 64, "hopeless": 64}
            bound = [enclose_supremum(code, *box, **limits).high for box in zip(low, high)]  # noqa: B905
            nodes = needed(code.expressions)
            found = evaluate_expressions(nodes, {"x": points.reshape(-1, sides).T})
            every = [np.broadcast_to(v.astype(float), count * boxes) for v in found]
            value = every[-1].reshape(count, boxes)
            overflown = np.isinf(every).any(axis=0).reshape(count, boxes)
            with np.errstate(all="ignore"):
                largest = np.nanmax(np.where(np.isfinite(every), np.abs(every), 0.0), axis=0)
                room = ROUNDING * (1 + largest.reshape(count, boxes))
                holds = (value <= np.array(bound) + room) | (overflown & np.isnan(value))
            holds |= np.isinf(bound)
            missed, taken = missed + np.sum(~holds), taken + count * np.sum(np.isfinite(bound))
    return missed, taken


def test_no_sample_is_above_a_supremum():
    """Of random expressions, with corners, jumps and poles; where it is finite it exists."""
    missed, taken = above_supremum(np.random.default_rng(11), 60)
    assert missed == 0
    assert taken > 20_000


@pytest.mark.weekly
def test_no_sample_of_a_thousand_expressions_is_above_a_supremum():
    """The same for 2,000 expressions."""
    missed, taken = above_supremum(np.random.default_rng(12), 2_000)
    assert missed == 0
    assert taken > 1_000_000
