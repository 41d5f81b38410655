r"""What V = E^T P E + lambda |W_hat - W|^2 / Gamma does, for each modification of the weights.

With |delta| <= D and the gradient law :math:`\dot{\hat{W}} = \Gamma r \psi` + leakage,
V' = -E^T Q E + 2 r delta + 2 lambda (W_hat - W)^T leakage / Gamma, where r^2 <= q E^T Q E and
E^T Q E >= mu E^T P E.  Squares are completed, in ball arithmetic.  With s^2 = E^T Q E all of them
give V' <= -s^2 + 2 a s + b: as V stays bounded, the mean of s^2 is at most (a + (a^2 + b)^(1/2))^2
in the end, which does not depend on Gamma.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from flint import arb
from scipy.optimize import minimize_scalar

from nlctl.controllers import AdaptiveWeights, EModifiedWeights, ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.plants import coordinate_names

from ...intervals.arithmetic import Ball, as_ball
from ...intervals.box import Box
from ...intervals.branch_and_bound import enclose, enclose_relatively, upper
from ...intervals.normal_form import exact
from ..bounds.decomposition import Decomposition
from .matching import Matching
from .quadratic_form import ball

_BOXES = 2_000


@dataclass(frozen=True, kw_only=True)
class Region:
    """Bounds that hold while V <= C."""

    C: float  # bound of V
    box: Box  # what t, x1, ..., xm1, ..., yd and v stay in
    errors: tuple[float, ...]  # bounds of |E_1|, ..., |E_n|
    # bounds of |W_hat - W|, |W_hat|, |psi| and |u|
    W_error: float
    W_hat: float
    psi: float
    u: float
    rest: float  # proved bound of what neither the law nor the weights know of the plant's equation
    D: float  # proved bound of |delta|: of the rest, and of what the actuator and inputs add
    boxes: int  # boxes of the proof
    arithmetic: Literal["balls"] = "balls"  # what proved it


def model_reach(match: Matching) -> arb:
    """Return the level that xm^T P xm does not leave: the command drives the model."""
    loop = match.loop
    drive = ball(abs(exact(loop.spec("model").b))) * loop.command
    sides = [(exact(low), exact(high)) for low, high in loop.start("model")]
    return ball(loop.model_form.largest(sides)).max(loop.model_form.driven(drive))


def region(match: Matching, split: Decomposition, C: arb, *, tol: float) -> Region:
    """Bound all signals, and delta, while V <= C."""
    C = arb(upper(C))  # the bound that is reported, and no smaller one
    loop, model = match.loop, model_reach(match)
    errors = tuple(map(upper, loop.form.errors(C)))
    modelled = tuple(map(upper, loop.model_form.errors(model)))
    states = [e + m for e, m in zip(map(arb, errors), map(arb, modelled), strict=True)]
    W_error = (C * ball(match.Gamma)).sqrt()
    W_hat = W_error + ball(match.W_squared).sqrt()
    if isinstance(loop.spec("weights"), ProjectedWeights):
        W_hat = W_hat.min(largest_weights(match))
    sides = dict(zip(coordinate_names(loop.order), map(upper, states), strict=True))
    sides |= dict(zip(model_state_names(loop.order), modelled, strict=True))
    sides["yd"] = loop.command
    psi = _largest_regressor(match, sides)
    u = (W_hat * psi + _largest_feedback(match, C, model)) / ball(abs(loop.gain))
    v = arb(split.k_2) * u + split.eps_star
    box = _box({**sides, "v": upper(v)})
    rest, boxes = _largest_rest(match, box, tol)
    spread = (arb(split.k_2) - split.k_1) / 2 * u
    D = rest + ball(abs(match.beta)) * (split.eps_star + spread)
    return Region(
        C=upper(C),
        box=box,
        errors=errors,
        W_error=upper(W_error),
        W_hat=upper(W_hat),
        psi=upper(psi),
        u=upper(u),
        rest=upper(rest),
        D=upper(D),
        boxes=boxes,
    )


def _box(sides: Mapping[str, float]) -> Box:
    return Box.of(t=(0.0, np.inf), **{name: (-a, a) for name, a in sides.items()})


def _wide(sides: Mapping[str, float]) -> dict[str, Any]:
    finite = {name: arb(0, a) if np.isfinite(a) else arb(0, "inf") for name, a in sides.items()}
    return {name: Ball(value) for name, value in (finite | {"t": arb(0, "inf")}).items()}


def _largest_regressor(match: Matching, sides: Mapping[str, float]) -> arb:
    """Return a bound of |psi|, from one box."""
    values = [as_ball(psi).value for psi in match.loop.regressor(_wide(sides))]
    return sum((abs(value).upper() ** 2 for value in values), arb(0)).sqrt()


def _largest_feedback(match: Matching, C: arb, model: arb) -> arb:
    """Return a bound of |nu + nu_e|, where the law adds it."""
    loop, spec = match.loop, match.loop.spec("model")
    if not loop.own_feedback:
        return arb(0)
    driven = ball(abs(exact(spec.b))) * loop.command + loop.model_form.reach(model, spec.a)
    return driven + loop.form.reach(C, loop.form.K)


def _largest_rest(match: Matching, box: Box, tol: float) -> tuple[arb, int]:
    """Return a proved bound of the rest over a box, and the number of boxes."""
    if not match.rest.terms and not match.rest.partial:
        return arb(0), 0
    names = tuple(name for name in box.names if name in match.rest.names)
    if not names:
        return abs(match.rest_on({}).value).upper(), 1

    def rest(point: tuple[Any, ...]) -> Any:
        return match.rest_on(dict(zip(names, point, strict=True)))

    over = box.only(*names)
    if not all(np.isfinite(over[name][1]) for name in names if name != "t"):
        return arb("inf"), 0
    bound = enclose_relatively(rest, over, tol, _BOXES)
    return arb(bound.magnitude), bound.boxes


_SQUARE = "the integral of E^T Q E is finite"
_FINE = 1e-6  # relative: of the one-dimensional maximum of e-modification


@dataclass(frozen=True, kw_only=True)
class Decrease:
    """Bounds of V while |delta| <= D."""

    level: arb  # bound of V for all time
    # bounds of limsup E^T P E and of limsup lambda |W_hat - W|^2 / Gamma
    error: arb
    weights: arb
    mean: arb  # bound of the limit superior of the mean of E^T Q E over [0, t]
    falls: bool = False  # whether limsup V <= `error`, too
    # V' <= -alpha_1 V + alpha_0; NaN where there is no such inequality
    alpha_0: float = np.nan
    alpha_1: float = np.nan
    # where the level comes from, and the bounds in the end
    how: str
    end: str
    doubt: str = ""  # why there is no bound; nothing if there is one


def decrease(match: Matching, D: arb, V_0: arb) -> Decrease:
    """Bound V for all time and in the end, from its value at the beginning."""
    weights = match.loop.spec("weights")
    if not D.is_finite():
        endless = arb("inf")
        return Decrease(level=endless, error=endless, weights=endless, mean=endless, how="", end="")
    if isinstance(weights, ProjectedWeights):
        return _projection(match, D, V_0)
    sigma = exact(sigma_of(weights))
    if not sigma:
        return _gradient(match.loop.roles.paths["weights"], D, V_0)
    bounds = _sigma_modification if isinstance(weights, AdaptiveWeights) else _e_modification
    return bounds(match, ball(sigma * match.lam), D, V_0)


def sigma_of(weights: AdaptiveWeights | EModifiedWeights) -> float:
    """Return what the leakage of weights is weighted with."""
    return weights.sigma_1 if isinstance(weights, AdaptiveWeights) else weights.sigma


def _gradient(path: str, D: arb, V_0: arb) -> Decrease:
    """V' <= -E^T Q E without a disturbance; with one the weights may drift without end."""
    doubt = (
        f"parameter drift: the weights '{path}' have no modification, and |delta| may be "
        f"{float(D.upper()):.4g}, so that nothing bounds them; give them sigma-modification "
        "(AdaptiveWeights with sigma_1 > 0), e-modification or projection"
    )
    return Decrease(
        level=V_0,
        error=arb(0),
        weights=V_0,
        mean=arb(0),
        how="V(0): V' <= -E^T Q E",
        end=_SQUARE,
        doubt="" if D.is_zero() else doubt,
    )


