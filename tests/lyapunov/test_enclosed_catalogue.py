"""Every function of the catalogue is enclosed: on boxes, and in certificates."""

import numpy as np
import pytest
from examples import crossed, many
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.intervals.pairs import FUNCTIONS_OF_TWO
from nlctl.analysis.lyapunov import Box, certify, enclose, prove_decrease
from nlctl.errors import ParameterError
from nlctl.expressions.conditions import JUMPING
from nlctl.expressions.functions import FUNCTIONS as TABLE

FUNCTIONS = {
    "sign": lambda x, y: np.sign(x) + 0.5 * np.sign(y - 1),
    "floor": lambda x, y: np.floor(x) - np.ceil(y),
    "trunc and rint": lambda x, y: np.trunc(2 * x) + np.rint(y),
    "%": lambda x, y: x % 1.5 + (y % -2.0),
    "fmod": lambda x, y: np.fmod(x, 1.25) + y,
    "//": lambda x, y: x // 0.7 + y,
    "hypot": lambda x, y: np.hypot(x, y) + np.hypot(x - 1, 2.0),
    "arctan2": lambda x, y: np.arctan2(y, x),
    "copysign": lambda x, y: np.copysign(x, y),
    "heaviside": lambda x, y: np.heaviside(x, 0.5) * y,
    "logaddexp": lambda x, y: np.logaddexp(x, y),
    "a power of a number": lambda x, y: 2.0**x + y,
    "a real power": lambda x, y: np.abs(x) ** 1.5 + np.abs(y) ** 0.5,
    "a power of both": lambda x, y: (1.1 + np.abs(x)) ** y,
    "a table": lambda x, y: np.interp(x, [-2.0, -1.0, 0.5, 3.0], [1.0, -1.0, 2.0, 0.0]) * y,
    "sinc": lambda x, y: np.sinc(x) + np.sinc(x - y),
    "clip": lambda x, y: np.clip(x, -1.0, 0.5) + np.maximum(y, x),
    "cases": lambda x, y: np.where(x > y, np.sign(x) * y, x**2),
}  # fmt: skip
ENDS = st.floats(-4, 4)


@pytest.mark.parted
@pytest.mark.parametrize("name", FUNCTIONS)
@given(ends=st.lists(ENDS, min_size=4, max_size=4), seed=st.integers(0, 10**6))
def test_a_box_holds_what_points_give(name, ends, seed):
    """Also where a box lies around a jump, and where it is a point."""
    function, (a, b, c, d) = FUNCTIONS[name], ends
    box = Box.of(x=(min(a, b), max(a, b)), y=(min(c, d), max(c, d)))
    found = enclose(lambda z: function(z[0], z[1]), box, tol=0.5, max_boxes=60)
    rng = np.random.default_rng(seed)
    points = rng.uniform(box.low, box.high, (20, 2))
    for x, y in [*points, box.low, box.high]:
        value = float(function(x, y))
        room = 1e-9 * (1 + abs(value))
        assert found.low - room <= value <= found.high + room


NOT_NEGATIVE = {
    "|x|": lambda x: 2.0 * abs(x),
    "a square": lambda x: x * x,
    "an even power": lambda x: 0.3 * x**4,
    "fabs and a sum": lambda x: np.fabs(x) + 0.1 * x**2,
    "a quotient": lambda x: x**2 / (1 + abs(x)),
    "the larger one": lambda x: np.maximum(x, 0.0),
    "the smaller one of two": lambda x: np.minimum(x**2, 3 * abs(x)),
    "hypot": lambda x: np.hypot(x, 0.5 * x),
    "a root": lambda x: np.sqrt(abs(x)),
    "tanh of one": lambda x: np.tanh(np.maximum(0.0, x)),
}
ROOTS = {
    "sqrt": np.sqrt,
    "power 0.5": lambda s: s**0.5,
    "power 1.5": lambda s: s**1.5,
    "power 1/3": lambda s: s ** (1 / 3),
}

EXPONENTS = {"sqrt": 0.5, "power 0.5": 0.5, "power 1.5": 1.5, "power 1/3": 1 / 3}


@pytest.mark.parametrize(("inner", "root"), crossed([*NOT_NEGATIVE], [*ROOTS]))
@given(a=ENDS, b=ENDS, share=st.floats(0, 1))
@settings(max_examples=many(20, part=4))
def test_roots_of_what_is_not_negative_are_finite_around_zero(root, inner, a, b, share):
    """As a ball, the radius of which is rounded up, begins below 0 there."""
    low, high = min(a, b, 0.0), max(a, b, 0.0)
    function = lambda x: ROOTS[root](NOT_NEGATIVE[inner](x))  # noqa: E731
    found = enclose(lambda z: function(z[0]), Box.of(x=(low, high)), tol=0.1, max_boxes=200)
    assert np.isfinite([found.low, found.high]).all()
    assert found.low >= -1e-6
    x = min(max(low + share * (high - low), low), high)
    assert found.low - 1e-9 <= function(x) <= found.high + 1e-9 * (1 + function(x))


@pytest.mark.parted
@pytest.mark.parametrize("root", ROOTS)
@given(low=st.floats(1e-12, 4), high=st.floats(0, 4))
@settings(max_examples=many(10, part=2))
def test_roots_of_what_is_negative_somewhere_have_no_bound(root, low, high):
    """However little that is, and whatever was known of what it is made of."""
    boxes = Box.of(x=(-low, high))
    for inner in (lambda x: 0 * abs(x) + x, lambda x: abs(x) - 2 * abs(x) + x, lambda x: -abs(x)):
        function = lambda z, inner=inner: np.power(inner(z[0]), EXPONENTS[root])  # noqa: E731
        with np.errstate(all="ignore"):
            found = enclose(function, boxes, tol=0.1, max_boxes=50)
        assert not np.isfinite([found.low, found.high]).all()


