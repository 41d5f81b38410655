"""Reading a loop with `nlctl.KnownSignLaw`: what its certificate is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb

from nlctl.controllers import (
    AdaptiveWeights,
    FilteredError,
    GaussianBasis,
    KnownSignLaw,
    RobustTerm,
    Zero,
)
from nlctl.params import equation_arguments
from nlctl.references import SumOfSines

from ..loop.checked import read_checked
from ..loop.plant_form import Acceleration, acceleration
from ..loop.roles import PIECES, Parts, Roles, read_parts

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
        As `read_parts` and `read_checked` do.
    """
    parts = read_parts(loop, params=params, inputs=True)
    checked = read_checked(loop, PIECES, PROVED_FOR, params, inputs)
    return KnownSignLoop(
        parts=parts,
        reference=parts.roles.spec("reference"),
        e0=initial_errors(parts.roles, checked.x0),
        acceleration=acceleration(checked.roles.places["plant"]),
        disturbance=checked.disturbance,
    )


def initial_errors(roles: Roles, x0: np.ndarray) -> tuple[arb, ...]:
    """Return e_1(0), ..., e_n(0) of a plant and a reference without states."""
    plant, reference = roles.places["plant"], roles.spec("reference")
    yd = reference.output(0.0, (), (), equation_arguments(reference))
    own = x0[plant.state_offset :][: plant.system.nstates]
    # the radius covers what double precision has lost in yd(0)
    return tuple(arb(float(x)) - arb(float(y), 1e-12) for x, y in zip(own, yd, strict=False))