def _sigma_modification(match: Matching, sigma: arb, D: arb, V_0: arb) -> Decrease:
    """V' <= -a V + q D^2/(1 - a/mu) + sigma |W|^2/(2 - a/(Gamma sigma)) for every small rate a."""
    form, W_squared = match.loop.form, ball(match.W_squared)
    mu, Gamma = arb(form.mu), ball(match.Gamma)
    drive, leak = ball(form.q) * D * D, sigma * W_squared

    def alpha_0(a: arb) -> arb:
        return drive / (1 - a / mu) + leak / (2 - a / (Gamma * sigma))

    fastest = min(form.mu, 2 * float(Gamma * sigma))
    a = _best_rate(lambda a: float(alpha_0(arb(a))) / a, fastest)
    drive_at_a = alpha_0(arb(a))
    ultimate = drive_at_a / a
    return Decrease(
        level=V_0.max(ultimate),
        error=ultimate,
        weights=ultimate,
        mean=(drive.sqrt() + (drive + leak / 2).sqrt()) ** 2,
        falls=True,
        alpha_0=upper(drive_at_a),
        alpha_1=a,
        how="max{V(0), alpha_0/alpha_1}",
        end="V -> alpha_0/alpha_1 or less",
    )


def _best_rate(cost: Callable[[float], float], fastest: float) -> float:
    """Return a rate between 0 and the fastest; any is as good for the proof."""
    minimum: Any = minimize_scalar(
        lambda share: cost(share * fastest), bounds=(1e-3, 1 - 1e-3), method="bounded"
    )
    return float(minimum.x * fastest)


