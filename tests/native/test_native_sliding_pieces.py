"""Sliding behind saturations, dead zones and other bends: closed forms, and a root search."""

import control as ct
import numpy as np
import pytest
from examples import crossed
from rows import each_row
from scipy.optimize import brentq

import nlctl
from nlctl.errors import CompileError

TIMES = np.linspace(0, 10, 201)


def loop(bent, drift, relay=None, params=None, update=None):
    """x' = drift(t) - bent(v), where the relay sees x."""
    body = ct.nlsys(
        update or (lambda t, x, u, p: drift(t) - bent(u[0])), lambda t, x, u, p: x[0],
        states=1, inputs=["v"], outputs=["u"], name="plant", params=params or {},
    )  # fmt: skip
    return nlctl.interconnect(
        {"relay": relay or nlctl.IdealRelay(), "plant": body}, outputs=["u", "v"]
    )


def run(system, start=0.0, **given):
    made = nlctl.input_output_response(
        system, TIMES, 0, {"plant.x[0]": start}, audit="every run", **given
    )
    return made.outputs


def by_hand(v):
    """A saturation at 3/4, as a user writes it."""
    if v > 0.75:
        return 0.75
    if v < -0.75:
        return -0.75
    return v


def gap(v):
    """A dead zone of +-0.2 with slopes 1 and 2."""
    return np.where(v > 0.2, 2 * (v - 0.2), np.where(v < -0.2, v + 0.2, 0.0))


def both_ways(v):
    return np.clip(2 * v, -0.5, 0.5) + 0.25 * v


WAVE = {
    "clip": (lambda v: np.clip(2 * v, -1.5, 1.5), 0.3, lambda w: w / 2),
    "by hand": (by_hand, 0.6, lambda w: w),
    "minimum": (lambda v: np.minimum(v, 3 * v), 0.7, lambda w: np.where(w < 0, w / 3, w)),
    "a slope of 3 and of 1": (lambda v: 2 * v + abs(v), 0.6, lambda w: np.where(w < 0, w, w / 3)),
    "beside a straight way": (
        both_ways, 0.6, lambda w: np.where(abs(w) < 0.5625, w / 2.25, (w - np.sign(w) / 2) * 4)
    ),
    "dead zone": (gap, 0.7, lambda w: np.where(w > 0, w / 2 + 0.2, w - 0.2)),
    "clip of a clip": (
        lambda v: np.clip(4 * np.clip(v, -0.5, 0.6), -1.5, 1.2), 1.1, lambda w: w / 4
    ),
}  # fmt: skip


@pytest.mark.parametrize(("method", "name"), crossed(["tsit5", "rodas5p"], [*WAVE]))
def test_the_equivalent_control_is_the_inverse_of_the_bends(name, method):
    """From x = 0 with a drift of a sine: x stays, and v is the one with bent(v) = drift."""
    bent, size, inverse = WAVE[name]
    u, v = run(loop(bent, lambda t: size * np.sin(t)), method=method)
    np.testing.assert_allclose(u, 0, atol=1e-6)
    w = size * np.sin(TIMES)
    away = np.abs(w) > 1e-3  # within a dead zone v is not the only one
    np.testing.assert_allclose(v[away], inverse(w)[away], rtol=0, atol=3e-6)


@pytest.mark.parametrize("limit", [0.6, 1.1])
def test_it_ends_where_the_saturation_does(limit):
    """x' = 0.4 t - clip(2 v): at rest until 0.4 t is the limit, then a parabola."""
    u, v = run(loop(lambda v: np.clip(2 * v, -limit, limit), lambda t: 0.4 * t))
    end = limit / 0.4
    np.testing.assert_allclose(u, 0.2 * np.maximum(TIMES - end, 0) ** 2, rtol=0, atol=1e-6)
    np.testing.assert_allclose(v, np.where(end > TIMES, 0.2 * TIMES, 1.0), rtol=0, atol=1e-6)


def test_it_comes_from_a_side_with_the_rate_of_the_saturation():
    """From 1 at -3/2 + 0.3 sin t, until 1 - 1.5 t + 0.3 (1 - cos t) = 0; then at rest."""
    u, _ = run(loop(lambda v: np.clip(2 * v, -1.5, 1.5), lambda t: 0.3 * np.sin(t)), 1.0)

    def reaching(t):
        return 1 - 1.5 * t + 0.3 * (1 - np.cos(t))

    end = brentq(reaching, 0.5, 1)
    np.testing.assert_allclose(u, np.where(end > TIMES, reaching(TIMES), 0), rtol=0, atol=1e-7)


