"""All controllers of an example: the paper's, its ablations, baselines, certified and repaired."""

from collections.abc import Callable
from typing import Any

import control as ct

from nlctl import controllers, paper
from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.names import check_known
from nlctl.references import BandLimitedNoise


@described_record
class _Gains:
    """What the controllers of an example are made with."""

    pid: dict[str, float]  # Found by ``campaign/baselines.py``.
    sliding: dict[str, float]
    reached: float  # -N(zeta) of the paper's loop at 20 s.
    r_0: float  # Dead zone of r in zeta', for |e| <= 0.133 (example 1) and 0.13 (example 2).
    weights: dict[str, float]  # Gains for which `nlctl.analysis.lyapunov.certify` proves a bound.
    robust: dict[str, float]
    law: dict[str, float]


GAINS = {
    "example_1": _Gains(
        pid={"k_p": 12.5, "k_i": 748.0, "k_d": 97.4, "T_f": 0.275},
        sliding={"K": 8.99, "phi": 0.027},
        reached=26.9,
        r_0=0.2,
        weights={"Gamma": 10.0},
        robust={"gamma": 1e5, "sigma_2": 1e-4},
        law={"N_0": 2.4},
    ),
    "example_2": _Gains(
        pid={"k_p": 1.39, "k_i": 0.152, "k_d": 5.56, "T_f": 0.00513},
        sliding={"K": 2.19, "phi": 0.0278},
        reached=7.79,
        r_0=0.13,
        weights={"Gamma": 34.0, "sigma_1": 0.3},
        robust={"gamma": 1e5, "sigma_2": 3e-4, "tau": 0.05},
        law={"N_0": 0.84, "beta": 5.0},
    ),
}


@as_annotated
def compared_controllers(example: str) -> dict[str, ct.InputOutputSystem]:
    """Return every controller of an example by label, the paper's first.

    Parameters
    ----------
    example : {"example_1", "example_2"}
        Name of the paper's example.

    Returns
    -------
    dict
        For ``controller=`` of `nlctl.paper.example_1` or `example_2`, one by one or as the
        options of a `Choice`:

        * "paper"; "no network", "no robust term", "neither", "fixed gain": see
          `nlctl.controllers.ablations`, where the fixed gain is -N(zeta) that the paper's loop has
          reached after 20 s;
        * "PID", "sliding mode": see `baselines`;
        * "certified": `nlctl.controllers.KnownSignLaw` with gains that
          `nlctl.analysis.lyapunov.certify` proves a bound for;
        * "dead zone in zeta'", "leakage", "monotone zeta": the paper's gains with another law for
          the Nussbaum argument.

        "fixed gain", "PID", "sliding mode" and "certified" assume the sign of the input gain.

    Raises
    ------
    UnknownNameError
        If there is no such example.
    """
    published, gains = published_controller(example), GAINS[example]
    beta = part_of(published, "law").spec.beta
    laws = {
        "dead zone in zeta'": controllers.DeadZoneNussbaumLaw(beta=beta, r_0=gains.r_0),
        "leakage": controllers.LeakyNussbaumLaw(beta=beta),
        "monotone zeta": controllers.MonotoneNussbaumLaw(beta=beta),
    }
    return {
        "paper": published,
        **controllers.ablations(published, kappa=gains.reached),
        **baselines(example),
        "certified": controllers.replaced(
            published,
            weights=controllers.AdaptiveWeights(
                nodes=part_of(published, "weights").spec.nodes, **gains.weights
            ),
            robust=controllers.RobustTerm(**gains.robust),
            law=controllers.KnownSignLaw(**gains.law),
        ),
        **{label: controllers.replaced(published, law=law) for label, law in laws.items()},
    }


def baselines(example: str) -> dict[str, Any]:
    """Return a PID and a boundary-layer sliding-mode controller for an example."""
    # Tuned by ``campaign/baselines.py``: the least IAE over 20 s of the nominal loop with
    # measurement noise, for the paper's max |u| in the same noise. They know the sign of the input
    # gain and have gains made for this plant; the paper's controller has neither.
    surface, gains = part_of(published_controller(example), "filtered_error").spec, GAINS[example]
    return {
        "PID": controllers.PID(**gains.pid, u_max=100.0),
        "sliding mode": controllers.sliding_mode(
            surface, controllers.SlidingModeLaw(**gains.sliding)
        ),
    }


def sensor(example: str, rms: float = 0.01, seed: int = 0) -> BandLimitedNoise:
    """Return measurement noise on all states of an example, 0 to 50 rad/s."""
    states = part_of(paper_example(example)(), "plant").spec.states
    return BandLimitedNoise(
        inputs=states, outputs=tuple(f"{x}_measured" for x in states), rms=rms, seed=seed
    )


def paper_example(example: str) -> Callable[..., ct.InterconnectedSystem]:
    """Return what makes the diagram of an example."""
    check_known("example", example, paper.EXAMPLES)
    return paper.EXAMPLES[example]


def published_controller(example: str) -> ct.InterconnectedSystem:
    """Return the paper's controller of an example."""
    return part_of(paper_example(example)(), "controller")


def part_of(diagram: ct.InterconnectedSystem, name: str) -> Any:
    """Return the system of that name in a diagram."""
    return diagram.syslist[diagram.syslist_index[name]]
