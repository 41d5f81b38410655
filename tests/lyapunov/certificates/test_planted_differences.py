"""Certificates are about the loop that was given: planted differences, none of them certified.

The certified loop of the README, with three nodes, is changed in one thing at a time: a wire, a
function of time, an equation, a parameter.
"""

import control as ct
import numpy as np
import pytest
import scipy.special
from planted_loops import (
    PARTS,
    UPDATE,
    actuator,
    again,
    exchanged,
    nested,
    patched,
    plant,
    sampled,
    system,
    wired,
)

import nlctl
from nlctl.analysis.lyapunov.bounds.decomposition import Decomposition, DecompositionError
from nlctl.analysis.lyapunov.certificate.certify import certify
from nlctl.equations import equation
from nlctl.errors import DiagramError

C_0 = 0.47654  # of the loop without a difference
K = (0.9, 1.1)
COUNTS = [0]
TIMES = np.linspace(0, 10, 2001)


def doubled(system):
    return ct.interconnect(
        [system], inplist=["plant.v"], inputs=["v"], name="plant",
        outlist=["plant.y", ("plant", "x1"), (0, 2, 2.0)], outputs=["y", "x1", "x2"],
    )  # fmt: skip


# what was changed: (loop, what the refusal says)
WIRING = {
    "minus at the plant": (lambda: wired({"plant.v": "-actuator.v"}), r"'plant' is -'v' of 'act"),
    "gain at the plant": (lambda: wired({"plant.v": ("actuator", "v", 0.05)}), r"is 0.05 \* 'v'"),
    "minus at the actuator": (lambda: wired({"actuator.u": "-law.u"}), "'actuator' is -'u'"),
    "gain at the actuator": (lambda: wired({"actuator.u": ("law", "u", 2)}), r"is 2 \* 'u'"),
    "a sum": (lambda: wired({"plant.v": ["actuator.v", "law.u"]}), "'v' of 'actuator' \\+ 'u' of"),
    "x1 and x2 swapped": (
        lambda: wired({"filtered_error.x1": "plant.x2", "filtered_error.x2": "plant.x1"}),
        "input 'x1' of block 'filtered_error' is 'x2' of 'plant'",
    ),
    "x1 and x2 of the basis swapped": (
        lambda: wired({"basis.x1": "plant.x2", "basis.x2": "plant.x1"}), "'basis' is 'x2' of 'pl",
    ),
    "y for x2": (lambda: wired({"filtered_error.x2": "plant.y"}), "is 'y' of 'plant'"),
    "no actuator": (lambda: wired({"plant.v": "law.u"}), "is 'u' of 'law'"),
    "no Y_d": (lambda: wired({"law.Y_d": None}), "'Y_d' of block 'law' is connected to nothing"),
    "minus Y_d": (lambda: wired({"law.Y_d": "-filtered_error.Y_d"}), "'law' is -'Y_d'"),
    "no robust term": (lambda: wired({"law.robust": None}), "'robust' of block 'law'"),
    "delta_hat for the robust term": (
        lambda: wired({"law.robust": "robust.delta_hat"}), "is 'delta_hat' of 'robust'",
    ),
    "W_norm for W_psi": (lambda: wired({"law.W_psi": "weights.W_norm"}), "is 'W_norm'"),
    "minus r into the weights": (lambda: wired({"weights.r": "-filtered_error.r"}), "is -'r'"),
    "e for r": (lambda: wired({"robust.r": "filtered_error.e"}), "is 'e' of 'filtered_error'"),
    "yd for yd1": (lambda: wired({"filtered_error.yd1": "reference.yd"}), "is 'yd' of 'ref"),
    "no yd2": (lambda: wired({"filtered_error.yd2": None}), "'yd2' of block 'filtered_error'"),
    "psi in another order": (
        lambda: wired({"weights.psi[0]": "basis.psi[2]"}), r"is 'psi\[2\]' of 'basis'",
    ),
    "a tenth of r as output r": (
        lambda: wired(outputs={"r": ("filtered_error", "r", 0.1)}), r"output 'r' .* is 0.1 \* 'r'",
    ),
    "e as output r": (lambda: wired(outputs={"r": "filtered_error.e"}), "'r' .* is 'e'"),
    "an external input at the plant": (
        lambda: wired(inputs={"w": ["plant.v"]}), "external input 'w' .* may be anything",
    ),
    "an external input at the actuator": (
        lambda: wired(inputs={"w": ["actuator.u"]}), "'actuator' is .*external input 'w'",
    ),
    "an external input at a sensor": (
        lambda: wired(inputs={"noise": ["filtered_error.x1"]}), "external input 'noise'",
    ),
    "a gain at the end of a nested diagram": (
        lambda: nested(output_gain=1.1), r"'x1' of block 'controller.filtered_error' is 1.1 \*",
    ),
    "a gain at the beginning of one": (
        lambda: nested(input_gain=-1.0), "'u' of block 'machine.actuator' is -'u'",
    ),
    "an input of a nested diagram": (lambda: nested(disturbed=True), "'w' .* may be anything"),
    "a filter before the plant": (
        lambda: wired(
            {"plant.v": ("lag", "slow"), "lag.v": "actuator.v"},
            more=[ct.tf([1], [0.1, 1], inputs=["v"], outputs=["slow"], name="lag")],
        ),
        r"does not know what block 'lag' \(slow\) is for",
    ),
    "an unknown block beside the loop": (
        lambda: wired(more=[system(nlctl.Gain(), "spare")]), "two blocks output 'v'",
    ),
    "a plant with a gain around it": (
        lambda: wired(plant=doubled(system(nlctl.plants.ForcedDuffing(), "plant"))),
        r"is 2 \* 'x2' of",
    ),
}  # fmt: skip


