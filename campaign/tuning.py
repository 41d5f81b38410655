"""Gains of a controller by search on one loop, so that a comparison is with a tuned one.

The recorded gains of baselines and rivals come from here; `nlctl.tune` is for all else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution

from nlctl.analysis.metrics import Metric
from nlctl.errors import ParameterError
from nlctl.native import Compiled, ensemble_response

_REFUSED = 1e6  # cost of gains that break the limit, beyond every cost that a run can have
TOLERANCES = {"rtol": 1e-6, "atol": 1e-8}  # with which the recorded gains were found
LOST = 1e3  # what counts as the excess of a run that did not reach its end


@dataclass(frozen=True, kw_only=True)
class EvolvedGains:
    """Gains that were found."""

    gains: dict[str, float]  # values by qualified name, for ``params=`` of a run
    # the two metrics with these gains
    cost: float
    limited: float
    runs: int  # number of simulations


def evolved_gains(
    loop: Compiled,
    bounds: Mapping[str, tuple[float, float]],
    timepts: np.ndarray,
    cost: Metric,
    *,
    limited: Metric,
    limit: float,
    generations: int = 40,
    max_steps: int = 10_000,
    seed: int = 0,
    samples: Mapping[str, np.ndarray] | None = None,
) -> EvolvedGains:
    """Search the gains with the least cost that keep another metric within its limit.

    Of several samples the mean cost counts, and the largest value of the limited metric.

    By differential evolution (scipy.optimize.differential_evolution) over the logarithms of the
    gains; each generation is one ensemble.

    Shapes: `timepts` (m,).
    """
    names = list(bounds)
    for name, (low, high) in bounds.items():
        if not 0 < low < high:
            raise ParameterError(
                f"evolved_gains needs 0 < low < high for '{name}', got {low:g}, {high:g}"
            )
    runs, start, params = 0, *split_samples(samples or {})
    size = max([np.size(values) for values in (*start.values(), *params.values())], default=1)

    def outcomes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean cost and largest limited metric of candidates of shape (gains, candidates)."""
        nonlocal runs
        gains = dict(zip(names, np.repeat(np.exp(points), size, axis=1), strict=True))
        times = points.shape[1]
        table = ensemble_response(
            loop, timepts, 0.0, {key: np.tile(x0, times) for key, x0 in start.items()},
            params=gains | {key: np.tile(value, times) for key, value in params.items()},
            metrics=(cost, limited), max_steps=max_steps, **TOLERANCES,
        ).table  # fmt: skip
        runs += len(table)
        numbers = table[[cost.key, limited.key]].to_numpy().reshape(times, size, 2)
        return numbers[..., 0].mean(axis=1), numbers[..., 1].max(axis=1)

    def costs(points: np.ndarray) -> np.ndarray:
        mean, largest = outcomes(points)
        excess = np.fmin(np.maximum(largest / limit - 1, 0), LOST)
        return np.where(excess > 0, _REFUSED * (1 + excess), mean)

    optimum = differential_evolution(
        costs, np.log(np.array(list(bounds.values()))), maxiter=generations, popsize=10, tol=1e-6,
        polish=False, vectorized=True, updating="deferred", rng=seed,
    )  # fmt: skip
    if not optimum.fun < _REFUSED:
        raise ParameterError(
            f"no gains keep {limited.key} <= {limit:g} within these bounds: widen them"
        )
    gains = {name: float(value) for name, value in zip(names, np.exp(optimum.x), strict=True)}
    largest = outcomes(optimum.x[:, None])[1]
    return EvolvedGains(gains=gains, cost=float(optimum.fun), limited=float(largest[0]), runs=runs)


def split_samples(
    samples: Mapping[str, np.ndarray],
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return initial states and parameters of samples, for `nlctl.ensemble_response`."""
    start = {k.removesuffix("(0)"): v for k, v in samples.items() if k.endswith("(0)")}
    return start, {k: v for k, v in samples.items() if not k.endswith("(0)")}
