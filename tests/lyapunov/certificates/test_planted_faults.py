"""Faults planted in controller, reference and plant: each is named by a line of the ledger."""

import numpy as np
import pytest
from planted_loops import UPDATE, actuator, again, plant, wired

import nlctl
from nlctl.analysis.lyapunov import Box, ledger
from nlctl.analysis.lyapunov.bounds.decomposition import Decomposition, DecompositionError
from nlctl.errors import DiagramError
from nlctl.functions import nussbaum

BOX = Box.of(x1=(-1.5, 1.5), x2=(-3, 3), v=(-40, 40))
OUTPUTS = {
    "r": "filtered_error.r", "e": "filtered_error.e", "u": "law.u", "v": "actuator.v",
    "zeta": "law.zeta", "x1": "plant.x1", "x2": "plant.x2",
}  # fmt: skip
FILTER, LAW = nlctl.controllers.FilteredError.output, nlctl.controllers.NussbaumLaw
WEIGHTS, ROBUST = nlctl.controllers.AdaptiveWeights, nlctl.controllers.RobustTerm
HEALTHY_PARTS = {"weights": WEIGHTS(nodes=3), "robust": ROBUST(), "law": LAW()}


def loop(**parts):
    return wired(outputs=OUTPUTS, **HEALTHY_PARTS | parts)


def book(diagram, horizon=1.0, **settings):
    return ledger(diagram, horizon, box=BOX, W=np.zeros(3), step=0.01, **settings)


def sines(*factors):
    """The paper's reference, its outputs times factors."""

    def function(t):
        s, c, s_2, c_2 = np.sin(t), np.cos(t), np.sin(t / 2), np.cos(t / 2)
        return (
            factors[0] * 0.5 * (s + s_2),
            factors[1] * 0.5 * (c + c_2 / 2),
            -factors[2] * 0.5 * (s + s_2 / 4),
        )

    return nlctl.FunctionReference(order=2, function=function)


def filtered(output):
    return {"filtered_error": again(nlctl.controllers.FilteredError, output=output)}


def weights(**functions):
    return {"weights": again(WEIGHTS, nodes=3, **functions)}


def robust(**functions):
    return {"robust": again(ROBUST, **functions)}


def base(u, p):
    return p.beta * u[0] + u[1] + u[2] + u[3]


def law(**functions):
    return {"law": again(LAW, **functions)}


def in_plant(change):
    """The Duffing plant with another x2'."""
    return {"plant": plant(lambda t, x, u, p: (x[1], change(t, x, u, UPDATE(t, x, u, p)[1])))}


def actuated(output, low, high, eps):
    """An actuator that declares bounds of k and eps_u."""
    made = actuator(output)
    split = Decomposition(
        k_1=low, k_2=high, eps_low=-eps, eps_high=eps, part=lambda u, v: v, provenance="given",
        how="declared", over="all u",
    )  # fmt: skip
    kind = type(made)
    kind.decomposition = lambda self, u_max: split
    return {"actuator": made}


def late_fault(t, u):
    if t > 0.5:
        return 3.0 * u
    return u


