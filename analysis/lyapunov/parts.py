"""Reading the blocks of a closed loop that the proof is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from nlctl._diagram import initial_state
from nlctl._errors import DiagramError
from nlctl.controllers import AdaptiveWeights, KnownSignLaw, MonotoneNussbaumLaw

from .final_bound import Gains
from .roles import Roles, read_roles

__all__ = ["Parts", "read_parts"]

DAMPED = (KnownSignLaw, MonotoneNussbaumLaw)  # laws with eta = beta r + s tanh(r s / b)


@dataclass(frozen=True, kw_only=True)
class Parts:
    """The records of a loop, by the part that they play in the proof.

    Attributes
    ----------
    plant, actuator, filtered_error, robust, law : record
        With the parameters of the run.
    basis, weights : record or None
        None where `nlctl.Zero` stands in the place of the network.
    roles : Roles
        Places of the blocks in the diagram.
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
    roles: Roles
    gains: Gains

    @property
    def paths(self) -> dict[str, str]:
        """Path of every block in the diagram, by part."""
        return self.roles.paths

    @property
    def order(self) -> int:
        """Order n of the plant."""
        return len(self.plant.states)


def read_parts(
    loop: ct.InterconnectedSystem,
    start: Mapping[str, float] | None = None,
    params: Mapping[str, Any] | None = None,
    inputs: bool = False,
) -> Parts:
    """Read plant, actuator and controller pieces of a loop such as `nlctl.paper.example_1`.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        With the output r.
    start : mapping, optional
        Initial states other than the blocks' own, ``{"plant.x1": 0.8}``.
    params : mapping, optional
        Qualified parameters other than the blocks' own.
    inputs : bool, optional
        Whether external inputs may be added to the plant's v.

    Raises
    ------
    DiagramError
        As `analysis.lyapunov.roles.read_roles` does, or if there are external inputs.
    """
    roles = read_roles(loop)
    if roles.disturbances and not inputs:
        names = ", ".join(f"'{name}'" for name in roles.disturbances)
        raise DiagramError(
            f"external input {names} is added to the plant's v: the proof needs its bound, and "
            "takes one in certify(loop, inputs={...}) only"
        )
    loop._update_params(dict(params or {}))
    specs = {part: roles.spec(part) for part in roles.places}
    x0 = initial_state(loop, start)
    own = {p: x0[f.state_offset :][: f.system.nstates or 0] for p, f in roles.places.items()}
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
        b=specs["law"].b if isinstance(specs["law"], DAMPED) else 0.0,
    )
    return Parts(
        plant=specs["plant"],
        actuator=specs["actuator"],
        filtered_error=specs["filtered_error"],
        robust=specs["robust"],
        law=specs["law"],
        basis=specs.get("basis") if weights else None,
        weights=weights,
        roles=roles,
        gains=gains,
    )