def off_at_2(t, u):
    if t < 2:
        return u
    return 0.0 * u


def off_for_a_moment(t, u):
    if 7.0 < t < 7.01:
        return 0.0 * u
    return u


def stronger_later(t, u):
    if t > 5:
        return 3 * u
    return u


def reversed_at_3(t, u):
    return u * np.tanh(3 - t)


TIME = {
    "v = u until 2 s": (off_at_2, "eps_u"),
    "v = 0 from 7 to 7.01 s": (off_for_a_moment, "eps_u"),
    "v = 3 u after 5 s": (stronger_later, "eps_u"),
    "v = u tanh(3 - t)": (reversed_at_3, "eps_u"),
    "v = u exp(-t / 100)": (lambda t, u: u * np.exp(-t / 100), "eps_u"),
    "v = u cos t": (lambda t, u: u * np.cos(t), "eps_u"),
    "v = u + t / 1000": (lambda t, u: u + t / 1000, "eps_u"),
    "v = u (1 + 0.3 sin t)": (lambda t, u: u * (1 + 0.3 * np.sin(t)), "eps_u"),
}


@nlctl.record
class Declared:
    """v = u (1 + 0.2 sin t), or v = 0 after 3333 s, which declares k in [0.8, 1.2] itself."""

    inputs, outputs, states, feedthrough = ("u",), ("v",), ("seconds",), True

    @staticmethod
    @equation
    def update(t, x, u, p):
        return (1.0 + 0 * u[0],)

    @staticmethod
    @equation
    def output(t, x, u, p):
        if x[0] > 3333:
            return (0.0,)
        return (u[0] * (1 + 0.2 * np.sin(t)),)

    def decomposition(self, u_max):
        return Decomposition(
            k_1=0.8, k_2=1.2, eps_low=0.0, eps_high=0.0, part=lambda u, v: v,
            provenance="proved", how="says so", over="all u",
        )  # fmt: skip


class SlowBurst(nlctl.controllers.KnownSignLaw):
    """Another law under a name of its own."""


def counted(t, x, u, p):
    """Another plant from the 100,000th call on."""
    COUNTS[0] += 1
    return UPDATE(t, x, u, p) if COUNTS[0] < 100_000 else (0.0, 0.0)


def only_counted(t, x, u, p):
    COUNTS[0] += 1
    return UPDATE(t, x, u, p)


def drawn(t, x, u, p):
    return UPDATE(t, x, u, p)[:1] + (np.random.default_rng().normal(),)


def without_leak(t, x, u, p):
    return (p.gamma * u[0] * np.tanh(u[0] / p.tau),)


