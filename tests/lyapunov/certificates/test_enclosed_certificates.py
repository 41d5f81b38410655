"""Certificates by machine code and on balls alone: the same verdicts, and no looser bounds."""

import pytest

import nlctl
from nlctl.analysis.intervals.machine import only_balls
from nlctl.analysis.lyapunov import Box, certify, enclose, prove, sector


def known_sign(order, Gamma=10.0):
    robust = nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5)
    weights = nlctl.controllers.AdaptiveWeights(Gamma=Gamma)
    controller = nlctl.adaptive_neural(
        order, law=nlctl.controllers.KnownSignLaw(), weights=weights, robust=robust
    )
    return {2: nlctl.paper.example_1, 3: nlctl.paper.example_2}[order](controller=controller)


@pytest.mark.parametrize("order", [2, 3])
def test_both_examples_have_bounds_that_are_no_looser(order):
    """To 1e-9, relative; the record says what proved them."""
    loop = known_sign(order)
    found = certify(loop)
    with only_balls():
        reference = certify(loop)
    assert found.status == reference.status == "proved"
    assert found.C_0 <= reference.C_0 * (1 + 1e-9)
    assert found.u_max <= reference.u_max * (1 + 1e-9)
    assert (found.region.arithmetic, reference.region.arithmetic) == ("floats", "balls")
    need, other = found.region, reference.region
    assert need.matched <= other.matched * (1 + 1e-9)
    assert need.G_min >= other.G_min * (1 - 1e-9) or need.C > other.C
    shown = {row.symbol: row.how for row in found.constants}
    assert "floats rounded outwards" in shown["sup |g + d|"]


def test_a_range_is_no_wider_than_that_of_balls():
    """Both ends, at the same tolerance."""
    box, f = Box.of(x=(-1, 2), y=(0, 3)), lambda z: z[0] ** 3 - z[0] * z[1] + z[1] ** 2
    found = enclose(f, box, tol=1e-4)
    with only_balls():
        reference = enclose(f, box, tol=1e-4)
    assert (found.arithmetic, reference.arithmetic) == ("floats", "balls")
    assert reference.low - 1e-9 <= found.low <= found.least
    assert found.greatest <= found.high <= reference.high + 1e-9


def test_what_cannot_be_traced_is_proved_on_balls():
    """A sector's own quotient of cos v, for one: the same function, the other arithmetic."""
    box = Box.of(x1=(-1, 1), x2=(-1, 1), v=(0, 5))
    assert sector(nlctl.plants.ForcedDuffing(), box).positive.arithmetic == "balls"
    table = {0.0: 1.0}
    claim = prove(lambda z: z[0] * table.get(0.0), Box.of(x=(0, 1)), high=1.5)
    assert claim.holds
