"""Whether the compact set closes: least fixed points of boxes, against closed forms and proofs."""

import dataclasses
import functools

import numpy as np
import pytest
from examples import many, some
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import nlctl
from nlctl.analysis.lyapunov import Box, constants, premises, read_parts
from nlctl.analysis.lyapunov.bounds.error_bounds import KAPPA, reference_bounds
from nlctl.analysis.lyapunov.conclusions import FARTHEST, StateReach, closed_set, least_bound
from nlctl.params import equation_arguments


def affine(p):
    """x1'' = -p x1 + v, of which sup |g| over |x1| <= X is p X."""

    @nlctl.equation
    def f(x, v):
        return -p * x[0] + v

    return nlctl.PureFeedback(order=2, f=f, initial={"x1": 0.5})


def scalar_network(p):
    """The plant above behind a gain of 1, with the paper's controller without its network."""
    controller = nlctl.controllers.ablations(nlctl.adaptive_neural(2))["no network"]
    return nlctl.paper.example_1(
        plant=affine(p), actuator=nlctl.actuators.Gain(k=1.0), controller=controller
    )


def reach_of(loop, start):
    parts = read_parts(loop)
    reference = parts.roles.spec("reference")
    yd = reference.output(0.0, (), (), equation_arguments(reference))
    e0 = tuple(arb(x) - arb(float(y)) for x, y in zip(start, yd, strict=False))
    return StateReach(lambdas=tuple(parts.filtered_error.lambdas), e0=e0, reference=reference)


def found_on(loop, start, sides, v=(-1.0, 1.0), **settings):
    names = [f"x{i + 1}" for i in range(len(sides))]
    box = Box.of(**{n: (-a, a) for n, a in zip(names, sides, strict=True)}, v=v)
    found = constants(loop, box, **settings)
    return found, premises(found).gains, reach_of(loop, start)


def least_by_hand(p, gains, reach):
    """Return the least X1 >= x1 reached by sqrt(2 (alpha_0/alpha_1 + V(0))) / lambda + sup yd."""
    rate = min(2 * gains.beta, gains.sigma_2 * gains.gamma)

    def excess(x):
        delta = p * x
        alpha_0 = KAPPA * gains.tau * delta + gains.sigma_2 * delta**2 / 2
        V_0 = gains.r_0**2 / 2 + delta**2 / (2 * gains.gamma)
        C = np.sqrt(2 * (alpha_0 / rate + V_0))
        return max(C / reach.lambdas[0], 0.5) + reference_bounds(reach.reference)[0] - x

    return brentq(excess, 0.0, 1e9) if excess(1e9) < 0 else np.inf


@settings(max_examples=many(12, part=2), deadline=None)
@given(st.floats(0.05, 1.2))
def test_a_box_that_closes_is_the_least_fixed_point(p):
    """Against the scalar equation that is left without a network; the room is that of the proof."""
    loop = scalar_network(p)
    found, gains, reach = found_on(loop, (0.5, 0.0), (0.6, 0.6))
    closure = closed_set(found, gains, reach)
    assert closure.status == "closes"
    least = least_by_hand(p, gains, reach)
    assert least * (1 - 0.05) <= closure.box[0] <= 1.21 * least
    assert closure.room >= 0
    assert all(b <= a for a, b in zip(closure.box, reach(closure.C_0), strict=True))


@pytest.mark.weekly
@settings(max_examples=many(12, part=2), deadline=None)
@given(st.floats(1.31, 40.0))
def test_where_the_map_grows_faster_than_the_box_none_closes(p):
    """Beyond p = lambda / sqrt(sigma_2/alpha_1 + 1/gamma) there is no fixed point."""
    loop = scalar_network(p)
    found, gains, reach = found_on(loop, (0.5, 0.0), (0.6, 0.6))
    rate = min(2 * gains.beta, gains.sigma_2 * gains.gamma)
    critical = reach.lambdas[0] / np.sqrt(gains.sigma_2 / rate + 1 / gains.gamma)
    assert critical == pytest.approx(1.299, abs=1e-3)
    assert p > critical
    assert least_by_hand(p, gains, reach) == np.inf
    closure = closed_set(found, gains, reach)
    assert closure.status == "none closes"
    assert closure.room < 0
    assert max(closure.box) <= FARTHEST < max(reach(closure.C_0))


@functools.cache
def published(number):
    loop = nlctl.paper.EXAMPLES[f"example_{number}"]()
    sides, start = {1: ((1.0, 1.1), (0.5, 0.0)), 2: ((1.1, 0.75, 0.6), (1.0, 0.0, 0.0))}[number]
    return loop, *found_on(loop, start, sides, (-12.0, 6.0), W=np.zeros(27)), sides


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_with_the_published_gains_none_closes_whatever_the_weights(number):
    """Not even with weights chosen for each box: the constants are less than the true ones."""
    _, found, gains, reach, _ = published(number)
    free = dataclasses.replace(
        found,
        entries=tuple(
            dataclasses.replace(e, provenance="computed") if e.symbol == "|W|" else e
            for e in found.entries
        ),
    )
    for own in (found, free):
        assert closed_set(own, gains, reach, Q=0.5).status == "none closes"


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, pytest.param(2, marks=pytest.mark.weekly)])
def test_no_weights_have_less_than_the_least_bound(number):
    """C_0 of random weights on boxes of several sizes, proved, against what it is at least."""
    loop, found, gains, _, sides = published(number)
    rng = np.random.default_rng(number)
    for factor in some((1.0, 0.5, 3.0)):
        ends = tuple(factor * a for a in sides)
        least = least_bound(found.parts, found.split, gains, ends, found.box["v"])
        for size in (0.0, 0.1, 1.0):
            W = size * rng.standard_normal(27)
            own, *_ = found_on(loop, (0.5,) * len(ends), ends, found.box["v"], W=W)
            given_W = least_bound(own.parts, own.split, gains, ends, own.box["v"], W)
            assert least <= given_W <= own.C_0() * (1 + 1e-9)
            assert given_W >= 0.9 * own.C_0() or factor != 1.0


@pytest.mark.weekly
def test_a_set_that_closes_on_another_box_is_not_called_false():
    """Example 1 with gains that close, whatever box it was examined on."""
    controller = nlctl.adaptive_neural(
        2,
        basis=nlctl.controllers.GaussianBasis(centres=nlctl.paper.paper_centres("diagonal", 2)),
        weights=nlctl.controllers.AdaptiveWeights(nodes=27, Gamma=10.0),
        robust=nlctl.controllers.RobustTerm(gamma=1e5, sigma_2=1e-4),
    )
    loop = nlctl.paper.example_1(controller=controller)
    for sides in some(((0.6, 0.6), (1.0, 1.1), (3.0, 5.0)), part=2):
        found, gains, reach = found_on(loop, (0.5, 0.0), sides, (-12.0, 6.0), W=np.zeros(27))
        closure = closed_set(found, gains, reach, Q=0.01)
        assert closure.status == "closes"
        assert 1.2 < closure.box[0] < 1.7
        own, *_ = found_on(loop, (0.5, 0.0), closure.box, (-12.0, 6.0), W=np.zeros(27))
        assert max(reach(own.C_0(0.01))) <= max(closure.box)
