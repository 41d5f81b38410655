"""Assumption 3: F/v without a pole at v = 0, and its proved range."""

import functools

import numpy as np
import pytest
from flint import arb
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.intervals.arithmetic import Ball
from nlctl.analysis.intervals.branch_and_bound import Box, Undecided
from nlctl.analysis.intervals.quotient import slope_in
from nlctl.analysis.lyapunov.bounds.sector import plant_terms, sector
from nlctl.errors import DiagramError, UnknownNameError

QUOTIENTS = {  # q(v), and (q(v) - q(0))/v in closed form
    "sine": (np.sin, lambda v: np.sinc(v / np.pi)),
    "exponential": (np.exp, lambda v: np.expm1(v) / v),
    "tanh of a shift": (lambda v: np.tanh(v + 1), lambda v: (np.tanh(v + 1) - np.tanh(1)) / v),
    "cube": (lambda v: v**3 + 2, lambda v: v * v),
    "reciprocal": (lambda v: 1 / (2 + v), lambda v: -0.5 / (2 + v)),
    "root": (lambda v: np.sqrt(4 + v), lambda v: 1 / (np.sqrt(4 + v) + 2)),
    "constant": (lambda v: 3.0, lambda v: 0.0),
}


@nlctl.equation
def stiff_spring(x, v):
    x1, x2 = x
    return -x1 * x1 * x1 - x2 + v + np.tanh(v) * np.exp(-x1 * x1)


@nlctl.equation
def wrong_way(x, v):
    return -x[0] + (0.5 + np.sin(x[0])) * v


@functools.cache
def stiff_sector():
    box = Box.of(x1=(-1, 1), x2=(-1, 1), v=(-3, 3))
    return sector(nlctl.PureFeedback(order=2, f=stiff_spring), box, tol=0.01)


@nlctl.equation
def kinked(x, v):
    return -x[0] + (2 * v if x[0] > v else v + x[0])


@pytest.mark.parametrize("name", QUOTIENTS)
@given(v=st.one_of(st.floats(-1.5, -0.01), st.floats(0.01, 1.5)), width=st.floats(0, 0.5))
def test_a_slope_is_the_difference_quotient(name, v, width):
    """On balls around v, also when they contain 0."""
    function, exact = QUOTIENTS[name]
    around = Ball(arb(v, width), (arb(1),))
    assert slope_in(function, around).value.overlaps(arb(float(exact(v)), 1e-12))
    step = min(width, 1e-3) / 2  # the gradient holds the quotient's mean slope, too
    if step > 1e-5:
        mean = (exact(v + step) - exact(v - step)) / (2 * step)
        slope = slope_in(function, around)
        gradient = slope.gradient[0] if slope.gradient else arb(0)
        assert gradient.overlaps(arb(float(mean), 1e-9))


@pytest.mark.parametrize("name", QUOTIENTS)
def test_at_zero_a_slope_is_the_derivative(name):
    """(q(v) - q(0))/v has the limit q'(0), which needs no limit here."""
    function, exact = QUOTIENTS[name]
    at_zero = slope_in(function, 0.0).value
    assert at_zero.overlaps(arb(float(exact(1e-7)), 1e-6))
    assert at_zero.rad() < 1e-12


@pytest.mark.parametrize("tol", [1e-2, 1e-3, 1e-4])
def test_the_sector_of_example_1_is_the_closed_form(tol):
    """F/v = (1 + 0.1 cos x1)(1 + 0.2 cos v): least at x1 = 1, v = pi; greatest at 0, v -> 0."""
    box = Box.of(x1=(-0.85, 1.0), x2=(-0.55, 1.1), v=(-12, 6))
    found = sector(nlctl.plants.ForcedDuffing(), box, tol=tol)
    low, high = (1 + 0.1 * np.cos(1)) * 0.8, 1.1 * 1.2
    for least in (found.m1, found.m4):
        assert least <= low <= least + tol
    for most in (found.m2, found.m3):
        assert most - tol <= high <= most


def test_the_sector_of_example_2_is_the_closed_form():
    """F/v = (2 + cos x1)(1 + 0.2 sin^2 v): least at x1 = 1.1, v = 0; greatest at 0, pi/2."""
    box = Box.of(x1=(-0.85, 1.1), x2=(-0.55, 0.75), x3=(-0.6, 0.6), v=(-2.5, 4.5))
    found = sector(nlctl.plants.Genesio(), box, tol=1e-4)
    assert found.G_min <= 2 + np.cos(1.1) <= found.G_min + 1e-4
    assert found.G_max - 1e-4 <= 3.6 <= found.G_max