# what was planted: (parts, a line that catches it)
FAULTS = {
    # reference
    "yd1 = 0.5 yd'": (lambda: {"reference": sines(1, 0.5, 1)}, "(yd)"),
    "yd1 = 0": (lambda: {"reference": sines(1, 0, 1)}, "(yd)"),
    "yd1 = -yd'": (lambda: {"reference": sines(1, -1, 1)}, "(yd)"),
    "yd1 = 1.001 yd'": (lambda: {"reference": sines(1, 1.001, 1)}, "(yd)"),
    "yd2 = 0": (lambda: {"reference": sines(1, 1, 0)}, "(yd)"),
    "yd2 = 2 yd''": (lambda: {"reference": sines(1, 1, 2)}, "(yd)"),
    "yd doubled alone": (lambda: {"reference": sines(2, 1, 1)}, "(yd)"),
    "yd delayed": (
        lambda: {
            "reference": nlctl.FunctionReference(
                order=2, function=lambda t: (np.sin(t - 0.1), np.cos(t), -np.sin(t))
            )
        },
        "(yd)",
    ),
    "a filtered step with a wrong rate": (
        lambda: {
            "reference": again(
                nlctl.FilteredStep,
                update=lambda t, x, u, p: np.append(
                    0.9 * x[1:], p.height * p.coefficients[0] - np.sum(p.coefficients * x)
                ),
            )
        },
        "(yd)",
    ),
    # filtered error
    "r = 1.5 e1": (
        lambda: filtered(lambda t, x, u, p: (u[0] - u[2], 1.5 * (u[0] - u[2]),
                                             -u[4] + 1.5 * (u[1] - u[3]))),
        "(14)",
    ),
    "r with minus lambda": (
        lambda: filtered(lambda t, x, u, p: (u[0] - u[2], (u[1] - u[3]) - 1.5 * (u[0] - u[2]),
                                             -u[4] + 1.5 * (u[1] - u[3]))),
        "(14)",
    ),
    "e = yd - y": (
        lambda: filtered(lambda t, x, u, p: (u[2] - u[0], *FILTER(t, x, u, p)[1:])), "(14)",
    ),
    "Y_d without yd2": (
        lambda: filtered(lambda t, x, u, p: (*FILTER(t, x, u, p)[:2], 1.5 * (u[1] - u[3]))), "(15)",
    ),
    "Y_d with plus yd2": (
        lambda: filtered(lambda t, x, u, p: (*FILTER(t, x, u, p)[:2], u[4] + 1.5 * (u[1] - u[3]))),
        "(15)",
    ),
    "Y_d with half lambda": (
        lambda: filtered(
            lambda t, x, u, p: (*FILTER(t, x, u, p)[:2], -u[4] + 0.75 * (u[1] - u[3]))
        ),
        "(15)",
    ),
    # weights
    "W_hat' without r": (
        lambda: weights(update=lambda t, x, u, p: p.Gamma * (u[1:] - p.sigma_1 * x)), "(28)",
    ),
    "W_hat' with minus Gamma": (
        lambda: weights(update=lambda t, x, u, p: -p.Gamma * (u[0] * u[1:] - p.sigma_1 * x)),
        "(28)",
    ),
    "W_hat' with plus sigma_1": (
        lambda: weights(update=lambda t, x, u, p: p.Gamma * (u[0] * u[1:] + p.sigma_1 * x)),
        "(28)",
    ),
    "W_hat' with 2 Gamma": (
        lambda: weights(update=lambda t, x, u, p: 2 * p.Gamma * (u[0] * u[1:] - p.sigma_1 * x)),
        "(28)",
    ),
    "W_psi doubled": (
        lambda: weights(
            output=lambda t, x, u, p: (2 * np.sum(x * u[1:]), np.sqrt(np.sum(x * x)))
        ),
        "(27)",
    ),
    "W_psi = 0": (
        lambda: weights(output=lambda t, x, u, p: (0.0 * u[0], np.sqrt(np.sum(x * x)))), "(27)",
    ),
    # robust term
    "delta_hat' without r": (
        lambda: robust(
            update=lambda t, x, u, p: (p.gamma * (np.tanh(u[0] / p.tau) - p.sigma_2 * x[0]),)
        ),
        "(28)",
    ),
    "delta_hat' without leakage": (
        lambda: robust(update=lambda t, x, u, p: (p.gamma * u[0] * np.tanh(u[0] / p.tau),)), "(28)",
    ),
    "delta_hat' = gamma r^2 ...": (
        lambda: robust(update=lambda t, x, u, p: (p.gamma * (u[0] ** 2 - p.sigma_2 * x[0]),)),
        "(28)",
    ),
    "robust = delta_hat": (lambda: robust(output=lambda t, x, u, p: (x[0], x[0])), "(27)"),
    "robust with another tau": (
        lambda: robust(output=lambda t, x, u, p: (x[0] * np.tanh(u[0] / (2 * p.tau)), x[0])),
        "(27)",
    ),
    "robust with a minus": (
        lambda: robust(output=lambda t, x, u, p: (-x[0] * np.tanh(u[0] / p.tau), x[0])), "(27)",
    ),
    # law
    "zeta' = -r eta": (
        lambda: law(update=lambda t, x, u, p: (-u[0] * base(u, p),)), "(26)",
    ),
    "zeta' = eta^2": (lambda: law(update=lambda t, x, u, p: (base(u, p) ** 2,)), "(26)"),
    "zeta' = 2 r eta": (lambda: law(update=lambda t, x, u, p: (2 * u[0] * base(u, p),)), "(26)"),
    "zeta' with leakage": (lambda: {"law": nlctl.controllers.LeakyNussbaumLaw(c=0.5)}, "(26)"),
    "zeta' with a dead zone": (lambda: {"law": nlctl.controllers.DeadZoneNussbaumLaw()}, "(26)"),
    "u without Y_d": (
        lambda: law(output=lambda t, x, u, p: (nussbaum(x[0]) * (base(u, p) - u[3]), x[0])),
        "(26)",
    ),
    "u with an offset": (
        lambda: law(output=lambda t, x, u, p: (nussbaum(x[0]) * base(u, p) + 0.1, x[0])), "(26)",
    ),
    "u with N(zeta + 0.1)": (
        lambda: law(output=lambda t, x, u, p: (nussbaum(x[0] + 0.1) * base(u, p), x[0])), "(26)",
    ),
    "u and zeta' without Y_d": (
        lambda: law(
            output=lambda t, x, u, p: (nussbaum(x[0]) * (base(u, p) - u[3]), x[0]),
            update=lambda t, x, u, p: (u[0] * (base(u, p) - u[3]),),
        ),
        "(27)",
    ),
    "beta halved in both": (
        lambda: law(
            output=lambda t, x, u, p: (nussbaum(x[0]) * (base(u, p) - p.beta * u[0] / 2), x[0]),
            update=lambda t, x, u, p: (u[0] * (base(u, p) - p.beta * u[0] / 2),),
        ),
        "(27)",
    ),
    "N = -exp": (lambda: {"law": LAW(N=lambda z: -np.exp(z))}, "(12)"),
    "N = 5": (lambda: {"law": LAW(N=lambda z: 5.0 + 0 * z)}, "(12)"),
    "N = 5 sin": (lambda: {"law": LAW(N=lambda z: 5 * np.sin(z))}, "(12)"),
    # plant
    "60 sin 3t in the update": (lambda: in_plant(lambda t, x, u, r: r + 60 * np.sin(3 * t)), "(9)"),
    "0.01 in the update": (lambda: in_plant(lambda t, x, u, r: r + 0.01), "(9)"),
    "minus v in the update": (lambda: in_plant(lambda t, x, u, r: r - 2 * u[0]), "(9)"),
    "damping in the update": (lambda: in_plant(lambda t, x, u, r: r - 0.3 * x[1]), "(9)"),
    "x1' = 1.01 x2": (
        lambda: {"plant": plant(lambda t, x, u, p: (1.01 * x[1], UPDATE(t, x, u, p)[1]))}, "(1)",
    ),
    "x1' = x2 + sin 5t / 10": (
        lambda: {
            "plant": plant(
                lambda t, x, u, p: (x[1] + 0.1 * np.sin(5 * t), UPDATE(t, x, u, p)[1])
            )
        },
        "(1)",
    ),
    "outputs 0.9 x1": (
        lambda: {"plant": plant(output=lambda t, x, u, p: (0.9 * x[0], 0.9 * x[0], x[1]))}, "(1)",
    ),
    "output y has an offset": (
        lambda: {"plant": plant(output=lambda t, x, u, p: (x[0] + 0.01, x[0], x[1]))}, "(1)",
    ),
    "output x2 filtered by a cube": (
        lambda: {"plant": plant(output=lambda t, x, u, p: (x[0], x[0], x[1] - x[1] ** 3 / 10))},
        "(1)",
    ),
    "an actuator that triples after 0.5 s": (
        lambda: actuated(late_fault, 0.9, 1.1, 0.1), "refuted",
    ),
}  # fmt: skip
QUICK = ("yd1 = 0.5 yd'", "r with minus lambda", "W_psi doubled", "0.01 in the update", "N = -exp")


