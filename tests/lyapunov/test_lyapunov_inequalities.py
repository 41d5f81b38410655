"""The proof's inequalities at random states of the examples, where they must hold as well."""

import dataclasses
import functools

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.lyapunov import (
    Box,
    NussbaumIntegral,
    constants,
    decompose,
    inequalities,
    literal,
    observed,
    premises,
    read_parts,
    sharpest,
    signals_of,
)
from nlctl.analysis.lyapunov.inequalities import terms
from nlctl.analysis.lyapunov.lines import assumptions
from nlctl.analysis.lyapunov.loop.instrumented import input_gain
from nlctl.analysis.lyapunov.loop.signals import Signals, inequality
from nlctl.errors import DiagramError
from nlctl.functions import nussbaum
from nlctl.plants import duffing_f

BOXES = {
    1: Box.of(x1=(-0.85, 1.0), x2=(-0.55, 1.1), v=(-np.inf, np.inf)),
    2: Box.of(x1=(-0.85, 1.1), x2=(-0.55, 0.75), x3=(-0.6, 0.6), v=(-np.inf, np.inf)),
}
EQUALITIES = ("(9)", "(14)", "(15)", "(26)", "(27)", "(28)")
STEPS = ("(18)", "(20)", "(22)", "(29)", "(30)", "Young", "(31)")


def example(number, **choices):
    return getattr(nlctl.paper, f"example_{number}")(**choices)


def watched(loop):
    parts = read_parts(loop)
    return observed(loop, parts, sharpest(decompose(parts.actuator)), 0.25)


def random_states(diagram, box, count, seed=0):
    """Return times and states with x in the box and the controller anywhere."""
    rng, names = np.random.default_rng(seed), nlctl.state_names(diagram)
    ranges = {"zeta": (-2.5, 2.9), "delta_hat": (0.0, 0.8), "memory": (-0.5, 0.6)}
    x = np.zeros((count, len(names)))
    for i, name in enumerate(names):
        last = name.rpartition(".")[2]
        low, high = box[last] if last in box.names else ranges.get(last, (-0.3, 0.3))
        x[:, i] = rng.uniform(low, high, count)
    return rng.uniform(0, 100, count), x


def signals_at(diagram, t, x):
    """Evaluate the diagram in python-control, state by state."""
    rows = [diagram.output(a, b, []) for a, b in zip(t, x, strict=True)]
    return Signals(t=t, values=dict(zip(diagram.output_labels, np.transpose(rows), strict=True)))


def at_random(loop, box, count=60, seed=0):
    diagram = watched(loop)
    return signals_at(diagram, *random_states(diagram, box, count, seed))


@functools.cache
def found(number):
    W = np.linspace(-0.2, 0.3, 27)  # the proof holds for any fixed W
    return constants(example(number), BOXES[number], W=W)


@functools.cache
def healthy(number):
    return at_random(example(number), BOXES[number])


def margins(signals, number=1):
    return {m.equation: m for m in inequalities(signals, premises(found(number)))}


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_the_steps_of_the_proof_agree_to_rounding(number):
    """(9), (14), (15) and (22) = (26) = (27) = (28) are identities in the state."""
    for key in EQUALITIES:
        margin = margins(healthy(number), number)[key]
        assert margin.kind == "equality"
        assert margin.least >= -1e-12 * max(margin.scale, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2])
def test_the_inequalities_hold_at_every_state_of_the_box(number):
    """(18)-(31) are statements about states, not about trajectories."""
    seen = margins(healthy(number), number)
    assert all(seen[key].holds for key in STEPS)
    for margin in assumptions(healthy(number), premises(found(number)), found(number).box, np.inf):
        assert margin.holds


def test_the_rate_of_v_is_its_derivative_along_the_diagram():
    """Against V at x + h x' and x - h x': two ways to one number."""
    loop = example(1)
    diagram = watched(loop)
    t, x = random_states(diagram, BOXES[1], 10)
    rates = np.array([diagram.dynamics(a, b, []) for a, b in zip(t, x, strict=True)])
    h, given = 1e-6, premises(found(1))
    ahead, behind = (
        terms(signals_at(diagram, t + s * h, x + s * h * rates), given).V for s in (1, -1)
    )
    exact = terms(signals_at(diagram, t, x), given).V_rate
    assert (ahead - behind) / (2 * h) == pytest.approx(exact, rel=1e-6, abs=1e-6)


@given(x1=st.floats(-3, 3), v=st.one_of(st.floats(-1e-4, 1e-4), st.floats(-20, 20)))
def test_the_gain_has_its_limit_at_v_0(x1, v):
    """G = (1 + 0.1 cos x1)(1 + 0.2 cos v) in Example 1, also where F/v has no digits."""
    p = nlctl.block(nlctl.plants.ForcedDuffing(), "plant")._current_params
    exact = (1 + 0.1 * np.cos(x1)) * (1 + 0.2 * np.cos(v))
    assert input_gain(duffing_f)((x1, 0.5), v, p) == pytest.approx(exact, abs=1e-9)
    assert np.isnan(input_gain(duffing_f)((x1, 0.5), np.nan, p))


