"""Reading a loop of model reference adaptive control: what its certificate is about."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import control as ct
import numpy as np

from nlctl import controllers
from nlctl.controllers.mrac.model_error import lyapunov_matrix
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.diagrams import Place, leaves
from nlctl.errors import DiagramError
from nlctl.plants import coordinate_names
from nlctl.references import FilteredStep, FunctionReference, SumOfSines
from nlctl.upstream.control_internals import current_parameters
from nlctl.upstream.systems import System

from ...intervals.box import Box
from ...intervals.branch_and_bound import enclose
from ...intervals.normal_form import exact
from ..bounds.error_bounds import reference_bounds
from ..bounds.starts import Sides
from ..loop.checked import NOTHING_SUPPOSED, CheckedLoop, Supposed, read_checked
from ..loop.plant_form import on_intervals
from ..loop.roles import Pieces, Roles, declared, record_of
from .quadratic_form import QuadraticForm, quadratic_form

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
