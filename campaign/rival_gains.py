"""Gains of the paper's rivals, all found by one budget on the same samples.

    python campaign/rival_gains.py

In three digits they are ``analysis/paper/rival-gains.csv``.
"""

from __future__ import annotations

import numpy as np
from tuning import TOLERANCES, EvolvedGains, evolved_gains, split_samples

from nlctl import paper
from nlctl.analysis.metrics import tracking_metrics
from nlctl.analysis.paper.controllers import part_of, published_controller
from nlctl.analysis.paper.rivals import example_with, made_with, rival_actuators
from nlctl.analysis.robustness import independent
from nlctl.analysis.studies import read_study, shipped
from nlctl.native import compile as compiled_loop
from nlctl.native import ensemble_response

TRAINED_BEHIND = {"example_1": "dead zone", "example_2": "backlash"}
_WIDTHS = ((0.05, 0.4), (0.3, 3.0), (1.0, 6.0))  # where the bounds at last are searched
_DECAY = (0.3, 3.0)


def search_bounds(example: str) -> dict[str, dict[str, tuple[float, float]]]:
    """Return where each gain of each controller is searched."""
    order = part_of(published_controller(example), "filtered_error").spec.plant_order
    adaptation = ("law.beta", "weights.Gamma", "robust.gamma")
    return {
        "paper, tuned": dict.fromkeys(adaptation, (0.1, 50.0)),
        "PID": {f"controller.{k}": (0.01, 1000.0) for k in ("k_p", "k_i", "k_d")}
        | {"controller.T_f": (0.005, 0.5)},
        "sliding mode": {"law.K": (0.5, 30.0), "law.phi": (0.01, 1.0)},
        "super-twisting": {
            "law.k_1": (0.1, 30.0),
            "law.k_2": (0.1, 100.0),
            "law.phi": (0.01, 1.0),
        },
        "dynamic surface": {f"surface.c[{i}]": (0.1, 20.0) for i in range(order)}
        | {f"surface.tau[{i}]": (0.005, 1.0) for i in range(order - 1)}
        | {"weights.Gamma": (0.1, 50.0)},
        "prescribed performance": {f"controller.k[{i}]": (0.2, 20.0) for i in range(order)}
        | {f"controller.rho_inf[{i}]": _WIDTHS[i] for i in range(order)}
        | {"controller.decay[0]": _DECAY},
        "funnel": {"controller.k": (0.2, 50.0), "controller.rho_inf": _WIDTHS[0]}
        | {"controller.decay": _DECAY},
    }


def tuned_rivals(
    example: str, *, size: int = 4, candidates: int = 240, seed: int = 0
) -> dict[str, EvolvedGains]:
    """Tune every controller with the same budget on the same samples of the study's own space.

    The least mean IAE over `size` samples with the example's actuator, for max |u| at most that of
    the paper's controller as printed in the worst of these samples.
    """
    space = read_study(shipped(f"rivals-{example[-1]}")).experiment.space
    drawn = independent(space, size, seed).table
    samples = {str(key): column.to_numpy() for key, column in drawn.items()}
    times = np.linspace(0, 20, 2001)
    by_key = {m.key: m for m in tracking_metrics(start=10, band=0.15, weights="", gain="")}
    cost, limited = by_key["iae"], by_key["peak_u"]
    actuator = rival_actuators(example)[TRAINED_BEHIND[example]]
    start, params = split_samples(samples)
    printed = compiled_loop(example_with(example, published_controller(example), actuator))
    table = ensemble_response(
        printed, times, 0.0, start, params=params, metrics=(limited,), **TOLERANCES
    ).table
    tuned = {}
    for label, bounds in search_bounds(example).items():
        middle = {key: float(np.sqrt(low * high)) for key, (low, high) in bounds.items()}
        loop = compiled_loop(example_with(example, made_with(example, label, middle), actuator))
        tuned[label] = evolved_gains(
            loop, bounds, times, cost,
            limited=limited, limit=float(table[limited.key].to_numpy().max()), samples=samples,
            generations=max(1, round(candidates / (10 * len(bounds))) - 1), seed=seed,
        )  # fmt: skip
    return tuned


if __name__ == "__main__":
    for name in paper.EXAMPLES:
        print(name, *tuned_rivals(name).items(), sep="\n")