@given(st.floats(-40, 40, allow_subnormal=False))
def test_no_split_leaves_less_than_the_sharpest_one(u):
    """Bounds of eps_u that a textbook's split has, hold for it as well."""
    split = decompose(nlctl.DeadZone())
    (v,) = nlctl.block(nlctl.DeadZone(), "zone").output(0, [], [u])
    sharp = sharpest(split)
    assert abs(sharp.eps_u(u, v)) <= abs(split.eps_u(u, v)) + 1e-12
    assert split.k_1 * (1 - 1e-12) <= sharp.gain(u, v) <= split.k_2 * (1 + 1e-12)
    assert sharp.eps_star == split.eps_star


@nlctl.record
class WrongRobustTerm(nlctl.controllers.RobustTerm):
    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (-p.gamma * (u[0] * np.tanh(u[0] / p.tau) - p.sigma_2 * x[0]),)


@nlctl.record
class WrongWeights(nlctl.controllers.AdaptiveWeights):
    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return -p.Gamma * (u[0] * u[1:] - p.sigma_1 * x)


@nlctl.record
class WrongNussbaumLaw(nlctl.controllers.NussbaumLaw):
    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (-u[0] * (p.beta * u[0] + u[1] + u[2] + u[3]),)


@pytest.mark.parted
@pytest.mark.parametrize(
    ("pieces", "broken"),
    [
        ({"robust": WrongRobustTerm()}, {"(28)"}),
        ({"weights": WrongWeights()}, {"(28)"}),
        ({"law": WrongNussbaumLaw()}, {"(26)", "(27)"}),
        ({"law": nlctl.controllers.LeakyNussbaumLaw(c=0.5)}, {"(26)", "(27)"}),
        ({"law": nlctl.controllers.MonotoneNussbaumLaw()}, {"(27)"}),
    ],
)
def test_a_wrong_adaptation_law_is_found_by_its_equation(pieces, broken):
    """The step that puts the law in fails, and the identities before and after it do not."""
    loop = example(1, controller=nlctl.adaptive_neural(2, **pieces))
    seen = margins(at_random(loop, BOXES[1], 20))
    assert {key for key in EQUALITIES if not seen[key].holds} == broken


@nlctl.record
class PushedDuffing(nlctl.plants.ForcedDuffing):
    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return x[1], duffing_f(x, u[0], p) + 1.0


def test_a_plant_that_is_not_what_it_declares_is_found():
    """A force that is in the update equation, and neither in f nor in d."""
    seen = margins(at_random(example(1, plant=PushedDuffing()), BOXES[1], 20))
    assert not seen["(9)"].holds
    assert not seen["(15)"].holds
    assert seen["(14)"].holds


@pytest.mark.parametrize(
    ("change", "broken"),
    [
        ({"d": 3.0}, "A2"),
        ({"G_max": 1.0}, "A3"),
        ({"G_min": 0.9}, "A3"),
        ({"eps": 0.1}, "(10)"),
    ],
)
def test_constants_that_are_too_small_are_found(change, broken):
    """A disturbance larger than declared, a gain out of its sector, a worse network."""
    given = dataclasses.replace(premises(found(1)), **change)
    seen = assumptions(healthy(1), given, found(1).box, np.inf)
    assert {m.equation for m in seen if not m.holds} == {broken}


def test_a_wrong_decomposition_of_the_actuator_is_found():
    """Bounds of k and eps_u that the actuator does not keep."""
    split = dataclasses.replace(premises(found(1)).split, eps_low=-0.1, eps_high=0.1)
    given = dataclasses.replace(premises(found(1)), split=split)
    seen = {m.equation: m for m in assumptions(healthy(1), given, found(1).box, 5.0)}
    assert not seen["A1"].holds
    assert seen["A1 range"].holds == bool(np.max(np.abs(healthy(1)["u"])) <= 5.0)


