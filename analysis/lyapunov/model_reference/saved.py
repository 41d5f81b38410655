"""The file of a proof with a reference model: premises, P, weights, and boxes that close."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from flint import arb

from nlctl.controllers import AdaptiveWeights, ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.plants import coordinate_names

from ...intervals.normal_form import exact
from ...intervals.written import operations
from ..bounds.decomposition import Decomposition
from ..proofs.saved import Content, split_content, starts_content, texts
from .decrease import Decrease, decrease
from .matching import Matching
from .quadratic_form import QuadraticForm
from .region import region

_RAISED = (0.0, 0.01, 0.05, 0.2, 0.5)  # relative: how far C is above the one that closed
_WIDER, _FINE = 1e-3, 1e-3  # relative: room of bounds of the rest, and how sharply it is bounded
_STAGES, _LESS = 40, 0.99  # of the bound in the end: each is to be less by that


def model_attempts(match: Matching, split: Decomposition, C: float) -> Iterator[Content]:
    """Yield premises and proof of a loop with a reference model, with more and more room."""
    premises = _premises(match, split)
    for raised in _RAISED:
        yield {"premises": premises, "proof": _proof(match, split, C * (1 + raised))}


def _premises(match: Matching, split: Decomposition) -> Content:
    loop, places = match.loop, match.loop.roles.places
    x, xm = coordinate_names(loop.order), model_state_names(loop.order)
    model, level = loop.spec("model"), loop.starts.level
    signals = ("t", *x, *xm, "yd")
    parts = {"plant": "plant", "model": "model", "W_hat": "weights"}
    return {
        "equation": operations(
            ("t", *x, "v"), lambda s: loop.acceleration(s["t"], [s[name] for name in x], s["v"])
        ),
        "regressor": [
            operations(signals, lambda s, i=i: loop.regressor(s)[i]) for i in range(len(match.W))
        ],
        "K": texts(loop.form.K),
        "P_b": _entries(loop.form)[-loop.order :],
        "a": texts(model.a),
        "b": str(exact(model.b)),
        "command": str(exact(loop.command)),
        "gain": str(loop.gain) if loop.own_feedback else None,
        "weights": _law(loop.spec("weights")),
        "actuator": split_content(split),
        "level": None if level is None else str(exact(level)),
        "starts": starts_content(loop.starts),
        **{part: loop.starts.names_of(places[role]) for part, role in parts.items()},
    }


def _law(weights: Any) -> Content:
    """Return how the weights learn, and what keeps them bounded."""
    if isinstance(weights, ProjectedWeights):
        kind, names = "projection", {"W_max": weights.W_max, "width": weights.width}
    elif isinstance(weights, AdaptiveWeights):
        kind, names = "sigma-modification", {"sigma": weights.sigma_1}
    else:
        kind, names = "e-modification", {"sigma": weights.sigma}
        if not weights.sigma:  # both are the gradient law
            kind = "sigma-modification"
    numbers = {name: str(exact(value)) for name, value in names.items()}
    return {"kind": kind, "Gamma": str(exact(weights.Gamma)), **numbers}


def _entries(form: QuadraticForm) -> list[str]:
    return [str(v) for row in form.P.tolist() for v in row]


def _proof(match: Matching, split: Decomposition, C: float) -> Content:
    """Return P, the weights, and stages: the box that closes, and smaller ones of the end."""
    loop, stages = match.loop, []
    for _ in range(_STAGES):
        need = region(match, split, arb(C), tol=_FINE)
        rest = exact(need.rest) * (1 + exact(_WIDER))
        bound = decrease(match, arb(need.D) + arb(need.rest) * _WIDER, arb(0))
        stages.append({"C": str(exact(need.C)), "rest": str(rest), **_fall(bound)})
        smaller = float(bound.error.upper()) * (1 + 1e-6)
        if not bound.falls or not 0 < smaller < C * _LESS:
            break
        C = smaller
    return {
        "error": {"P": _entries(loop.form), "mu": str(exact(loop.form.mu))},
        "model": {"P": _entries(loop.model_form), "mu": str(exact(loop.model_form.mu))},
        "beta": str(match.beta),
        "W": texts(match.W),
        "stages": stages,
    }


def _fall(bound: Decrease) -> Content:
    """Return the numbers by which V falls, as far as its modification has such."""
    if np.isfinite(bound.alpha_1):
        return {"alpha_1": str(exact(bound.alpha_1))}
    return {"V_e": str(exact(float(bound.error.upper())) * (1 + exact(_WIDER)))}
