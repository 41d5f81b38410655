"""Whether V' of the proof is V' of the loop, by python-control's own right-hand side at points.

The proof's V' is made of what was read: P, Q, beta, lambda, W, the rest, the leakage of the
weights.  The loop's is the gradient of V times its rates.  Signals u and v are the loop's own, so
that both agree at every state, whether a run comes there or not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from flint import arb

from nlctl.controllers import AdaptiveWeights, ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.diagrams import initial_state
from nlctl.diagrams.points import rates_and_outputs
from nlctl.errors import DiagramError
from nlctl.plants import coordinate_names

from ...intervals.arithmetic import Ball, as_ball
from ..loop.same_loop import points_around
from .matching import Matching

_EQUAL = 1e-7  # relative to the size of the terms


def check_decrease(loop: Any, match: Matching, params: Mapping[str, Any] | None = None) -> None:
    """Compare V' of the proof with that of the loop, at points."""
    u, understood = np.zeros(loop.ninputs or 0), match.loop.understood
    rates_of, outputs_of = rates_and_outputs(loop, params), rates_and_outputs(understood)
    labels = list(understood.output_labels)
    for t, x in points_around(initial_state(loop), seed=1):
        with np.errstate(all="ignore"):
            (rates, _), (_, seen) = rates_of(t, x, u), outputs_of(t, x, u[:0])
        signals = dict(zip(labels, seen, strict=True))
        proved, true, scale = _both(match, t, x, rates, signals)
        projected = isinstance(match.loop.spec("weights"), ProjectedWeights)
        excess = true - proved if projected else abs(true - proved)
        if np.isfinite(scale) and not excess <= _EQUAL * scale:
            raise DiagramError(
                f"'{loop.name}' is not the loop that the proof is about: at t = {t:.6g} s V' is "
                f"{true:.9g}, and {proved:.9g} by the proof"
            )


def _both(
    match: Matching, t: float, x: np.ndarray, rates: np.ndarray, signals: Mapping[str, float]
) -> tuple[float, float, float]:
    """Return V' by the proof and of the loop, and the size of its terms."""
    loop, places = match.loop, match.loop.roles.places

    def of(part: str, values: np.ndarray) -> np.ndarray:
        place = places[part]
        return values[place.state_offset :][: place.system.nstates or 0]

    P, Q = (_floats(M) for M in (loop.form.P, loop.form.Q))
    W, lam, weights = np.array(match.W, dtype=float), float(match.lam), loop.spec("weights")
    E, E_rate = (of("plant", values) - of("model", values) for values in (x, rates))
    W_hat, W_rate = of("weights", x), of("weights", rates)
    true = 2 * E @ P @ E_rate + 2 * lam * (W_hat - W) @ W_rate / weights.Gamma
    r, delta = float(E @ P[:, -1]), _delta(match, t, signals)
    leak = W_hat @ W_hat + (W_hat - W) @ (W_hat - W) - W @ W
    terms = [-E @ Q @ E, 2 * r * delta, -lam * _rate_of_leakage(weights, r) * leak]
    size = abs(2 * lam * (W_hat - W) @ W_rate / weights.Gamma) + sum(map(abs, terms))
    return float(sum(terms)), float(true), 1.0 + float(size)


def _rate_of_leakage(weights: Any, r: float) -> float:
    """Return sigma, times |r| for e-modification; what projection takes away is left out."""
    if isinstance(weights, ProjectedWeights):
        return 0.0
    return weights.sigma_1 if isinstance(weights, AdaptiveWeights) else weights.sigma * abs(r)


def _delta(match: Matching, t: float, signals: Mapping[str, float]) -> float:
    order = match.loop.order
    names = (*coordinate_names(order), *model_state_names(order), "yd", "v")
    values = {"t": t} | {name: signals[name] for name in names}
    balls = {name: Ball(arb(float(value))) for name, value in values.items()}
    rest = float(as_ball(match.rest.on(balls)).value.mid())
    return rest + float(match.beta) * (signals["v"] - float(match.k) * signals["u"])


def _floats(M: Any) -> np.ndarray:
    return np.array([[float(arb(v)) for v in row] for row in M.tolist()])