def test_the_global_sectors_are_those_of_the_paper_s_plants():
    """Periodicity makes one period global: 0.72 and 1.32, 1 and 3.6."""
    period = {"x1": (-np.pi, np.pi), "x2": (-1, 1), "v": (-np.pi, np.pi)}
    found = sector(nlctl.plants.ForcedDuffing(), Box.of(**period))
    assert (found.G_min, found.G_max) == pytest.approx((0.72, 1.32), abs=1e-3)
    found = sector(nlctl.plants.Genesio(), Box.of(**period, x3=(-1, 1)))
    assert (found.G_min, found.G_max) == pytest.approx((1, 3.6), abs=1e-3)


@pytest.mark.parametrize("first", [True, False])
def test_a_plant_affine_in_v_has_one_sector_for_all_v(first):
    """A factor without v leaves v alone, unbounded or not, on either side of the product."""

    def f(x, v):
        gain = 2 + np.cos(x[0])
        return -x[0] + (gain * v if first else v * gain)

    box = Box.of(x1=(-1, 1), x2=(0, 0), v=(-np.inf, np.inf))
    found = sector(nlctl.PureFeedback(order=2, f=f), box)
    assert (found.G_min, found.G_max) == pytest.approx((2 + np.cos(1), 3), abs=1e-3)


def test_example_1_has_one_sector_for_all_v():
    """An unbounded v is not an obstacle where the quotient stays bounded."""
    box = Box.of(x1=(-1, 1), x2=(-1, 1), v=(-np.inf, np.inf))
    found = sector(nlctl.plants.ForcedDuffing(), box)
    assert found.G_min == pytest.approx((1 + 0.1 * np.cos(1)) * 0.8, abs=2e-3)
    assert found.G_max == pytest.approx(1.32, abs=2e-3)


@given(x1=st.floats(-1, 1), x2=st.floats(-1, 1), v=st.floats(-3, 3))
def test_a_plant_of_one_s_own_lies_in_its_sector(x1, x2, v):
    """m1 v <= F <= m2 v for v >= 0 and m3 v <= F <= m4 v for v < 0, with m4 <= m3."""
    found = stiff_sector()
    F = stiff_spring((x1, x2), v) - stiff_spring((x1, x2), 0.0)
    low, high = (found.m1, found.m2) if v >= 0 else (found.m3, found.m4)
    assert low * v - 1e-12 <= F <= high * v + 1e-12
    assert found.m4 <= found.m3


def test_a_gain_that_changes_its_sign_shows():
    """G_min is negative where 0.5 + sin x1 is: Assumption 3 fails on the box, by that much."""
    plant = nlctl.PureFeedback(order=2, f=wrong_way)
    found = sector(plant, Box.of(x1=(-1, 1), x2=(0, 0), v=(-1, 1)))
    assert found.G_min == pytest.approx(0.5 - np.sin(1), abs=1e-3)


def test_a_quotient_across_branches_is_not_guessed():
    """Where v and 0 lie on one branch the quotient is exact; elsewhere nothing is proved."""
    plant = nlctl.PureFeedback(order=2, f=kinked)
    same = sector(plant, Box.of(x1=(1.5, 2), x2=(0, 0), v=(-1, 1)))
    assert (same.G_min, same.G_max) == pytest.approx((2, 2))
    across = sector(plant, Box.of(x1=(1, 2), x2=(0, 0), v=(3, 4)), max_boxes=100)
    assert across.G_max == np.inf
    assert across.G_min == -np.inf
    assert across.positive.undecided > 0


def test_minimum_of_a_constant_and_v_is_a_slope_where_decided():
    """NumPy's minimum asks the quotient, whichever operand comes first."""
    near, wide = Ball(arb(1, 0.1)), Ball(arb(5, 0.1))
    for least in (lambda v: np.minimum(wide, v), lambda v: np.minimum(v, wide)):
        assert slope_in(least, near).value.contains(1)
    with pytest.raises(Undecided):
        slope_in(lambda v: np.minimum(near, v), Ball(arb(1, 0.1)))


def test_a_box_on_one_side_of_zero_has_one_pair():
    """Without v < 0 there are no m3 and m4."""
    found = sector(nlctl.plants.ForcedDuffing(), Box.of(x1=(0, 1), x2=(0, 1), v=(2, 3)))
    assert np.isnan(found.m3)
    assert np.isnan(found.m4)
    assert found.G_min == found.m1
    assert found.m1 == pytest.approx((1 + 0.1 * np.cos(1)) * (1 + 0.2 * np.cos(3)), abs=1e-3)


def test_a_missing_side_and_a_missing_equation_are_named():
    """The box needs every state, and the plant f and d."""
    with pytest.raises(UnknownNameError, match="x2"):
        sector(nlctl.plants.ForcedDuffing(), Box.of(x1=(0, 1), v=(0, 1)))
    with pytest.raises(DiagramError, match="DeadZone is not a plant"):
        plant_terms(nlctl.DeadZone())
