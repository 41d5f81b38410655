"""Gains of the baselines of both examples, found again.

    python campaign/baselines.py

They are the numbers of `nlctl.analysis.paper.controllers.baselines`.
"""

from __future__ import annotations

import numpy as np
from tuning import TOLERANCES, EvolvedGains, evolved_gains

from nlctl import paper
from nlctl.analysis.metrics import tracking_metrics
from nlctl.analysis.paper.controllers import baselines, part_of, published_controller, sensor
from nlctl.native import compile as compiled_loop
from nlctl.native import ensemble_response


def tuned_baselines(
    example: str, *, generations: int = 40, seed: int = 0
) -> dict[str, EvolvedGains]:
    """Tune the baselines of an example: where the numbers of `baselines` come from.

    The least IAE with max |u| at most that of the paper's controller, both with the noise of
    `sensor`: without noise the gains would grow without end, since nothing in the model bounds
    them.  Nor may a run take more than 10,000 steps.
    """
    build, times = paper.EXAMPLES[example], np.linspace(0, 20, 2001)
    by_key = {m.key: m for m in tracking_metrics(start=10, band=0.15, weights="", gain="")}
    cost, limited = by_key["iae"], by_key["peak_u"]
    published = compiled_loop(build(sensor=sensor(example)))
    published_gains = {
        "law.beta": np.array([part_of(published_controller(example), "law").spec.beta])
    }
    row = ensemble_response(
        published, times, params=published_gains, metrics=(limited,), **TOLERANCES
    ).table.iloc[0]
    limit = float(row[limited.key])
    bounds = {
        "PID": {f"controller.{k}": (0.01, 1000.0) for k in ("k_p", "k_i", "k_d")}
        | {"controller.T_f": (0.005, 0.5)},
        "sliding mode": {"law.K": (limit / 10, limit), "law.phi": (0.01, 1.0)},
    }
    tuned = {}
    for label, controller in baselines(example).items():
        loop = compiled_loop(build(controller=controller, sensor=sensor(example)))
        tuned[label] = evolved_gains(
            loop, bounds[label], times, cost,
            limited=limited, limit=limit, generations=generations, seed=seed,
        )  # fmt: skip
    return tuned


if __name__ == "__main__":
    for name in paper.EXAMPLES:
        print(name, *tuned_baselines(name).items(), sep="\n")