FORCINGS = {
    "printed": {},
    "a larger ripple": {"q_ripple": 2.0},
    "a small forcing": {"q_mean": 0.3, "q_ripple": 0.4},
    "a negative one": {"q_mean": -4.0},
}


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("change", FORCINGS, ids=list(FORCINGS))
def test_a_proof_with_the_forcing_in_g_holds_with_the_eps_of_that_g(change):
    """Every premise of one reading is of the same g: then no step fails at any state."""
    loop = example(1, plant=nlctl.plants.ForcedDuffing(**FORCINGS[change]))
    own = constants(loop, BOXES[1], W=np.linspace(-0.2, 0.3, 27))
    printed = literal(premises(own), own)
    assert printed.d == pytest.approx(0.1 * (1.0**2 + 1.1**2), abs=1e-3)
    assert printed.delta == pytest.approx(premises(own).delta, rel=1e-2)  # the same, split anew
    signals = at_random(loop, BOXES[1])
    steps = (*inequalities(signals, printed), *assumptions(signals, printed, own.box, np.inf))
    seen = {m.equation: m for m in steps}
    assert all(seen[key].holds for key in (*STEPS, *EQUALITIES, "A2", "(10)"))
    mixed = dataclasses.replace(printed, eps=premises(own).eps)
    premised = assumptions(signals, mixed, own.box, np.inf)
    assert {m.equation for m in premised if not m.holds} == {"(10)"}


def test_another_plant_has_no_literal_reading():
    """Example 2 has no forcing."""
    assert literal(premises(found(2)), found(2)) is None


def test_nan_violates():
    """A diverged run is not calm: no comparison is true for NaN."""
    t = np.arange(3.0)
    margin = inequality("(1)", "", t, np.array([0, np.nan, 0]), 1.0)
    assert not margin.holds
    assert margin.first_violated == margin.at == 1.0
    assert margin.share_violated == pytest.approx(1 / 3)
    broken = Signals(t=healthy(1).t, values={**healthy(1).values, "r": np.nan * healthy(1)["r"]})
    assert not any(m.holds for key, m in margins(broken).items() if key in ("(18)", "(31)", "(36)"))


def test_a_law_without_nussbaum_argument_is_refused():
    """The known-sign law has another proof."""
    loop = example(1, controller=nlctl.adaptive_neural(2, law=nlctl.controllers.KnownSignLaw()))
    with pytest.raises(DiagramError, match="KnownSignLaw: for a known sign see certify"):
        watched(loop)


def test_a_plant_of_ones_own_functions_is_observed():
    """`PureFeedback` has f and d without parameters."""
    plant = nlctl.PureFeedback(order=2, f=affine)
    signals = at_random(example(1, plant=plant), BOXES[1], 5)
    assert signals["G"] == pytest.approx(2 + np.cos(signals["x1"]), rel=1e-9)
    assert signals["g"] == pytest.approx(-signals["x1"], rel=1e-12)
    assert np.all(signals["d"] == 0)


@nlctl.equation
def affine(x, v):
    return -x[0] + (2 + np.cos(x[0])) * v


class TestLemma1:
    """Counter-examples to Lemma 1: the integral is bounded below, and zeta is not."""

    @staticmethod
    def run(zeta_rate, gain, times, *, c_2):
        """Run a zeta of one's own, from 0, with the block that integrates (32); u = N zeta'."""

        def signals(t, x, u, p):
            rate = zeta_rate(t, x[0])
            return [1.0, nussbaum(x[0]) * rate, nussbaum(x[0]) * rate, gain(t), rate, x[0]]

        driver = ct.nlsys(
            lambda t, x, u, p: [zeta_rate(t, x[0])],
            signals,
            inputs=[],
            states=["zeta"],
            outputs=["r", "u", "v", "G", "rate_zeta", "zeta"],
            name="driver",
        )
        integral = nlctl.block(NussbaumIntegral(alpha_1=c_2), "integral")
        diagram = nlctl.interconnect([driver, integral])
        return signals_of(nlctl.input_output_response(diagram, times, rtol=1e-9, atol=1e-12))

    def test_a_zeta_that_grows_for_ever_keeps_v_bounded(self):
        """zeta' = c1 c2/(2 + e^(zeta^2)): 0 < V = c1 + I < 2 c1, and zeta passes 1, then 2."""
        c_1, c_2 = 1.0, 0.25
        times = np.linspace(0, 100, 1001)
        s = self.run(lambda t, z: c_1 * c_2 / (2 + np.exp(z * z)), lambda t: 1.0, times, c_2=c_2)
        V = c_1 + s["I"]
        assert 0 < V.min() <= V.max() < 2 * c_1
        assert np.interp([1, 2], s["zeta"], s.t) == pytest.approx([13.9, 81.8], rel=5e-3)

    def test_oscillations_under_a_varying_gain_pump_the_integral(self):
        """g = 2 upwards and 1 downwards: every loop of zeta adds int_0^0.9 N."""
        times = np.linspace(0, 4 * np.pi, 401)
        s = self.run(
            lambda t, z: 0.45 * np.sin(t), lambda t: 1.5 + 0.5 * np.sign(np.sin(t)), times, c_2=0.0,
        )  # fmt: skip
        loop = nlctl.functions.nussbaum_integral(0.9)
        assert s["zeta"][-1] == pytest.approx(0, abs=1e-6)
        assert s["I"][-1] == pytest.approx(2 * loop, rel=1e-5)
