"""Model reference adaptive control, proved by intervals: V <= C gives a box, and the box V_max(C).

On the box |delta| <= D is proved, and with that D follows V <= V_max(C) for all time.

Whether V' of the proof is V' of the loop, by python-control's own right-hand side at points.

The proof's V' is made of what was read: P, Q, beta, lambda, W, the rest, the leakage of the
weights.  The loop's is the gradient of V times its rates.  Signals u and v are the loop's own, so
that both agree at every state, whether a run comes there or not.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import control as ct
import numpy as np
from flint import arb

from nlctl.actuators import Gain
from nlctl.arguments import vector
from nlctl.controllers import AdaptiveWeights, ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.diagrams import initial_state
from nlctl.diagrams.points import rates_and_outputs
from nlctl.errors import DiagramError, ParameterError
from nlctl.plants import coordinate_names
from nlctl.wording import counted

from ...intervals.arithmetic import Ball, as_ball
from ...intervals.branch_and_bound import upper
from ..bounds.clipped import clipped_split
from ..bounds.decomposition import Decomposition, decompose
from ..loop.checked import disturbed, points_around
from ..proofs.kind import Closed, ProofKind, ProofOptions, Subject, wider, without_end
from .decrease import Decrease, Region, decrease, outside_ball, region, sigma_of
from .matching import (
    Matching,
    ModelReferenceLoop,
    is_model_reference,
    matching,
    read_model_reference,
)
from .model_certificate import ModelReferenceCertificate
from .quadratic_form import ball

_LIMIT = 1e12  # a bound of V beyond which the iteration counts as without end
_TIGHTER = 1e-3  # relative: the ultimate bound is computed again as long as it falls by more


def _begin(loop: Any, options: ProofOptions) -> Subject:
    read = read_model_reference(loop, options)
    split = disturbed(_split(read, options), read.disturbance)
    match = matching(read, split, _checked_weights(options.W, len(read.start("weights"))))
    if not outside_ball(match):
        check_decrease(loop, match, options.params)
    return Subject(
        loop=read, start=ball(match.V_0), actuator=read.spec("actuator"), split=split,
        u_max=options.u_max, tol=options.tol, matching=match,
    )  # fmt: skip


def _split(read: ModelReferenceLoop, options: ProofOptions) -> Decomposition:
    """Return the split of the actuator; of a gain the exact one, for all u."""
    actuator, k = read.spec("actuator"), options.k
    if k is not None or type(actuator) is not Gain or not actuator.k > 0:
        return decompose(actuator, k=k, u_max=options.u_max, tol=options.tol)
    gain = actuator.k
    return Decomposition(
        k_1=gain, k_2=gain, eps_low=0.0, eps_high=0.0, part=clipped_split(gain, gain),
        provenance="computed", how="v = k u", over="all u",
    )  # fmt: skip


def _checked_weights(W: Sequence[float] | None, count: int) -> list[float] | None:
    if W is None:
        return None
    values = vector("certify", "W", W)
    if values.size != count:
        raise ParameterError(
            f"certify needs W with one weight for each of {counted(count, 'regressor')}, got "
            f"{values.size}"
        )
    return [float(w) for w in values]


def _region(subject: Subject, level: arb) -> Region:
    C = wider(level, subject.tol)
    return region(subject.matching, subject.split, C, tol=subject.tol)


def _bound(subject: Subject, need: Region) -> Decrease:
    bound = decrease(subject.matching, arb(need.D), subject.start)
    if bound.doubt or np.isfinite(need.u):
        return bound
    doubt = f"no bound of |psi|, and so of |u|, is found on {need.box}: use another regressor"
    return dataclasses.replace(bound, doubt=doubt)


def _endless(need: Region, iterations: Sequence[float]) -> str:
    """Say why the iteration must end without a bound; nothing if it need not."""
    if iterations[-1] < _LIMIT:
        return ""
    if len(iterations) == 2 and not np.isfinite(need.rest):
        return (
            "no bound of what neither the law nor the weights know of the plant's equation is "
            f"found on {need.box}: write disturbances with functions that are bounded for all t, "
            "such as np.sin, or as an external input with a declared bound"
        )
    largest = f"the largest |rest| on {need.box} is {need.rest:.4g}"
    return f"{without_end('V_max(C)', iterations)}; {largest}"


def _in_the_end(subject: Subject, bound: Decrease) -> Decrease:
    """Return bounds that hold in the end: V falls to a level on whose box delta is smaller."""
    while bound.falls:
        need = _region(subject, bound.error)
        again = decrease(subject.matching, arb(need.D), arb(0))
        if not again.error < bound.error * (1 - _TIGHTER):
            break
        bound = again
    return bound


def _fields(subject: Subject, closed: Closed) -> dict[str, Any]:
    bound, match, form = closed.bound, subject.matching, subject.loop.form
    end = _in_the_end(subject, bound) if closed.holds else bound
    Gamma, errors = ball(match.Gamma), tuple(map(upper, form.errors(bound.level)))
    bounds = {
        "e": errors[0],
        "W_error": upper((bound.level * Gamma).sqrt()),
        "ultimate": upper(form.errors(end.error)[0]),
        "ultimate_W_error": upper((end.weights * Gamma).sqrt()),
        "rms": upper(form.first(end.mean)),
        "u_max": closed.u,
        "V_max": closed.iterations[-1],
    }
    return {name: closed.proved(value) for name, value in bounds.items()} | {
        "errors": tuple(map(closed.proved, errors)),
        "V_0": upper(subject.start),
        "alpha_0": bound.alpha_0,
        "alpha_1": bound.alpha_1,
        "matching": match,
        "how": bound.how,
        "end": bound.end,
    }


MODEL_REFERENCE = ProofKind(
    name="reference model",
    about="a ModelReferenceLaw or DirectLaw with a ReferenceModel",
    result=ModelReferenceCertificate,
    fits=is_model_reference,
    takes_W=True,
    bounded="V",
    begin=_begin,
    region=_region,
    bound=_bound,
    endless=_endless,
    largest_input=lambda subject, need, bound: need.u,
    fields=_fields,
)


_EQUAL = 1e-7  # relative to the size of the terms


def check_decrease(
    loop: ct.InterconnectedSystem, match: Matching, params: Mapping[str, Any] | None = None
) -> None:
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

    P, Q = (
        np.array([[float(arb(v)) for v in row] for row in M.tolist()])
        for M in (loop.form.P, loop.form.Q)
    )
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
    return sigma_of(weights) * (1.0 if isinstance(weights, AdaptiveWeights) else abs(r))


def _delta(match: Matching, t: float, signals: Mapping[str, float]) -> float:
    order = match.loop.order
    names = (*coordinate_names(order), *model_state_names(order), "yd", "v")
    values = {"t": t} | {name: signals[name] for name in names}
    balls = {name: Ball(arb(float(value))) for name, value in values.items()}
    rest = float(as_ball(match.rest.on(balls)).value.mid())
    return rest + float(match.beta) * (signals["v"] - float(match.k) * signals["u"])
