r"""The plant as lambda times what the weights can learn, and the rest that nothing learns.

With v = k u + eps_u and lambda = beta k / gain > 0, whatever beta, W and k are,

.. math:: E_n' = -K^T E - \lambda (\hat{W} - W)^T \psi + \delta, \quad
   \delta = x_n' - \beta v - c (\nu + \nu_e) - \lambda W^T \psi + \beta\, \epsilon_u,

with c = 1 - lambda for `nlctl.controllers.ModelReferenceLaw` and c = 1 for
`nlctl.controllers.DirectLaw`.  beta is the coefficient of v in the plant's own equation, and W
takes away as much of it as the regressor spans, in rational arithmetic: where it spans all, nothing
of delta is left but disturbances.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.errors import DiagramError
from nlctl.plants import coordinate_names

from ...intervals.arithmetic import Ball, as_ball, common
from ...intervals.normal_form import Sum, as_sum, exact, indeterminate
from ...intervals.paths import Undecided
from ..bounds.decomposition import Decomposition
from .model_loop import ModelReferenceLoop
from .quadratic_form import ball


@dataclass(frozen=True, kw_only=True)
class Matching:
    """How a plant is matched: x_n' = beta v + c (nu + nu_e) + lambda W^T psi + rest."""

    loop: ModelReferenceLoop
    k: Fraction  # of v = k u + eps_u: the middle of its bounds
    # input gain of the plant, and lambda = beta k / gain
    beta: Fraction
    lam: Fraction
    W: tuple[Fraction, ...]  # weights that match, or were chosen
    chosen: bool  # whether they were chosen by the caller
    rest: Sum  # what is left of the plant's equation, in the symbols t, x1, ..., xm1, ..., yd, v

    @property
    def W_squared(self) -> Fraction:  # noqa: N802
        """|W|^2."""
        return sum((w * w for w in self.W), Fraction(0))

    @functools.cached_property
    def V_0(self) -> Fraction:  # noqa: N802
        """The largest V = E^T P E + lambda |W_hat - W|^2 / Gamma of the starts, exactly."""
        loop, level = self.loop, self.loop.starts.level
        if not np.all(np.isfinite([*loop.start("plant"), *loop.start("weights")])):
            assert level is not None
            return exact(level)
        E = [
            (exact(x[0]) - exact(xm[1]), exact(x[1]) - exact(xm[0]))
            for x, xm in zip(loop.start("plant"), loop.start("model"), strict=True)
        ]
        value = loop.form.largest(E)
        ends = zip(loop.start("weights"), self.W, strict=True)
        error = sum((max((exact(w) - W) ** 2 for w in side) for side, W in ends), Fraction(0))
        largest = Fraction(int(value.p), int(value.q)) + error / self.Gamma
        return largest if level is None else min(largest, exact(level))

    @property
    def weights_at_start(self) -> arb:
        """A bound of |W_hat(0)|."""
        if np.all(np.isfinite(self.loop.start("weights"))):
            largest = (max(abs(exact(w)) for w in side) for side in self.loop.start("weights"))
            return ball(sum((w * w for w in largest), Fraction(0))).sqrt()
        return (ball(self.V_0 * self.Gamma)).sqrt() + ball(self.W_squared).sqrt()

    @property
    def Gamma(self) -> Fraction:  # noqa: N802
        """Gamma / lambda, by which the weights' part of V is divided."""
        return exact(self.loop.spec("weights").Gamma) / self.lam

    def rest_on(self, values: Mapping[str, Any]) -> Any:
        """Return the rest where the symbols have these values, balls by name."""
        # Where functions take part it is what two enclosures have in common: that of the sum of
        # products, in which what is equal has cancelled, and that of the equation as it is written.
        # Of symbols that have cancelled the latter is taken at 0, as it does not depend on them.
        tight = as_ball(self.rest.on(values))
        if not any(atom.arguments for product in self.rest.terms for atom, _ in product):
            return tight
        anywhere = dict.fromkeys(equation_signals(self.loop), Ball(arb(0)))
        plain = as_ball(self._as_written(anywhere | dict(values)))
        if tight.value.is_finite() and plain.value.is_finite():
            self._check_overlap(tight.value.overlaps(plain.value))
        one, other = tight.gradient, plain.gradient
        both = tuple(common(a, b) for a, b in zip(one, other, strict=True)) if one and other else ()
        return Ball(common(tight.value, plain.value), both or one or other)

    def _check_overlap(self, overlap: bool) -> None:
        if not overlap:
            raise DiagramError(
                f"the equation of '{self.loop.roles.paths['plant']}' and its sum of products differ"
            )

    def _as_written(self, values: Mapping[str, Any]) -> Any:
        loop, (beta, share, learned) = self.loop, self._coefficients
        x = [values[name] for name in coordinate_names(loop.order)]
        left = loop.acceleration(values["t"], x, values["v"]) - beta * values["v"]
        if not share.value.is_zero():
            left = left - share * feedback(loop, values, _ball)
        for w, psi in zip(learned, loop.regressor(values), strict=True):
            if not w.value.is_zero():
                left = left - w * psi
        return left

    @functools.cached_property
    def _coefficients(self) -> tuple[Ball, Ball, tuple[Ball, ...]]:
        """Balls of beta, of the share of nu + nu_e, and of lambda W."""
        share = _feedback_share(self.loop, self.lam)
        return _ball(self.beta), _ball(share), tuple(_ball(self.lam * w) for w in self.W)