def _e_modification(match: Matching, sigma: arb, D: arb, V_0: arb) -> Decrease:
    """V' <= -E^T Q E + |r| h(s) with h = 2 D + sigma |W|^2/2 - 2 sigma s^2, s = |W_hat - W/2|."""
    # V' > 0 only where the root of E^T Q E is below sqrt(q) h(s): the largest V there is the level.
    # Where V stays above it in the end, the integral of E^T Q E is finite, and E -> 0.
    form, W = match.loop.form, ball(match.W_squared).sqrt()
    mu, Gamma, q = arb(form.mu), ball(match.Gamma), ball(form.q)
    h_0 = 2 * D + sigma * W * W / 2
    widest = (h_0 / (2 * sigma)).sqrt()

    def largest(point: tuple[Any, ...]) -> Any:
        (share,) = point
        distance = share * widest + W / 2
        h = (1 - share**2) * h_0
        return h**2 * (q / mu) + distance**2 * (1 / Gamma)

    rough = float((q / mu * h_0**2 + (widest + W / 2) ** 2 / Gamma).upper())
    if rough == 0:
        V_e = arb(0)
    else:
        V_e = arb(enclose(largest, Box.of(share=(0.0, 1.0)), tol=_FINE * rough).high)
    level = V_0.max(V_e)
    return Decrease(
        level=level,
        error=V_e,
        weights=level,
        mean=q * h_0**2,
        how="max{V(0), V_e}, V_e the largest V at which V' > 0 is possible",
        end="V <= V_e in the end, or E -> 0",
    )


def _projection(match: Matching, D: arb, V_0: arb) -> Decrease:
    """V' <= -E^T Q E + 2 r delta for W in the inner ball, and |W_hat| stays in the outer one."""
    form, doubt = match.loop.form, outside_ball(match)
    if doubt:
        endless = arb("inf")
        return Decrease(
            level=V_0, error=V_0, weights=V_0, mean=endless, how="", end="", doubt=doubt
        )
    if D.is_zero():
        how = "V(0): V' <= -E^T Q E"
        none = arb(0)
        return Decrease(level=V_0, error=none, weights=V_0, mean=none, how=how, end=_SQUARE)
    W_part = (largest_weights(match) + ball(match.W_squared).sqrt()) ** 2 / ball(match.Gamma)
    ultimate = W_part + form.driven(D)
    return Decrease(
        level=V_0.max(ultimate),
        error=ultimate,
        weights=ultimate.min(W_part),
        mean=4 * ball(form.q) * D * D,
        falls=True,
        how="max{V(0), lambda (W_max + |W|)^2/Gamma + 4 q D^2/mu}",
        end="V -> the second or less",
    )


def largest_weights(match: Matching) -> arb:
    """Return the radius that |W_hat| does not leave under projection: where f >= 1 it falls."""
    return arb(match.loop.spec("weights").W_max).max(match.weights_at_start)


def outside_ball(match: Matching) -> str:
    """Say that projection may take the weights away from W; nothing if it never does."""
    weights = match.loop.spec("weights")
    if not isinstance(weights, ProjectedWeights):
        return ""
    radius, width = exact(weights.W_max), exact(weights.width)
    if match.W_squared * (1 + width) <= radius * radius:
        return ""
    size, inner = float(ball(match.W_squared).sqrt()), float(radius) / float(1 + width) ** 0.5
    return (
        f"the weights that match have the norm {size:.4g}, and the inner ball of the projection "
        f"has the radius {inner:.4g}: raise W_max"
    )
