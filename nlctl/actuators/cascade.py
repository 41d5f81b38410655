"""Actuators one after the other."""

from collections.abc import Mapping
from typing import Any

import control as ct

from ..annotations import as_annotated
from ..diagrams import as_system, interconnect
from ..errors import DiagramError


@as_annotated
def cascade(stages: Mapping[str, Any], *, name: str = "actuator") -> ct.InterconnectedSystem:
    """Join actuators in series: the output v of each is the input u of the next.

    Parameters
    ----------
    stages : mapping
        ``{"limit": Saturation(), "dead_zone": DeadZone()}``, in the order of the signal flow;
        each has the input u and the output v.  Parameters are then
        ``"actuator.dead_zone.b_r"``.
    name : str, optional
        Name of the diagram, in front of its parameters' names.

    Returns
    -------
    control.InterconnectedSystem
        From u to v; it replaces an actuator.

    Raises
    ------
    DiagramError
        If there is no stage, or one has other signals.

    Examples
    --------
    >>> actuator = cascade({"limit": nlctl.Saturation(limit=2), "inverted": nlctl.Gain(k=-1)})
    >>> print(actuator.output(0, [], [3.0]))
    [-2.]
    """
    if not isinstance(stages, Mapping):
        raise DiagramError(
            f"cascade needs stages with their names, {{'limit': ...}}, got {type(stages).__name__}"
        )
    systems, last = [], len(stages) - 1
    for i, (key, stage) in enumerate(stages.items()):
        system = as_system(stage, key).copy(name=key)
        if (system.input_labels, system.output_labels) != (["u"], ["v"]):
            raise DiagramError(
                f"cascade needs stages from u to v, '{key}' goes from "
                f"{system.input_labels} to {system.output_labels}"
            )
        system.update_names(
            inputs=[f"v{i}" if i else "u"], outputs=["v" if i == last else f"v{i + 1}"]
        )
        systems.append(system)
    if not systems:
        raise DiagramError("cascade needs at least one stage, got none")
    return interconnect(systems, inputs=["u"], outputs=["v"], name=name)