FRICTIONS = {
    "Coulomb": lambda x, v: v - 0.3 * np.sign(x[0]),
    "a table": lambda x, v: v - np.interp(x[0], [-1.0, 0.0, 1.0], [-0.3, 0.0, 0.5]),
    "hypot": lambda x, v: v - 0.2 * np.hypot(x[0], 0.5),
    "a real power": lambda x, v: v - 0.2 * (0.1 + np.abs(x[0])) ** 0.5 * np.sign(x[0]),
    "a root": lambda x, v: v - 0.2 * np.abs(x[0]) ** 0.5 * np.sign(x[0]),
    "quantised": lambda x, v: v - 0.1 * np.floor(2 * x[0]),
    "angles": lambda x, v: v - 0.1 * np.arctan2(x[0], 2.0) + 0.05 * (x[0] % 1.0),
}


@pytest.mark.parametrize(("name", "law"), crossed([*FRICTIONS], ["sliding mode", "known sign"]))
def test_plants_of_order_one_have_certificates(name, law):
    """The filtered error of order 1 is e itself; what runs do stays within."""
    plant = nlctl.PureFeedback(order=1, f=nlctl.equation(FRICTIONS[name]))
    if law == "sliding mode":
        own = nlctl.controllers.SlidingModeLaw(K=6.0, phi=0.2)
        controller = nlctl.controllers.sliding_mode(
            nlctl.controllers.FilteredError(lambdas=()), own
        )
    else:
        controller = nlctl.adaptive_neural(
            1,
            law=nlctl.controllers.KnownSignLaw(N_0=2.0),
            weights=nlctl.controllers.AdaptiveWeights(Gamma=10.0),
            robust=nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5),
        )
    blocks = {
        "reference": nlctl.SumOfSines(order=1, amplitudes=0.2, frequencies=1.0, phases=0.0),
        "plant": plant, "actuator": nlctl.Gain(), "controller": controller,
    }  # fmt: skip
    loop = nlctl.interconnect(blocks, outputs=["r", "x1"], name=name)
    found = certify(loop, starts={"plant.x1": (-0.2, 0.3)})
    assert found.status == "proved", found.missing
    assert found.C_0 >= 0.3


# V, and gradients that are its own almost everywhere, or nearly
WRONG = {
    "a corner": (
        lambda x: x[0] ** 2 + x[1] ** 2 + 4 * np.maximum(x[0] - 0.8, 0.0) ** 2,
        lambda x: (2 * x[0], 2 * x[1]),
    ),
    "the last digits": (
        lambda x: x[0] ** 2 + x[1] ** 2, lambda x: (2 * x[0], (2 + 1e-6) * x[1]),
    ),
    "a sign far away": (
        lambda x: x[0] ** 2 + x[1] ** 2,
        lambda x: (2 * np.minimum(x[0], 0.85), 2 * x[1]),
    ),
    "the order": (
        lambda x: x[0] ** 2 + 2 * x[1] ** 2, lambda x: (4 * x[1], 2 * x[0]),
    ),
}  # fmt: skip


def decrease(V, box=2.0, level=1.2, **more):
    return prove_decrease(
        V, lambda x: (-x[0], -x[1]), Box.of(x1=(-box, box), x2=(-box, box)),
        level=level, floor=0.05, **more,
    )  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_a_gradient_of_another_function_is_refused(what):
    """Over the whole box; without it V' is made of the derivatives of V."""
    V, gradient = WRONG[what]
    with pytest.raises(ParameterError, match="gradient gives dV/dx"):
        decrease(V, gradient=gradient)
    assert decrease(V).status == "proved"


@pytest.mark.parametrize(("box", "level"), [(0.4, 0.9), (1.0, 1.2), (1.09, 1.2)])
def test_a_box_that_cuts_the_level_set_is_refused(box, level):
    """x1^2 + x2^2 <= c reaches to c^(1/2)."""
    with pytest.raises(ParameterError, match="does not hold the level set"):
        decrease(lambda x: x[0] ** 2 + x[1] ** 2, box=box, level=level)


def test_what_is_not_decided_says_what_is_missing():
    """V' = 0 on a line is neither proved nor refuted as V' < 0 by few boxes."""
    found = decrease(lambda x: x[0] ** 2 + x[1] ** 2, max_boxes=3)
    assert found.status == "undecided"
    assert "max_boxes" in found.missing
    assert str(found) == f"undecided: {found.missing}"


ACROSS = {  # enclosures that hold a jump
    "remainder": (arb(1, 0.25), arb(1)), "fmod": (arb(1, 0.25), arb(1)),
    "floor_divide": (arb(1, 0.25), arb(1)), "heaviside": (arb(0, 0.5), arb(0.5)),
    "copysign": (arb(1), arb(0, 0.5)), "arctan2": (arb(0, 0.5), arb(-1)),
}  # fmt: skip


@pytest.mark.parametrize("name", [name for name in JUMPING if TABLE[name].count == 2])
def test_across_a_jump_no_derivative_of_two_numbers_is_bounded(name):
    """A centred form with a slope of 0 there would leave out one of the sides."""
    _, *slopes = FUNCTIONS_OF_TWO[name](*ACROSS[name])
    assert not all(slope.is_finite() for slope in slopes)
