"""Gains of a controller by search on one loop, so that a comparison is with a tuned one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution

from nlctl.errors import ParameterError
from nlctl.native import Compiled, ensemble_response

from ..metrics import Metric

__all__ = ["Tuned", "tune"]

_REFUSED = 1e6  # cost of gains that break the limit, beyond every cost that a run can have
LOST = 1e3  # what counts as the excess of a run that did not reach its end


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """Gains that were found.

    Attributes
    ----------
    gains : dict
        Values by qualified name, for ``params=`` of a run.
    cost, limited : float
        The two metrics with these gains.
    runs : int
        Number of simulations.
    """

    gains: dict[str, float]
    cost: float
    limited: float
    runs: int


def tune(
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
) -> Tuned:
    """Search the gains with the least cost that keep another metric within its limit.

    By differential evolution (scipy.optimize.differential_evolution) over the logarithms of the
    gains; each generation is one ensemble.

    Parameters
    ----------
    loop : Compiled
        Run from its own initial state.
    bounds : mapping
        ``{qualified name: (low, high)}``, both > 0.
    timepts : ndarray of shape (m,)
        Times in s.
    cost, limited : Metric
        What is made small, and what has to stay at or below `limit`.
    limit : float
    generations : int, optional
    max_steps : int, optional
        Steps of a simulation beyond which gains are refused as too stiff.
    seed : int, optional

    Raises
    ------
    ParameterError
        If bounds are not positive and increasing, or no gains were found that keep the limit.
    """
    names = list(bounds)
    for name, (low, high) in bounds.items():
        if not 0 < low < high:
            raise ParameterError(f"tune needs 0 < low < high for '{name}', got {low:g}, {high:g}")
    runs = 0

    def costs(points: np.ndarray) -> np.ndarray:
        nonlocal runs
        gains = dict(zip(names, np.exp(points), strict=True))
        table = ensemble_response(
            loop, timepts, params=gains, metrics=(cost, limited), max_steps=max_steps
        ).table
        runs += len(table)
        excess = np.fmin(np.maximum(table[limited.key].to_numpy() / limit - 1, 0), LOST)
        return np.where(excess > 0, _REFUSED * (1 + excess), table[cost.key].to_numpy())

    found = differential_evolution(
        costs, np.log(np.array(list(bounds.values()))), maxiter=generations, popsize=10, tol=1e-6,
        polish=False, vectorized=True, updating="deferred", rng=seed,
    )  # fmt: skip
    if not found.fun < _REFUSED:
        raise ParameterError(
            f"no gains keep {limited.key} <= {limit:g} within these bounds: widen them"
        )
    gains = {name: float(value) for name, value in zip(names, np.exp(found.x), strict=True)}
    one = {name: np.array([value]) for name, value in gains.items()}
    last = ensemble_response(loop, timepts, params=one, metrics=(limited,)).table[limited.key]
    return Tuned(gains=gains, cost=float(found.fun), limited=float(last.to_numpy()[0]), runs=runs)
