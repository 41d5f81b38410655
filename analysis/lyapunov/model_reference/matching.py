r"""The plant as lambda times what the weights can learn, and the rest that nothing learns.

With v = k u + eps_u and lambda = beta k / gain > 0, whatever beta, W and k are,

.. math:: E_n' = -K^T E - \lambda (\hat{W} - W)^T \psi + \delta, \quad
   \delta = x_n' - \beta v - c (\nu + \nu_e) - \lambda W^T \psi + \beta\, \epsilon_u,

with c = 1 - lambda for `nlctl.controllers.ModelReferenceLaw` and c = 1 for
`nlctl.controllers.DirectLaw`.  beta is the coefficient of v in the plant's own equation, and W
takes away as much of it as the regressor spans, in rational arithmetic: where it spans all, nothing
of delta is left but disturbances.
"""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import control as ct
import numpy as np
from flint import arb

from nlctl import controllers
from nlctl.controllers.mrac.model_error import lyapunov_matrix
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.diagrams import Place, leaves
from nlctl.errors import DiagramError
from nlctl.plants import coordinate_names
from nlctl.references import FilteredStep, FunctionReference, SumOfSines
from nlctl.upstream.control_internals import current_parameters
from nlctl.upstream.systems import System

from ...intervals.arithmetic import Ball, as_ball, common
from ...intervals.box import Box
from ...intervals.branch_and_bound import enclose
from ...intervals.normal_form import Sum, as_sum, exact, indeterminate
from ...intervals.paths import Undecided
from ..bounds.decomposition import Decomposition
from ..bounds.error_bounds import reference_bounds
from ..bounds.starts import Sides
from ..loop.checked import NOTHING_SUPPOSED, CheckedLoop, Supposed, on_intervals, read_checked
from ..loop.roles import Pieces, Roles, declared, record_of
from .quadratic_form import QuadraticForm, ball, quadratic_form

ADAPTIVE_PIECES: Pieces = {
    "reference": ("yd", ()),
    "plant": ("y", ()),
    "actuator": ("v", ()),
    "model": ("nu", ()),
    "error": ("r", ()),
    "basis": ("psi[0]", ()),
    "weights": ("W_psi", ()),
    "law": ("u", ()),
}
_PROVED_FOR = {
    "reference": (SumOfSines, FilteredStep, FunctionReference),
    "model": (controllers.ReferenceModel,),
    "error": (controllers.ModelError,),
    "weights": (
        controllers.AdaptiveWeights,
        controllers.EModifiedWeights,
        controllers.ProjectedWeights,
    ),
    "law": (controllers.ModelReferenceLaw, controllers.DirectLaw),
}
_OF_V = ("plant", "weights")  # parts whose states V is of, besides those of the model
Regressor = Callable[[Mapping[str, Any]], list[Any]]


@dataclass(frozen=True, kw_only=True)
class ModelReferenceLoop(CheckedLoop):
    """A loop of model reference adaptive control; its pieces are `ADAPTIVE_PIECES`."""

    order: int  # order n of the plant and of the model
    # E^T P E of the error, with the P of the loop's own r = b^T P E, and one of the model
    form: QuadraticForm
    model_form: QuadraticForm
    command: float  # proved bound of |yd| for all time
    # the basis block's own psi_0, psi_1, ... where t, x1, ..., xm1, ..., yd have these
    # values.
    regressor: Regressor = field(repr=False)

    @property
    def own_feedback(self) -> bool:
        """Whether the law adds nu + nu_e itself; `nlctl.controllers.DirectLaw` learns it."""
        return isinstance(self.spec("law"), controllers.ModelReferenceLaw)

    @property
    def gain(self) -> Fraction:
        """The input gain that the law divides by."""
        return exact(self.spec("law").gain) if self.own_feedback else Fraction(1)


def is_model_reference(loop: System) -> bool:
    """Whether a diagram has a reference model, a block that outputs xm1 and nu."""
    return isinstance(loop, ct.InterconnectedSystem) and any(
        {"xm1", "nu"} <= set(declared(place, "outputs")) for place in leaves(loop)
    )


def read_model_reference(loop: Any, given: Supposed = NOTHING_SUPPOSED) -> ModelReferenceLoop:
    """Read a loop such as `nlctl.mrac` makes with a plant and an actuator."""
    read = read_checked(loop, ADAPTIVE_PIECES, _PROVED_FOR, given, _OF_V)
    roles, order = read.roles, _checked_orders(read.roles)
    model, error = roles.spec("model"), roles.spec("error")
    own_P = np.atleast_2d(error.lyapunov_matrix).copy()
    own_P[:, -1] = current_parameters(roles.places["error"].system).P_b
    P_of_model = lyapunov_matrix(model.a, (1.0,) * order)
    return ModelReferenceLoop(
        **vars(read),
        order=order,
        form=quadratic_form(roles.paths["error"], error.K, own_P),
        model_form=quadratic_form(roles.paths["model"], model.a, P_of_model),
        command=_bound_of_command(roles.places["reference"], read.start("reference")),
        regressor=_regressor(roles.places["basis"], order),
    )


def _checked_orders(roles: Roles) -> int:
    """Return the order n that plant, model and error have in common."""
    orders = {
        "plant": len(roles.spec("plant").states),
        "model": len(roles.spec("model").a),
        "error": len(roles.spec("error").K),
    }
    if len(set(orders.values())) > 1:
        listed = ", ".join(f"{roles.paths[part]} {n}" for part, n in orders.items())
        raise DiagramError(f"the proof needs plant, model and error of one order, got {listed}")
    return orders["plant"]


def _regressor(basis: Place, order: int) -> Regressor:
    """Return the basis block's own function of the signals that it takes."""
    arguments = (*coordinate_names(order), *model_state_names(order), "yd")
    names, p = declared(basis, "inputs"), current_parameters(basis.system)
    strange = [name for name in names if name not in arguments]
    if strange or basis.system.nstates:
        what = f"takes {', '.join(strange)}" if strange else "has states"
        raise DiagramError(
            f"the proof is about a regressor of {', '.join(arguments)} without memory, and block "
            f"'{basis.path}' {what}: use such a regressor"
        )
    output = on_intervals(basis.path, basis.system.outfcn)

    def psi(values: Mapping[str, Any]) -> list[Any]:
        u = np.empty(len(names), dtype=object)
        u[:] = [values[name] for name in names]
        return list(output(values["t"], np.empty(0, dtype=object), u, p))

    return psi


def _bound_of_command(place: Place, x0: Sides) -> float:
    """Return a proved bound of |yd| for all time."""
    spec = record_of(place)
    if isinstance(spec, SumOfSines):
        return reference_bounds(spec)[0]
    if isinstance(spec, FilteredStep):
        if np.any(x0):
            raise DiagramError(f"the proof needs '{place.path}' to start from 0, got {x0}")
        return abs(spec.height)  # the step response of (omega / (s + omega))^(n+1) rises to 1
    p, output = current_parameters(place.system), on_intervals(place.path, place.system.outfcn)
    wide = Box.of(t=(0.0, np.inf))

    def yd(point: tuple[Any, ...]) -> Any:
        return output(point[0], (), (), p)[declared(place, "outputs").index("yd")]

    bound = enclose(yd, wide, max_boxes=1).magnitude
    if not np.isfinite(bound):
        raise DiagramError(
            f"no bound of yd of block '{place.path}' for all t >= 0 is found in interval "
            "arithmetic: write it with functions that are bounded for all t, such as np.sin"
        )
    return bound


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