EQUATIONS = {
    "x1' = x2 + 0.1": (
        lambda: {"plant": plant(lambda t, x, u, p: (x[1] + 0.1, UPDATE(t, x, u, p)[1]))},
        "makes x1' something else",
    ),
    "x1' = 2 x2": (
        lambda: {"plant": plant(lambda t, x, u, p: (2 * x[1], UPDATE(t, x, u, p)[1]))},
        "makes x1' something else",
    ),
    "x1' = x2 + sin(t) / 100": (
        lambda: {
            "plant": plant(lambda t, x, u, p: (x[1] + 0.01 * np.sin(t), UPDATE(t, x, u, p)[1]))
        },
        "makes x1' something else",
    ),
    "output x1 is 0.9 x1": (
        lambda: {"plant": plant(output=lambda t, x, u, p: (x[0], 0.9 * x[0], x[1]))},
        "makes x1 something else",
    ),
    "outputs x1 and x2 exchanged": (
        lambda: {"plant": plant(output=lambda t, x, u, p: (x[0], x[1], x[0]))},
        "makes x1 something else",
    ),
    "output x2 with an offset": (
        lambda: {"plant": plant(output=lambda t, x, u, p: (x[0], x[0], x[1] + 0.01))},
        "makes x2 something else",
    ),
    "states in another order": (
        lambda: {"plant": plant(states=("x2", "x1"))}, "needs the states x1, x2 of block 'plant'",
    ),
    "a plant that counts": (lambda: {"plant": plant(counted)}, "changes|remember|COUNTS"),
    "a plant that counts for itself": (
        lambda: {"plant": plant(only_counted)}, "changes|remember|COUNTS",
    ),
    "a plant that draws": (lambda: {"plant": plant(drawn)}, "'plant'"),
    "a filter of another kind": (
        lambda: {
            "filtered_error": again(
                nlctl.controllers.FilteredError,
                output=lambda t, x, u, p: (u[0] - u[2], u[0] - u[2], -u[4]),
            )
        },
        "about a FilteredError as 'filtered_error', got OwnFilteredError",
    ),
    "a law of another kind": (lambda: {"law": SlowBurst()}, "got SlowBurst"),
    "a law with a constant gain": (
        lambda: {"law": nlctl.controllers.FixedGainLaw()}, "got FixedGainLaw",
    ),
    "a basis of another kind": (
        lambda: {
            "basis": again(
                nlctl.controllers.GaussianBasis, centres=((0.0, 0.0),) * 3,
                output=lambda t, x, u, p: 10 * np.ones(3),
            )
        },
        "got OwnGaussianBasis",
    ),
    "a reference given by a function": (
        lambda: {
            "reference": nlctl.FunctionReference(
                order=2, function=lambda t: (np.sin(t), 0.5 * np.cos(t), -np.sin(t))
            )
        },
        "about a SumOfSines as 'reference'",
    ),
    "the robust term's function replaced in the block": (
        lambda: patched("robust", updfcn=without_leak), "'robust' has another update function",
    ),
    "the law's function replaced in the block": (
        lambda: patched("law", outfcn=lambda t, x, u, p: (-u[0],)), "'law' has another output",
    ),
    "the actuator's function replaced in the block": (
        lambda: patched("actuator", outfcn=lambda t, x, u, p: (-u[0],)), "'actuator' has another",
    ),
    "the law's function replaced in the record": (
        lambda: {
            "law": exchanged(nlctl.controllers.KnownSignLaw(), output=lambda t, x, u, p: (-u[0],))
        },
        "'law' has another output function than KnownSignLaw",
    ),
    "the dead zone's output replaced in the record": (
        lambda: {
            "actuator": exchanged(nlctl.DeadZone(), output=lambda t, x, u, p: (0.1 * u[0],))
        },
        "'actuator' has another output function than DeadZone",
    ),
    "a sampled loop": (
        lambda: {k: nlctl.block(sampled(make()), k, dt=0.1) for k, make in PARTS.items()},
        r"continuous time, and 'planted' is sampled with dt = 0.1",
    ),
    "a law that is sampled": (
        lambda: {"law": nlctl.sampled(nlctl.block(nlctl.controllers.KnownSignLaw(), "law"), 0.1)},
        "continuous time, and 'law' is sampled",
    ),
    "the weights' inherited output replaced in the record": (
        lambda: {
            "weights": exchanged(
                nlctl.controllers.AdaptiveWeights(nodes=3),
                output=lambda t, x, u, p: (0 * x[0], x[0]),
            )
        },
        "'weights' has another output function than AdaptiveWeights",
    ),
    "a plant that cannot be read on intervals": (
        lambda: {
            "plant": plant(
                lambda t, x, u, p: (x[1], UPDATE(t, x, u, p)[1] + scipy.special.ber(t))
            )
        },
        "cannot be evaluated on intervals",
    ),
}  # fmt: skip

PARAMETERS = {
    "N_0 below 1 / (k_1 G_min)": ({"law": nlctl.controllers.KnownSignLaw(N_0=1.5)}, {}),
    "N_0 in the diagram's own parameters": ({"params": {"law.N_0": 1.5}}, {}),
    "N_0 of the run": ({}, {"params": {"law.N_0": 1.5}}),
    "a gain that nearly vanishes": ({"plant": nlctl.plants.ForcedDuffing(gain_v=0.99)}, {}),
    "sigma_2 = 0": ({}, {"params": {"robust.sigma_2": 0.0}}),
    "gamma as published": ({"robust": nlctl.controllers.RobustTerm()}, {}),
    "a range of u that is too small": ({}, {"k": (0.6, 1.3), "u_max": 20.0}),
}


