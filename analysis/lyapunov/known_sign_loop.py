"""Reading a loop with `nlctl.KnownSignLaw`: what its certificate is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flint import arb

from nlctl._diagram import initial_state, leaves, state_names
from nlctl._errors import DiagramError
from nlctl._param import equation_arguments
from nlctl.controllers import AdaptiveWeights, FilteredError, KnownSignLaw, RobustTerm, Zero
from nlctl.references import SumOfSines

from .parts import Parts, read_parts

__all__ = ["KnownSignLoop", "read_loop"]

PROVED_FOR = {
    "reference": (SumOfSines,),
    "filtered_error": (FilteredError,),
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
    """

    parts: Parts
    reference: SumOfSines
    e0: tuple[arb, ...]

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


def read_loop(loop: Any, params: Mapping[str, Any] | None = None) -> KnownSignLoop:
    """Read a loop that is made of the paper's blocks and `nlctl.KnownSignLaw`.

    Parameters
    ----------
    loop : control.InterconnectedSystem
    params : mapping, optional
        Overrides by qualified name, as in a run.

    Raises
    ------
    DiagramError
        If a block is missing, or is none of those that the proof is about.
    """
    parts = read_parts(loop, params=params)
    specs = {leaf.path: getattr(leaf.system, "current_spec", None) for leaf in leaves(loop)}
    for part, kinds in PROVED_FOR.items():
        spec = specs[parts.paths[part]]
        if type(spec) not in kinds:
            wanted = " or ".join(kind.__name__ for kind in kinds)
            raise DiagramError(
                f"the certificate is about a {wanted} in the place of '{parts.paths[part]}', "
                f"got {type(spec).__name__}: put one there"
            )
    reference: Any = specs[parts.paths["reference"]]
    yd = reference.output(0.0, (), (), equation_arguments(reference))
    x0 = dict(zip(state_names(loop), initial_state(loop), strict=True))
    plant = [float(x0[f"{parts.paths['plant']}.{name}"]) for name in parts.plant.states]
    # the radius covers what double precision has lost in yd(0)
    e0 = tuple(arb(x) - arb(float(y), 1e-12) for x, y in zip(plant, yd, strict=False))
    return KnownSignLoop(parts=parts, reference=reference, e0=e0)
