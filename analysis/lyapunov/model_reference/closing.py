"""A bound that holds for all time: model reference adaptive control, proved by intervals.

As long as V <= C the signals stay in a box, on which |delta| <= D is proved; with that D,
V <= V_max(C) follows for all time.  If V_max(C) < C, then V never reaches C: up to the first time
that it did, the signals stayed in the box, and so V <= V_max(C).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from flint import arb

from nlctl.actuators import Gain
from nlctl.arguments import vector
from nlctl.errors import ParameterError
from nlctl.wording import counted

from ...intervals.branch_and_bound import upper
from ..bounds.clipped import clipped_split
from ..bounds.decomposition import Decomposition, decompose, only_declared
from ..loop.external_inputs import disturbed
from .audit import check_decrease
from .decrease import Decrease, decrease, outside_ball
from .matching import Matching, matching
from .model_certificate import ModelReferenceCertificate
from .model_loop import ModelReferenceLoop, read_model_reference
from .quadratic_form import ball
from .region import Region, region

__all__ = ["certify_model_reference"]

_LIMIT = 1e12  # a bound of V beyond which the iteration counts as without end
_TIGHTER = 1e-3  # relative: the ultimate bound is looked at again as long as it falls by more


def certify_model_reference(
    loop: Any,
    *,
    params: Mapping[str, Any] | None = None,
    inputs: Mapping[str, float] | None = None,
    starts: Any = None,
    k: tuple[float, float] | None = None,
    W: Sequence[float] | None = None,
    u_max: float = 250.0,
    tol: float = 1e-3,
    max_iterations: int = 60,
) -> ModelReferenceCertificate:
    """Prove bounds of a loop that `is_model_reference`; see `certify`."""
    read = read_model_reference(loop, params, inputs, starts)
    split = disturbed(_split(read, k, u_max, tol), read.disturbance)
    match = matching(read, split, _checked_weights(W, len(read.W_hat_0)))
    if not outside_ball(match):
        check_decrease(loop, match, params)
    V_0 = ball(match.V_0)
    C, iterations, reason = V_0, [upper(V_0)], ""
    for _ in range(max_iterations):
        need = region(match, split, C * (1 + tol) + tol * tol, tol=tol)
        found = decrease(match, arb(need.D), V_0)
        iterations.append(upper(found.level))
        reason = found.doubt or _endless(need, iterations)
        if reason or found.level < arb(need.C):
            break
        C = found.level
    else:
        shown = f"{iterations[-1]:.6g}"
        reason = f"V still grows after {counted(max_iterations, 'iteration')}: {shown}"
    reason = reason or _doubt(read, split, need, u_max)
    end = _in_the_end(match, split, found, tol) if not reason else found
    return _certificate(str(loop.name), match, split, need, (found, end), V_0, iterations, reason)


def _split(
    read: ModelReferenceLoop, k: tuple[float, float] | None, u_max: float, tol: float
) -> Decomposition:
    """Return the split of the actuator; of a gain the exact one, for all u."""
    actuator = read.spec("actuator")
    if k is not None or type(actuator) is not Gain or not actuator.k > 0:
        return decompose(actuator, k=k, u_max=u_max, tol=tol)
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
    shown = ", ".join(f"{C:.4g}" for C in iterations)
    return (
        f"the box does not close: C -> V_max(C) gives {shown} and so on without end; the largest "
        f"|rest| on {need.box} is {need.rest:.4g}"
    )


def _doubt(read: ModelReferenceLoop, split: Decomposition, need: Region, u_max: float) -> str:
    """Say why a box that closes proves nothing; nothing if it does."""
    if not np.isfinite(need.u):
        return f"no bound of |psi|, and so of |u|, is found on {need.box}: use another regressor"
    if split.provenance == "given":
        return only_declared(f"V <= {need.C:.6g}", read.spec("actuator"))
    if split.provenance == "proved" and need.u > 2 * u_max:
        return (
            f"|u| may reach {need.u:.4g}, the actuator's split is proved to {2 * u_max:g}: raise "
            "u_max"
        )
    return ""


def _in_the_end(match: Matching, split: Decomposition, found: Decrease, tol: float) -> Decrease:
    """Return bounds that hold in the end: V falls to a level on whose box delta is smaller."""
    while found.falls:
        need = region(match, split, found.error * (1 + tol) + tol * tol, tol=tol)
        again = decrease(match, arb(need.D), arb(0))
        if not again.error < found.error * (1 - _TIGHTER):
            break
        found = again
    return found


def _certificate(
    name: str, match: Matching, split: Decomposition, need: Region,
    bounds: tuple[Decrease, Decrease], V_0: arb, iterations: Sequence[float], reason: str,
) -> ModelReferenceCertificate:  # fmt: skip
    (found, end), holds, form, inf = bounds, not reason, match.loop.form, float("inf")
    closed = f"the box closes: V < {need.C:.6g} implies V <= {iterations[-1]:.6g}"
    errors = tuple(map(upper, form.errors(found.level)))
    return ModelReferenceCertificate(
        name=name,
        holds=holds,
        reason=reason or closed,
        e=errors[0] if holds else inf,
        errors=errors if holds else (inf,) * len(errors),
        W_error=upper((found.level * ball(match.Gamma)).sqrt()) if holds else inf,
        ultimate=upper(form.errors(end.error)[0]) if holds else inf,
        ultimate_W_error=upper((end.weights * ball(match.Gamma)).sqrt()) if holds else inf,
        rms=upper(form.first(end.mean)) if holds else inf,
        u_max=need.u if holds else inf,
        V_max=iterations[-1] if holds else inf,
        V_0=upper(V_0),
        alpha_0=found.alpha_0,
        alpha_1=found.alpha_1,
        iterations=tuple(iterations),
        region=need,
        split=split,
        matching=match,
        how=found.how,
        end=found.end,
    )
