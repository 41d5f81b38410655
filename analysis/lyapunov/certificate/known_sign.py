"""Reading a loop with `nlctl.KnownSignLaw`: what its certificate is about."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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

from ..bounds.starts import Sides, Starts
from ..loop.checked import read_checked
from ..loop.content import LoopContent
from ..loop.plant_form import Acceleration, acceleration
from ..loop.roles import PIECES, Parts, Roles, parts_of

__all__ = ["KnownSignLoop", "filtered_error", "initial_errors", "read_loop"]

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
    starts : Starts
        Initial states.
    e0 : tuple of n arb
        Initial errors e_1(0), ..., e_n(0): of all starts.
    delta_hat_0 : arb
    W_hat_0 : tuple of arb
        Initial estimates, of all starts.
    acceleration : callable
        x_n' as ``acceleration(t, x, v)``: the last entry of the plant's own update.
    content : LoopContent
        What the loop consists of.
    disturbance : float
        Bound of what external inputs add to the plant's v.
    """

    parts: Parts
    reference: SumOfSines
    starts: Starts
    e0: tuple[arb, ...]
    delta_hat_0: arb
    W_hat_0: tuple[arb, ...]
    acceleration: Acceleration
    content: LoopContent
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

    def states(self, part: str) -> list[str]:
        """Names of the states of a part."""
        return self.starts.names_of(self.parts.roles.places[part])

    @property
    def r_0(self) -> arb:
        """r(0) of (14)."""
        return filtered_error(self.lambdas, self.e0)


def read_loop(
    loop: Any,
    params: Mapping[str, Any] | None = None,
    inputs: Mapping[str, float] | None = None,
    starts: Any = None,
) -> KnownSignLoop:
    """Read a loop that is made of the paper's blocks and `nlctl.KnownSignLaw`."""
    checked = read_checked(loop, PIECES, PROVED_FOR, params, inputs, starts)
    parts = parts_of(checked.given, checked.roles)
    return KnownSignLoop(
        parts=parts,
        reference=parts.roles.spec("reference"),
        starts=checked.starts,
        e0=initial_errors(parts.roles, checked.start("plant")),
        delta_hat_0=between(*checked.start("robust")[0]),
        W_hat_0=tuple(between(*ends) for ends in checked.start("weights")) if parts.weights else (),
        acceleration=acceleration(checked.roles.places["plant"]),
        content=checked.content,
        disturbance=checked.disturbance,
    )


def between(low: float, high: float) -> arb:
    """Return an interval."""
    return arb(low) if low == high else arb(low).union(arb(high))


def filtered_error(lambdas: Sequence[float], e: Sequence[arb]) -> arb:
    """Return r of (14)."""
    coefficients = (*map(arb, reversed(lambdas)), arb(1))
    return sum((a * b for a, b in zip(coefficients, e, strict=True)), arb(0))


def initial_errors(roles: Roles, sides: Sides) -> tuple[arb, ...]:
    """Return e_1(0), ..., e_n(0) of a plant and a reference without states."""
    reference = roles.spec("reference")
    yd = reference.output(0.0, (), (), equation_arguments(reference))
    # the radius covers what double precision has lost in yd(0)
    return tuple(between(*x) - arb(float(y), 1e-12) for x, y in zip(sides, yd, strict=False))
