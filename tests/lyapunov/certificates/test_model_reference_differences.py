"""Planted differences in loops of model reference adaptive control: none of them certified."""

import dataclasses

import control as ct
import numpy as np
import pytest
from flint import arb
from mrac_loops import QUIET, first_order, half_sine, projection, sigma, wing_rock
from planted_loops import actuator, again, exchanged

import nlctl
from nlctl.analysis.lyapunov import DecompositionError, certify
from nlctl.analysis.lyapunov.model_reference.closing import (
    check_decrease,
    matching,
    read_model_reference,
)
from nlctl.analysis.lyapunov.model_reference.decrease import decrease
from nlctl.errors import DiagramError


def linear(a, b):
    return nlctl.equation(lambda x, v: a * x[0] + b * v)


def patched(record, name, **functions):
    """A block whose functions were replaced after it was made."""
    made = nlctl.block(record, name)
    for which, function in functions.items():
        setattr(made, which, function)
    return made


def without_leakage(t, x, u, p):
    return p.Gamma * (u[0] * u[1:])


def counted_norm(t, x, u, p):
    return np.sum(x * u[1:]) * 1.01, np.sqrt(np.sum(x * x))


def half_of_it(t, x, u, p):
    return u[:1] - u[1:], 0.5 * p.P_b * (u[:1] - u[1:]), -p.K * (u[:1] - u[1:]), u[:1]


def delayed():
    return first_order(
        sigma(), wires={"plant.v": {"late": 1.0}},
        lag=nlctl.TransportDelay(inputs=("v",), outputs=("late",), delay=0.1),
    )  # fmt: skip


def lag_before_plant():
    return first_order(
        sigma(), wires={"plant.v": {"slow": 1.0}},
        lag=ct.tf([1], [0.1, 1], inputs=["v"], outputs=["slow"], name="lag"),
    )  # fmt: skip