def assert_caught(what):
    make, key = FAULTS[what]
    if key == "refuted":
        with pytest.raises(DecompositionError, match="declares k in"):
            book(loop(**make()))
        return
    found = book(loop(**make()))
    assert found.holds is False
    assert key in {line.key for line in found.violated}
    assert found[key].follows


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("what", QUICK)
def test_faults_are_named(what):
    """A few of the table every day."""
    assert_caught(what)


OTHERS = [what for what in FAULTS if what not in QUICK]
PARTS = [pytest.mark.ci, *[pytest.mark.weekly] * 11]  # a twelfth in every `.ci/run`


@pytest.mark.parametrize(
    "what", [pytest.param(what, marks=PARTS[i % 12]) for i, what in enumerate(OTHERS)]
)
def test_all_faults_are_named(what):
    """Each of them by the line that it breaks; most of them once a week."""
    assert_caught(what)


WIRES = {
    "minus at the plant": ({"plant.v": "-actuator.v"}, {}),
    "gain 0.05 at the plant": ({"plant.v": ("actuator", "v", 0.05)}, {}),
    "x1 and x2 swapped": ({"basis.x1": "plant.x2", "basis.x2": "plant.x1"}, {}),
    "an external input": ({}, {"inputs": {"w": ["plant.v"]}}),
}


