"""Reading the blocks of a closed loop that the proof is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from nlctl._block import Block
from nlctl._diagram import initial_state, leaves
from nlctl._errors import DiagramError
from nlctl.controllers import AdaptiveWeights

from .final_bound import Gains

__all__ = ["Parts", "read_parts"]

# A block is known by a signal that it delivers, and by what the proof reads of its record.
PIECES = {
    "reference": ("yd", ()),
    "plant": ("y", ("f", "d")),
    "actuator": ("v", ()),
    "filtered_error": ("r", ("lambdas",)),
    "basis": ("psi[0]", ("centres",)),
    "weights": ("W_psi", ()),
    "robust": ("robust", ("gamma", "sigma_2", "tau")),
    "law": ("u", ("beta",)),
}


@dataclass(frozen=True, kw_only=True)
class Parts:
    """The records of a loop, by the part that they play in the proof.

    Attributes
    ----------
    plant, actuator, filtered_error, robust, law : record
        With the parameters of the run.
    basis, weights : record or None
        None where `nlctl.Zero` stands in the place of the network.
    paths : dict
        Path of every block in the diagram, by part.
    gains : Gains
        Gains and initial values of the controller.
    """

    plant: Any
    actuator: Any
    filtered_error: Any
    robust: Any
    law: Any
    basis: Any
    weights: Any
    paths: dict[str, str]
    gains: Gains

    @property
    def order(self) -> int:
        """Order n of the plant."""
        return len(self.plant.states)


def read_parts(
    loop: ct.InterconnectedSystem,
    start: Mapping[str, float] | None = None,
    params: Mapping[str, Any] | None = None,
) -> Parts:
    """Read plant, actuator and controller pieces of a loop such as `nlctl.paper.example_1`.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        With the output r, without external inputs.
    start : mapping, optional
        Initial states other than the blocks' own, ``{"plant.x1": 0.8}``.
    params : mapping, optional
        Qualified parameters other than the blocks' own.

    Raises
    ------
    DiagramError
        If a part is missing, is no nlctl block, lacks a parameter that the proof needs, or if
        there is a block that the proof does not know, such as a sensor.
    """
    if not isinstance(loop, ct.InterconnectedSystem) or "r" not in loop.output_labels:
        raise DiagramError("the proof needs a closed loop, a diagram with the output r")
    loop._update_params(dict(params or {}))
    found = _found(loop)
    specs = {part: leaf.system.current_spec for part, leaf in found.items() if part != "reference"}
    x0 = initial_state(loop, start)
    own = {part: x0[f.state_offset :][: f.system.nstates or 0] for part, f in found.items()}
    outputs = np.asarray(loop.output(0.0, x0, np.zeros(loop.ninputs or 0), dict(params or {})))
    weights = specs["weights"] if isinstance(specs["weights"], AdaptiveWeights) else None
    gains = Gains(
        beta=specs["law"].beta,
        Gamma=weights.Gamma if weights else 1.0,
        sigma_1=weights.sigma_1 if weights else 0.0,
        gamma=specs["robust"].gamma,
        sigma_2=specs["robust"].sigma_2,
        tau=specs["robust"].tau,
        r_0=float(outputs[loop.output_labels.index("r")]),
        delta_hat_0=float(own["robust"][0]),
        W_hat_0=tuple(map(float, own["weights"])) if weights else (),
    )
    return Parts(
        plant=specs["plant"],
        actuator=specs["actuator"],
        filtered_error=specs["filtered_error"],
        robust=specs["robust"],
        law=specs["law"],
        basis=specs.get("basis") if weights else None,
        weights=weights,
        paths={part: leaf.path for part, leaf in found.items()},
        gains=gains,
    )


def _found(loop: ct.InterconnectedSystem) -> dict[str, Any]:
    """Return the block of every part."""
    found: dict[str, Any] = {}
    for leaf in leaves(loop):
        labels = leaf.system.output_labels
        part = next((p for p, (signal, _) in PIECES.items() if signal in labels), None)
        if part is None or part in found:
            raise DiagramError(
                f"the proof does not know what block '{leaf.path}' ({', '.join(labels)}) is for: "
                "it is about a plant, an actuator, a reference and the paper's controller only"
            )
        found[part] = leaf
    for part, (signal, needed) in PIECES.items():
        if part not in found:
            if part == "basis" and not isinstance(_spec(found.get("weights")), AdaptiveWeights):
                continue
            raise DiagramError(f"the proof needs a block that delivers '{signal}' ({part})")
        spec = _spec(found[part])
        if part != "reference" and spec is None:
            raise DiagramError(
                f"the proof reads the record of '{found[part].path}', which is no nlctl block"
            )
        missing = [name for name in needed if not hasattr(spec, name)]
        if missing:
            raise DiagramError(
                f"the proof needs {', '.join(missing)} of block '{found[part].path}', and "
                f"{type(spec).__name__} has no such thing"
            )
    return found


def _spec(leaf: Any) -> Any:
    """The record of a leaf with the parameters of the run; None for a foreign block."""
    return leaf.system.current_spec if leaf and isinstance(leaf.system, Block) else None