@pytest.mark.filterwarnings("ignore:Unused:UserWarning")
class TestNoneIsCertified:
    @pytest.mark.slow
    def test_the_loop_without_a_difference_is(self):
        """A check that always refuses is as bad as one that cannot: flat and nested, renamed."""
        for loop in (wired(), nested()):
            found = certify(loop)
            assert found.holds
            assert pytest.approx(C_0, rel=1e-4) == found.C_0

    @pytest.mark.parametrize("what", WIRING)
    def test_wiring(self, what):
        """The refusal names the input and what feeds it."""
        make, said = WIRING[what]
        with pytest.raises(DiagramError, match=said):
            certify(make())

    @pytest.mark.parted
    @pytest.mark.slow
    @pytest.mark.parametrize("what", TIME)
    def test_time(self, what):
        """k of the paper is k(u, t): the split is proved for all t or refused."""
        output, said = TIME[what]
        with pytest.raises(DecompositionError, match=said):
            certify(wired(actuator=actuator(output)), k=K)

    @pytest.mark.parametrize("what", EQUATIONS)
    def test_equations(self, what):
        """What a run calls is what the proof is about."""
        make, said = EQUATIONS[what]
        with pytest.raises(DiagramError, match=said):
            certify(wired(**make()))

    @pytest.mark.slow
    @pytest.mark.parametrize("what", PARAMETERS)
    def test_parameters(self, what):
        """Wherever they are set."""
        parts, how = PARAMETERS[what]
        found = certify(wired(**parts), **how)
        assert not found.holds
        assert np.inf == found.C_0

    @pytest.mark.slow
    def test_a_declared_split_proves_nothing(self):
        """Whatever its record says of it; the number that would follow is told as such."""
        found = certify(wired(actuator=Declared()))
        assert not found.holds
        assert "declares; samples do not refute it, and nothing proves it" in found.reason
        known = {c.symbol: c.provenance for c in found.constants}
        assert known["eps_u*"] == known["delta*"] == known["alpha_0"] == known["V(0)"] == "given"


def largest_r(loop, times=TIMES, inputs=0):
    run = nlctl.input_output_response(nlctl.compile(loop), times, inputs)
    return float(np.abs(np.asarray(run.outputs)[list(run.output_labels).index("r")]).max())


class TestOfTheLoopAtHand:
    @pytest.mark.slow
    def test_a_gain_that_varies_within_its_bounds(self):
        """v = u (1 + 0.1 sin t) is proved with bounds that hold for all t, and keeps C_0."""
        loop = wired(actuator=actuator(lambda t, u: u * (1 + 0.1 * np.sin(t))))
        found = certify(loop, k=(0.9, 1.1))
        assert found.holds
        assert largest_r(loop) <= found.C_0

    @pytest.mark.slow
    def test_what_the_update_adds_is_counted(self):
        """60 sin 3t beside f and d: the plant's own update is enclosed, and delta* knows it."""
        loop = wired(
            plant=plant(lambda t, x, u, p: (x[1], UPDATE(t, x, u, p)[1] + 60 * np.sin(3 * t)))
        )
        found = certify(loop)
        assert found.region.matched > 60
        assert found.C_0 > 2 * C_0
        assert found.holds
        assert largest_r(loop) <= found.C_0

    @pytest.mark.slow
    def test_an_external_input_with_a_bound(self):
        """|w| <= 0.5 with gain -2 adds 1 to eps_u*; a switching w keeps the larger bound."""
        loop = wired(inputs={"w": ["plant.v"]})
        loop.set_input_map(-2 * loop.input_map)
        times = np.linspace(0, 5, 501)
        found = certify(loop, inputs={"w": 0.5})
        assert found.holds
        assert found.split.eps_star == pytest.approx(0.65 + 1.0)
        assert found.C_0 > C_0
        w = 0.5 * np.sign(np.sin(5 * times))[None]
        assert largest_r(loop, times, w) <= found.C_0
        with pytest.raises(nlctl.errors.UnknownNameError, match="external input 'v'"):
            certify(loop, inputs={"v": 1.0})
        with pytest.raises(nlctl.errors.ParameterError, match="finite bound"):
            certify(loop, inputs={"w": np.nan})