def _ball(x: object) -> Ball:
    return Ball(ball(x))


def _feedback_share(loop: ModelReferenceLoop, lam: Fraction) -> Fraction:
    return 1 - lam if loop.own_feedback else Fraction(1)


def feedback(loop: ModelReferenceLoop, values: Mapping[str, Any], number: Any) -> Any:
    """Return nu + nu_e = b yd - a^T xm - K^T (x - xm), where the signals have these values."""
    model = loop.spec("model")
    total = number(exact(model.b)) * values["yd"]
    names = zip(coordinate_names(loop.order), model_state_names(loop.order), strict=True)
    for a, K, (x, xm) in zip(model.a, loop.form.K, names, strict=True):
        total = total - number(K) * values[x] - number(exact(a) - K) * values[xm]
    return total


def symbols(loop: ModelReferenceLoop) -> dict[str, Sum]:
    """Return the symbols of the equations by name."""
    return {name: indeterminate(name) for name in equation_signals(loop)}


def equation_signals(loop: ModelReferenceLoop) -> tuple[str, ...]:
    """Return t, x1, ..., xm1, ..., yd, v."""
    return ("t", *coordinate_names(loop.order), *model_state_names(loop.order), "yd", "v")


def matching(
    loop: ModelReferenceLoop, split: Decomposition, W: Sequence[float] | None = None
) -> Matching:
    """Take away from a plant's equation what the loop's own weights can learn."""
    values = symbols(loop)
    x = [values[name] for name in coordinate_names(loop.order)]
    paths = loop.roles.paths
    try:
        rate = as_sum(loop.acceleration(values["t"], x, values["v"]))
        psi = [as_sum(one) for one in loop.regressor(values)]
    except Undecided as error:
        raise DiagramError(
            f"the equations of '{paths['plant']}' and '{paths['basis']}' have to be arithmetic and "
            f"functions for this proof, without cases that depend on the state: {error}"
        ) from None
    (by_v,) = values["v"].terms
    beta, k = rate.coefficient(by_v), (exact(split.k_1) + exact(split.k_2)) / 2
    lam = beta * k / loop.gain
    if not lam > 0:
        raise DiagramError(
            f"the proof needs an input gain of the sign that '{paths['law']}' assumes: the "
            f"coefficient of v alone in '{paths['plant']}' is {float(beta):g}, the actuator's gain "
            f"{float(k):g}, the law's {float(loop.gain):g}"
        )
    target = rate - beta * values["v"]
    target = target - _feedback_share(loop, lam) * feedback(loop, values, exact)
    given = None if W is None else [lam * exact(w) for w in W]
    weights, rest = _taken_away(target, psi, given)
    W_lam = tuple(w / lam for w in weights)
    return Matching(loop=loop, k=k, beta=beta, lam=lam, W=W_lam, chosen=W is not None, rest=rest)


def _taken_away(
    target: Sum, psi: Sequence[Sum], given: Sequence[Fraction] | None
) -> tuple[list[Fraction], Sum]:
    """Return weights w and target - w^T psi."""
    # Those that match are found by elimination: each regressor, less those before it, takes away
    # one product of the target, if the target becomes no longer by that.
    if given is not None:
        for w, one in zip(given, psi, strict=True):
            target = target - w * one
        return list(given), target
    weights = [Fraction(0)] * len(psi)
    rows: list[tuple[Any, Sum, list[Fraction]]] = []
    for i, one in enumerate(psi):
        combination = [Fraction(int(i == j)) for j in range(len(psi))]
        for product, row, made_of in rows:
            factor = one.coefficient(product)
            one = one - factor * row
            combination = [a - factor * b for a, b in zip(combination, made_of, strict=True)]
        if one.terms:
            pivot = next((p for p in one.terms if p in target.terms), next(iter(one.terms)))
            scale = 1 / one.coefficient(pivot)
            rows.append((pivot, one * scale, [scale * a for a in combination]))
    for product, row, made_of in rows:
        factor = target.coefficient(product)
        shorter = target - factor * row
        if factor and len(shorter.terms) < len(target.terms):
            target = shorter
            weights = [w + factor * a for w, a in zip(weights, made_of, strict=True)]
    return weights, target
