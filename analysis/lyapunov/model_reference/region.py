"""What the signals of the loop stay in while V <= C, and how large delta is there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from flint import arb

from nlctl.controllers import ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.plants import coordinate_names

from ...intervals.arithmetic import Ball, as_ball
from ...intervals.box import Box
from ...intervals.branch_and_bound import enclose_relatively, upper
from ...intervals.normal_form import exact
from ..bounds.decomposition import Decomposition
from .decrease import largest_weights
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