REFUSED = {
    "minus at the plant": (
        lambda: first_order(sigma(), wires={"plant.v": {"v": -1.0}}), "'plant' is -'v' of 'actu",
    ),
    "gain at the plant": (
        lambda: first_order(sigma(), wires={"plant.v": {"v": 0.5}}), r"'plant' is 0.5 \* 'v'",
    ),
    "no actuator": (
        lambda: first_order(sigma(), wires={"plant.v": {"u": 1.0}}), "'plant' is 'u' of 'law'",
    ),
    "a sum": (
        lambda: first_order(sigma(), wires={"plant.v": {"v": 1.0, "u": 1.0}}), "'v' of .* 'u' of",
    ),
    "minus r into the weights": (
        lambda: first_order(sigma(), wires={"weights.r": {"r": -1.0}}), "'weights' is -'r'",
    ),
    "e for r": (
        lambda: first_order(sigma(), wires={"weights.r": {"e": 1.0}}), "'weights' is 'e' of",
    ),
    "W_norm for W_psi": (
        lambda: first_order(sigma(), wires={"law.W_psi": {"W_norm": 1.0}}), "'law' is 'W_norm'",
    ),
    "minus W_psi": (
        lambda: first_order(sigma(), wires={"law.W_psi": {"W_psi": -1.0}}), "'law' is -'W_psi'",
    ),
    "no nu": (
        lambda: first_order(sigma(), wires={"law.nu": {}}), "'nu' of .*'law' is connected to noth",
    ),
    "no feedback of the error": (
        lambda: first_order(sigma(), wires={"law.nu_e": {}}), "'nu_e' of .* connected to nothing",
    ),
    "the plant for the model": (
        lambda: first_order(sigma(), wires={"error.xm1": {"x1": 1.0}}), "'error' is 'x1' of 'pl",
    ),
    "the model for the plant": (
        lambda: first_order(sigma(), wires={"basis.x1": {"xm1": 1.0}}), "'basis' is 'xm1' of",
    ),
    "states of wing rock swapped": (
        lambda: wing_rock(
            sigma(nodes=6), wires={"basis.x1": {"x2": 1.0}, "basis.x2": {"x1": 1.0}}
        ),
        "'basis' is 'x2' of 'plant'",
    ),
    "regressors in another order": (
        lambda: wing_rock(sigma(nodes=6), wires={"weights.psi[1]": {"psi[2]": 1.0}}),
        r"'weights' is 'psi\[2\]'",
    ),
    "a doubled regressor": (
        lambda: first_order(sigma(), wires={"weights.psi[0]": {"psi[0]": 2.0}}), r"2 \* 'psi\[0\]'",
    ),
    "an external input without a bound": (
        lambda: first_order(sigma(), inputs=["w"]), "'w' .* may be anything",
    ),
    "a filter before the plant": (lag_before_plant, "does not know what block 'lag'"),
    "a delay before the plant": (delayed, "does not know what block 'lag'"),
    "another gain beside the loop": (
        lambda: first_order(sigma(), spare=nlctl.Gain()),
        "two blocks output 'v'",
    ),
    "a plant with the other sign": (
        lambda: first_order(sigma(), f=linear(2.0, -1.0)), "input gain of the sign .* is -1, ",
    ),
    "a law with the other sign": (
        lambda: first_order(sigma(), gain=-1.0), "input gain of the sign .* the law's -1",
    ),
    "a plant without an input": (
        lambda: first_order(sigma(), f=linear(2.0, 0.0)), "of v alone in 'plant' is 0",
    ),
    "wing rock with the other sign": (
        lambda: wing_rock(sigma(nodes=6), plant=nlctl.plants.WingRock(L=-3.0)),
        "of v alone in 'plant' is -3",
    ),
    "direct control of the other sign": (
        lambda: first_order(sigma(), f=linear(2.0, -1.0), law=nlctl.controllers.DirectLaw()),
        "is -1",
    ),
    "a constrained law": (
        lambda: first_order(sigma(), law=nlctl.controllers.ConstrainedLaw(u_max=10.0)),
        "about a ModelReferenceLaw or DirectLaw as 'law', got ConstrainedLaw",
    ),
    "a law of another kind": (
        lambda: first_order(
            sigma(),
            law=again(nlctl.controllers.ModelReferenceLaw, output=lambda t, x, u, p: (-u[2],)),
        ),
        "got OwnModelReferenceLaw",
    ),
    "weights of another kind": (
        lambda: first_order(
            again(nlctl.controllers.AdaptiveWeights, nodes=2, update=without_leakage)
        ),
        "got OwnAdaptiveWeights",
    ),
    "the weights' update replaced in the block": (
        lambda: first_order(patched(sigma(), "weights", updfcn=without_leakage)),
        "'weights' has another update function",
    ),
    "the weights' update replaced in the record": (
        lambda: first_order(exchanged(sigma(), update=without_leakage)),
        "'weights' has another update function than AdaptiveWeights",
    ),
    "the weights' inherited output replaced in the record": (
        lambda: first_order(exchanged(projection(), output=counted_norm)),
        "'weights' has another output function than ProjectedWeights",
    ),
    "the gain's output replaced in the record": (
        lambda: first_order(
            sigma(), actuator=exchanged(nlctl.Gain(), output=lambda t, x, u, p: (2 * u[0],))
        ),
        "'actuator' has another output function than Gain",
    ),
    "the backlash's band replaced in the record": (
        lambda: first_order(
            sigma(),
            actuator=exchanged(
                nlctl.Backlash(), band=lambda t, u, p: (u - 1e-3, u + 1e-3)
            ),
        ),
        "'actuator' has another band function than Backlash",
    ),
    "the error's output replaced in the record": (
        lambda: first_order(
            sigma(),
            error=exchanged(nlctl.controllers.ModelError(K=(1.0,), Q=(1.0,)), output=half_of_it),
        ),
        "'error' has another output function than ModelError",
    ),
    "an error of another order": (
        lambda: wing_rock(sigma(nodes=6), error=nlctl.controllers.ModelError(K=(1.5,), Q=(1.0,))),
        "'error' is a controller for plants of order 1",
    ),
    "a model of another order": (
        lambda: wing_rock(
            sigma(nodes=6), model=nlctl.controllers.ReferenceModel(a=(1.0, 3.0, 3.0), b=1.0)
        ),
        "one order, got plant 2, model 3, error 2",
    ),
    "a regressor of something else": (
        lambda: first_order(sigma(), wires={"basis.yd": {"r": 1.0}}),
        "'basis' is 'r' of 'error'",
    ),
    "a plant with cases": (
        lambda: first_order(sigma(), f=cases), "without cases that depend on the state",
    ),
    "a plant that is no chain": (
        lambda: wing_rock(
            sigma(nodes=6),
            plant=again(nlctl.plants.WingRock, update=lambda t, x, u, p: (x[1] + 0.1, x[0] + u[0])),
        ),
        "makes x1' something else",
    ),
    "a reference without a bound": (
        lambda: first_order(
            sigma(), reference=nlctl.FunctionReference(order=0, function=lambda t: (0.1 * t,))
        ),
        "no bound of yd",
    ),
    "a reference that follows the plant": (
        lambda: first_order(
            sigma(), reference=nlctl.references.BandLimitedNoise(inputs=("raw",), outputs=("yd",)),
            wires={"reference.raw": {"x1": 1.0}},
        ),
        "BandLimitedNoise|'raw'",
    ),
}  # fmt: skip


@nlctl.equation
def cases(x, v):
    """2 x + v, and 3 x + v on the right."""
    if x[0] > 0:
        return 3.0 * x[0] + v
    return 2.0 * x[0] + v


def pole(t, x, u, p):
    return 1.0, u[0], u[1], u[0] * u[1], 1 / (u[0] - 0.123), u[0] * u[0]


def sampled_controller():
    pieces = {
        "reference": QUIET,
        "plant": nlctl.PureFeedback(order=1, f=linear(2.0, 1.0)),
        "actuator": nlctl.Gain(),
        "controller": nlctl.sampled(
            nlctl.mrac(nlctl.controllers.ReferenceModel(a=(1.0,), b=0.0), weights=sigma()),
            0.1,
            method="euler",
        ),
    }
    return nlctl.interconnect(pieces, outputs=["x1", "r"])


