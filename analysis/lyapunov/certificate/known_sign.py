"""Reading a loop with `nlctl.KnownSignLaw`: what its certificate is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb

from nlctl.blocks import block
from nlctl.controllers import (
    AdaptiveWeights,
    FilteredError,
    GaussianBasis,
    KnownSignLaw,
    RobustTerm,
    Zero,
)
from nlctl.diagrams import initial_state, interconnect
from nlctl.params import equation_arguments
from nlctl.references import SumOfSines
from nlctl.upstream.control_internals import set_parameters

from ..loop.external_inputs import bound_of_inputs
from ..loop.plant_form import Acceleration, acceleration, check_chain
from ..loop.roles import Parts, Roles, check_kind, joined_again, read_parts
from ..loop.same_loop import check_same, points_around

__all__ = ["KnownSignLoop", "initial_errors", "read_loop"]

PROVED_FOR = {
    "reference": (SumOfSines,),
    "filtered_error": (FilteredError,),
    "basis": (GaussianBasis,),
    "weights": (AdaptiveWeights, Zero),
    "robust": (RobustTerm,),
    "law": (KnownSignLaw,),
}


@dataclass(frozen=True, kw_only=True)
class KnownSignLoop:
    """The records of a loop with `nlctl.KnownSignLaw`, and where it starts.

    Attributes
    ----------
    parts : Parts
        Records of the blocks, and the gains.
    reference : SumOfSines
    e0 : tuple of n arb
        Initial errors e_1(0), ..., e_n(0).
    acceleration : callable
        x_n' as ``acceleration(t, x, v)``: the last entry of the plant's own update.
    disturbance : float
        Bound of what external inputs add to the plant's v.
    """

    parts: Parts
    reference: SumOfSines
    e0: tuple[arb, ...]
    acceleration: Acceleration
    disturbance: float = 0.0

    @property
    def law(self) -> KnownSignLaw:
        """The control law."""
        return self.parts.law

    @property
    def lambdas(self) -> tuple[float, ...]:
        """lambda_1, ..., lambda_{n-1} of the filtered error."""
        return self.parts.filtered_error.lambdas

    @property
    def nodes(self) -> int:
        """Number of nodes of the network; 0 without one."""
        return len(self.parts.gains.W_hat_0)


def read_loop(
    loop: Any,
    params: Mapping[str, Any] | None = None,
    inputs: Mapping[str, float] | None = None,
) -> KnownSignLoop:
    """Read a loop that is made of the paper's blocks and `nlctl.KnownSignLaw`.

    Parameters
    ----------
    loop : control.InterconnectedSystem
    params : mapping, optional
        Overrides by qualified name, as in a run.
    inputs : mapping, optional
        Bound of |w| for every external input w that is added to the plant's v, by name.

    Raises
    ------
    DiagramError
        If a block is missing, or is none of those that the proof is about; if the wiring, or a
        block's function, is another one; if the plant is not a chain of integrators; if an
        external input has no bound.
    """
    parts = read_parts(loop, params=params, inputs=True)
    bound = bound_of_inputs(parts.roles, inputs or {}, loop)
    for part, kinds in PROVED_FOR.items():
        if part in parts.roles.places:
            check_kind(parts.roles.places[part], kinds)
    plant = parts.roles.places["plant"]
    check_chain(plant)
    x0 = initial_state(loop)
    read = KnownSignLoop(
        parts=parts,
        reference=parts.roles.spec("reference"),
        e0=initial_errors(parts.roles, x0),
        acceleration=acceleration(plant),
        disturbance=bound,
    )
    again = joined_again(loop, parts.roles, lambda part, spec, name: block(spec, name))
    check_same(loop, interconnect(again, name=str(loop.name)), points_around(x0), params)
    set_parameters(loop, dict(params or {}))
    return read


def initial_errors(roles: Roles, x0: np.ndarray) -> tuple[arb, ...]:
    """Return e_1(0), ..., e_n(0) of a plant and a reference without states."""
    plant, reference = roles.places["plant"], roles.spec("reference")
    yd = reference.output(0.0, (), (), equation_arguments(reference))
    own = x0[plant.state_offset :][: plant.system.nstates]
    # the radius covers what double precision has lost in yd(0)
    return tuple(arb(float(x)) - arb(float(y), 1e-12) for x, y in zip(own, yd, strict=False))