@pytest.mark.parted
@pytest.mark.parametrize("seed", range(6))
def test_random_bends_against_a_root_search(seed):
    """Sums of saturations of either sign before v, in a row with another; signs by parameters."""
    rng = np.random.default_rng(seed)
    k, low, high = rng.uniform(0.5, 3, 2), -rng.uniform(0.2, 2, 2), rng.uniform(0.2, 2, 2)
    straight = rng.uniform(0.1, 0.5)
    sign, f = (1, -1)[seed % 2], rng.uniform(0.5, 3)

    def bent(v):
        inner = np.clip(k[0] * sign * v, low[0], high[0]) + straight * sign * v
        return sign * np.maximum(np.minimum(k[1] * inner, inner + high[1]), inner + low[1])

    size = 0.8 * min(bent(1.0), -bent(-1.0))
    u, v = run(loop(bent, lambda t: size * np.sin(f * t)))
    np.testing.assert_allclose(u, 0, atol=1e-6)
    exact = [
        brentq(lambda v, w=w: bent(v) - w, -1, 1, xtol=1e-13) for w in size * np.sin(f * TIMES)
    ]
    np.testing.assert_allclose(v, exact, rtol=0, atol=1e-5)


@pytest.mark.parametrize("K", [0.8, 2.0, 50.0])
def test_gain_and_height_are_parameters(K):
    """x' = 0.4 - g clip(K v), |v| <= 1/2, g = 2 + sin t: v = 0.4 / (K g) where that is enough."""
    system = loop(
        None, None, nlctl.IdealRelay(height=0.5), {"K": 2.0},
        lambda t, x, u, p: 0.4 - (2 + np.sin(t)) * np.clip(p["K"] * u[0], -1.5, 1.5),
    )  # fmt: skip
    u, v = run(system, params={"plant.K": K})
    holds = K * 0.5 * (2 - 1) >= 0.4
    assert holds or K == 0.8
    if holds or K * 0.5 >= 0.4:
        np.testing.assert_allclose(u, 0, atol=1e-6)
        np.testing.assert_allclose(v, 0.4 / (K * (2 + np.sin(TIMES))), rtol=0, atol=1e-6)


def test_behind_blocks_of_nlctl_it_is_the_limit_of_a_narrow_hysteresis():
    """A negative gain and a saturation in a row: states to the width."""
    paths = []
    for relay in (nlctl.IdealRelay(), nlctl.Relay(on=1e-3, off=-1e-3)):
        body = ct.nlsys(
            lambda t, x, u, p: np.array([x[1], 0.2 * np.sin(t) - x[0] + u[0]]),
            lambda t, x, u, p: x[0] + x[1], states=2, inputs=["w"], outputs=["u"], name="plant",
        )  # fmt: skip
        chain = nlctl.actuators.cascade(
            {"relay": relay, "gain": nlctl.Gain(k=-2.0), "limit": nlctl.Saturation(limit=0.4)}
        ).copy(name="chain")
        system = ct.interconnect(
            [chain, body], connections=[["chain.u", "plant.u"], ["plant.w", "chain.v"]],
            outlist=["plant.u"],
        )  # fmt: skip
        made = nlctl.input_output_response(system, TIMES[:101], 0, {"plant.x[0]": 0.3})
        paths.append(made.states[[name.startswith("plant") for name in made.state_labels]])
    np.testing.assert_allclose(paths[0], paths[1], rtol=0, atol=3e-3)


@each_row(
    ("bent", "said"),
    [
        (lambda v: abs(v), "different signs"),
        (lambda v: v - np.clip(2 * v, -0.5, 0.5), "different signs"),
        (lambda v: np.where(v > 0.3, v + 1, v), "a choice that jumps"),
        (lambda v: np.clip(v**3, -1, 1), "otherwise than as a"),
        (lambda v: sum(np.maximum(v, k / 10) for k in range(7)), "7 bends, of which 6"),
    ],
)
def test_what_is_not_monotone_or_not_in_pieces_is_refused(bent, said):
    with pytest.raises(CompileError, match=rf"'relay' does not enter the rate u'.*{said}.*nlctl\."):
        run(loop(bent, lambda t: 0.1))


def test_slopes_of_unknown_signs_are_refused_and_a_product_is_not():
    def update(t, x, u, p):
        return -p["a"] * np.clip(2 * u[0], -0.5, 0.5) - p["b"] * u[0]

    with pytest.raises(CompileError, match="not known to agree"):
        nlctl.compile(loop(None, None, None, {"a": 1.0, "b": 1.0}, update))
    u, _ = run(
        loop(
            None, None, None, {"a": 1.0, "b": 0.5},
            lambda t, x, u, p: 0.1 - p["a"] * (np.clip(2 * u[0], -0.5, 0.5) + 0.5 * u[0]),
        ),
        0.5,
    )  # fmt: skip
    assert abs(u[-1]) < 1e-6
