"""Assumption 1: v = k u + eps_u with proved bounds, and actuators that have no such split."""

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.lyapunov.bounds.decomposition import (
    Decomposition,
    DecompositionError,
    clipped_split,
    decompose,
)
from nlctl.params import equation_arguments


@nlctl.record
class SmoothLimit:
    limit: float = nlctl.param(20.0, unit="1", meaning="largest output", above=0)
    inputs, outputs, states, feedthrough = ("u",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (p.limit * np.tanh(u[0] / p.limit),)


@nlctl.record
class Offset:
    """v = 2 u + bias, which declares eps_u in [0, claimed]."""

    bias: float = nlctl.param(0.3, unit="1", meaning="output at u = 0")
    claimed: float = nlctl.param(0.3, unit="1", meaning="declared bound")
    inputs, outputs, states, feedthrough = ("u",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (2 * u[0] + p.bias,)

    def decomposition(self, u_max):
        return Decomposition(
            k_1=2.0,
            k_2=2.0,
            eps_low=0.0,
            eps_high=self.claimed,
            part=lambda u, v: 2.0 * u,
            provenance="given",
            how="declared",
            over=f"|u| <= {u_max:g}",
        )


def output(actuator, u):
    return actuator.output(0.0, (), (u,), equation_arguments(actuator))[0]


def assert_split(found, u, v):
    """(2) and (3) at one point."""
    k, eps_u = found.gain(u, v), found.eps_u(u, v)
    assert k * u + eps_u == pytest.approx(v, abs=1e-12 * (1 + abs(v)))
    assert found.k_1 - 1e-9 <= k <= found.k_2 + 1e-9
    assert found.eps_low - 1e-9 <= eps_u <= found.eps_high + 1e-9
    assert abs(eps_u) <= found.eps_star + 1e-9


ZONE = nlctl.DeadZone()
BOUNDS = {"textbook": None, "tight": (0.6, 1.3), "lower": (0.2, 1.3)}
WIDE = SmoothLimit(limit=1e4)  # over |u| <= 30 a gain close to 1
split = functools.cache(decompose)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("name", BOUNDS)
@given(u=st.floats(-60, 60, allow_subnormal=False))
def test_every_split_of_the_dead_zone_holds_at_every_input(name, u):
    """v = k u + eps_u within the bounds, whatever the split."""
    assert_split(split(ZONE, k=BOUNDS[name]), u, output(ZONE, u))


def test_the_textbook_split_has_the_closed_form_bounds():
    """k in [0.6, 1.3], eps_u* = 1.3 b_r: the sup of m(u) b is attained."""
    found = split(ZONE)
    assert (found.k_1, found.k_2, found.eps_star) == pytest.approx((0.6, 1.3, 0.65))
    assert found.eps_high == pytest.approx(0.3)  # m_l b_l at cos u = 1, and -u inside
    at_crest = np.pi / 2
    assert found.eps_u(at_crest, output(ZONE, at_crest)) == pytest.approx(-0.65)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("k_1", [0.6, 0.3, 0.1])
def test_a_smaller_gain_buys_a_smaller_error(k_1):
    """eps_u* of the clipped split is k_1 max(b_r, |b_l|) for k_1 up to the least slope."""
    found = decompose(ZONE, k=(k_1, 1.3), tol=1e-3)
    assert k_1 * 0.5 <= found.eps_star <= k_1 * 0.5 + 1.1e-3
    assert found.provenance == "proved"


@given(
    u=st.floats(-40, 40),
    v=st.floats(-60, 60),
    k_1=st.floats(0.1, 1),
    k_2=st.floats(1, 3),
    s=st.floats(0, 1),
)
def test_no_gain_within_the_bounds_leaves_less_than_the_clipped_split(u, v, k_1, k_2, s):
    """|v - k u| >= |v - part(u, v)| for every k in [k_1, k_2]."""
    rest = abs(v - clipped_split(k_1, k_2)(u, v))
    assert rest <= abs(v - (k_1 + s * (k_2 - k_1)) * u) + 1e-9


@pytest.mark.parametrize("slopes", [(1.2, 1.2), (1.0, 1.3)])
@given(us=st.lists(st.floats(-20, 20, allow_subnormal=False), min_size=1, max_size=8))
def test_backlash_stays_within_its_split_along_every_input(slopes, us):
    """Memory carried from input to input by the play operator itself."""
    play = nlctl.Backlash(m_r=slopes[0], m_l=slopes[1])
    p, memory = equation_arguments(play), 0.0
    for u in us:
        (memory,) = play.output(0.0, (memory,), (u,), p)
        assert_split(split(play), u, memory)


def test_the_error_of_backlash_is_its_gap():
    """eps_u in [-m c_r, -m c_l] = [-0.6, 0.72], both ends attained."""
    found = split(nlctl.Backlash())
    assert (found.eps_low, found.eps_high) == pytest.approx((-0.6, 0.72))
    assert found.over == "all u"


def test_the_proved_split_of_backlash_agrees_with_the_closed_form():
    """Branch and bound through the play's own equation finds the same gap."""
    found = decompose(nlctl.Backlash(), k=(1.2, 1.2), tol=1e-3)
    assert found.eps_low == pytest.approx(-0.6, abs=2e-3)
    assert found.eps_high == pytest.approx(0.72, abs=2e-3)


@given(u=st.floats(-30, 30, allow_subnormal=False))
def test_a_memoryless_actuator_of_one_s_own_is_split_by_its_bounds(u):
    """A limit far beyond u_max is a gain close to 1 there."""
    assert_split(split(WIDE, k=(0.9, 1.0), u_max=30.0), u, output(WIDE, u))


def test_saturation_is_refused_with_the_reason():
    """eps_u grows with u: (2) has no eps_u*."""
    with pytest.raises(DecompositionError, match=r"SmoothLimit is not of the form \(2\).*reaches"):
        decompose(SmoothLimit(), k=(0.2, 1.0))
    with pytest.raises(DecompositionError, match="give the bounds"):
        decompose(SmoothLimit())


def test_a_declared_split_is_used_and_a_wrong_one_refuted():
    """The message names an input at which the declared bounds fail."""
    assert decompose(Offset()).eps_star == 0.3
    with pytest.raises(DecompositionError, match=r"Offset declares.*at u = -60.*eps_u is 0.5"):
        decompose(Offset(bias=0.5))


def test_a_gain_that_is_not_positive_is_refused():
    """Assumption 1 wants 0 < k_1 <= k_2."""
    with pytest.raises(nlctl.errors.ParameterError, match="k_1"):
        decompose(ZONE, k=(0.0, 1.0))
    with pytest.raises(DecompositionError, match="Assumption 1"):
        dataclasses.replace(decompose(Offset()), k_1=-1.0)