@pytest.mark.parametrize("what", WIRES)
def test_another_wiring_has_no_ledger(what):
    """Neither ledger nor constants speak of the loop that the names would make."""
    wires, more = WIRES[what]
    with pytest.raises(DiagramError, match=r"block|external input"):
        book(wired(wires, outputs=OUTPUTS, **HEALTHY_PARTS, **more))


def test_the_published_loop_with_gain_minus_1_has_no_ledger():
    """The figures of the loop by name would hold."""
    published = nlctl.paper.example_1()
    signs = np.ones((published.connect_map.shape[0], 1))
    place = [system.name for system in published.syslist].index("plant")
    signs[published.input_offset[place]] = -1
    published.set_connect_map(published.connect_map * signs)
    with pytest.raises(DiagramError, match=r"'v' of block 'plant' is -'v' of 'actuator'"):
        ledger(published, 1.0)


HEALTHY = {
    "as it is": dict,
    "backlash": lambda: {"actuator": nlctl.Backlash()},
    "an actuator that varies with time, and says so": lambda: actuated(
        lambda t, u: u * (1 + 0.1 * np.sin(3 * t)), 0.9, 1.1, 0.01
    ),
    "a monotone law": lambda: {"law": nlctl.controllers.MonotoneNussbaumLaw()},
    "N = zeta^2 cos zeta, from the right lobe": lambda: {
        "law": LAW(N=lambda z: (z + 1) ** 2 * np.cos(z + 1))
    },
    "a filtered step": lambda: {"reference": nlctl.FilteredStep(order=2)},
    "a reference with frequencies of 0.1 and 40 rad/s": lambda: {
        "reference": nlctl.SumOfSines(
            order=2, amplitudes=(0.5, 1e-3), frequencies=(0.1, 40.0), phases=(0.3, 0.0)
        )
    },
    "a plant of one's own": lambda: {
        "plant": nlctl.PureFeedback(
            order=2, f=lambda x, v: -np.sin(x[0]) - 0.1 * x[1] + (2 + np.cos(x[0])) * v,
            d=lambda x, t: 0.1 * np.sin(t), initial={"x1": 0.2},
        )
    },
    "example 2's order": None,
    "no network": lambda: {"weights": nlctl.controllers.Zero(outputs=("W_psi", "W_norm"))},
}  # fmt: skip
NO_NETWORK = {"weights.r": None, **{f"weights.psi[{i}]": None for i in range(3)}}


def healthy(what):
    if what == "example 2's order":
        return nlctl.paper.example_2()
    parts = HEALTHY[what]()
    return wired(
        NO_NETWORK if what == "no network" else {}, outputs=OUTPUTS, **HEALTHY_PARTS | parts
    )


@pytest.mark.parted
@pytest.mark.ci
@pytest.mark.parametrize("what", HEALTHY)
def test_no_false_alarm(what):
    """Loops that satisfy the premises: nothing of the corrected proof is violated."""
    found = ledger(healthy(what), 1.0, step=0.01)
    assert [(line.key, line.evidence) for line in found.violated] == []
    assert found["(yd)"].status == found["(1)"].status == "checked"
