"""A diagram with other blocks in the same places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import control as ct

from ..names import Parameters


def rebuilt(diagram: Any, change: Callable[[Any], Any], dt: Any) -> Any:
    """Return a diagram of changed blocks, connected as those of another one are.

    Parameters
    ----------
    diagram : control.InterconnectedSystem
        Nested to any depth; it stays as it is.
    change : callable
        Takes a block and returns one with the same inputs and outputs.
    dt : float
        Timebase of the result.
    """
    parts = [
        rebuilt(part, change, dt) if isinstance(part, ct.InterconnectedSystem) else change(part)
        for part in diagram.syslist
    ]
    made = ct.InterconnectedSystem(
        parts, inputs=list(diagram.input_labels), outputs=list(diagram.output_labels),
        name=diagram.name, dt=dt,
    )  # fmt: skip
    made.set_connect_map(diagram.connect_map.copy())
    made.set_input_map(diagram.input_map.copy())
    made.set_output_map(diagram.output_map.copy())
    if isinstance(made.params, Parameters) and diagram.params.scope is not None:
        made.params.scope = made
    return made