class TestNoneIsCertified:
    def test_the_loops_without_a_difference_are(self):
        """A check that always refuses is as bad as one that cannot."""
        for loop in (first_order(sigma(), d=half_sine), wing_rock(sigma(nodes=6))):
            assert certify(loop).holds

    @pytest.mark.parted
    @pytest.mark.parametrize("what", REFUSED)
    def test_refused_by_name(self, what):
        """The refusal names the block, and what is wrong with it."""
        make, said = REFUSED[what]
        with pytest.raises(DiagramError, match=said):
            certify(make())

    def test_a_sampled_controller(self):
        """The proof is about continuous time; the paper's proof refuses it as well."""
        with pytest.raises(DiagramError, match=r"continuous time, and .* is sampled"):
            certify(sampled_controller())

    @pytest.mark.parametrize("machine", [
        nlctl.Saturation(limit=5.0),
        nlctl.Gain(k=-1.0),
        nlctl.Relay(),
        actuator(lambda t, u: u * np.exp(-t / 100)),
        actuator(lambda t, u: u * np.tanh(3 - t)),
    ])  # fmt: skip
    def test_an_actuator_without_a_split(self, machine):
        with pytest.raises(DecompositionError):
            certify(first_order(sigma(), actuator=machine))

    @pytest.mark.parametrize(
        ("machine", "k"),
        [
            (nlctl.DeadZone(), None),
            (actuator(lambda t, u: u * (1 + 0.9 * np.sin(t))), (0.1, 1.9)),
        ],
    )
    def test_an_actuator_whose_gain_varies_too_much(self, machine, k):
        """The part of the gain that varies is no matched disturbance with a bound of its own."""
        found = certify(first_order(sigma(), d=half_sine, actuator=machine), k=k)
        assert not found.holds
        assert found.e == np.inf

    @pytest.mark.weekly
    def test_a_regressor_without_a_bound(self):
        """Where psi has a pole in the box there is no bound of u, and no solution for all time."""
        basis = again(nlctl.controllers.WingRockRegressor, output=pole)
        found = certify(wing_rock(sigma(nodes=6), basis=basis), W=(0.8, 0, 0, 0, 0, 0))
        assert not found.holds
        assert found.u_max == np.inf

    def test_a_regressor_that_does_not_span_the_plant(self):
        """x1^3 of wing rock is not linear; the box that its growth asks for does not close."""
        basis, weights = nlctl.controllers.AffineRegressor(order=2), sigma(0.1, nodes=3)
        found = certify(
            wing_rock(weights, basis=basis, plant=nlctl.plants.WingRock(w=(0, 0, 0, 0, 0, 2.0)))
        )
        assert not found.holds
        assert "the box does not close" in found.reason

    def test_another_gain_is_another_number(self):
        """A law that takes 3 for 2 is another loop: its certificate is about that one."""
        laws = (nlctl.controllers.ModelReferenceLaw(gain=gain) for gain in (3.0, 2.0))
        one, other = (certify(wing_rock(sigma(nodes=6), reference=QUIET, law=law)) for law in laws)
        assert (float(one.matching.lam), float(other.matching.lam)) == (1.0, 1.5)
        assert one.W != other.W
        assert one.ultimate != other.ultimate


def misread(match, **changes):
    """What was read, with something else in it."""
    return dataclasses.replace(match, **changes)


class TestTheAudit:
    """V' of the proof is that of the loop; of a misreading it is not."""

    @pytest.fixture
    def read(self):
        loop = first_order(sigma(), d=half_sine)
        split = certify(loop).split
        return loop, matching(read_model_reference(loop), split)

    def test_what_was_read_passes(self, read):
        check_decrease(*read)

    @pytest.mark.parametrize("what", ["lam", "beta", "W", "rest"])
    def test_a_misreading_does_not(self, read, what):
        """Another gain, other weights, a disturbance forgotten."""
        loop, match = read
        wrong = {
            "lam": match.lam * 2,
            "beta": match.beta * 2,
            "W": (match.W[0] * 2, match.W[1]),
            "rest": match.rest - match.rest,
        }[what]
        k = {"k": match.k / 2} if what == "beta" else {}
        with pytest.raises(DiagramError, match=r"V' is .* by the proof"):
            check_decrease(loop, misread(match, **{what: wrong}, **k))

    def test_a_bound_is_never_below_what_the_loop_does(self, read):
        """The rate at which V falls, at points of the level set."""
        loop, match = read
        found = decrease(match, arb(0.5), arb(0))
        rng, names = np.random.default_rng(0), list(nlctl.state_names(loop))
        for x, W_hat, t in rng.uniform([-2, -2, 0], [2, 5, 20], (50, 3)):
            start = nlctl.initial_state(loop, {"plant.x1": x, "weights.W_hat[0]": W_hat})
            rates = loop.dynamics(t, start, [])
            V = x * x / 2 + (W_hat - 2) ** 2 / 5
            rate = x * rates[names.index("plant.x1")]
            rate += 2 * (W_hat - 2) * rates[names.index("weights.W_hat[0]")] / 5
            assert rate <= -found.alpha_1 * V + found.alpha_0 + 1e-9
