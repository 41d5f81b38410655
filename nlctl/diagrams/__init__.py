"""Diagrams: connecting blocks by signal name, and addressing what is inside."""

from .connecting import as_system, interconnect, reconnected
from .parameters import (
    all_parameter_rows,
    check_read,
    overridden,
    override,
    parameter_names,
    parameters,
    samplings,
)
from .places import (
    Place,
    initial_state,
    known_system,
    leaves,
    not_a_system,
    places,
    state_names,
    supplied_blocks,
)
from .third_party import Apart, apart

__all__ = [
    "Apart",
    "Place",
    "all_parameter_rows",
    "apart",
    "as_system",
    "check_read",
    "initial_state",
    "interconnect",
    "known_system",
    "leaves",
    "not_a_system",
    "overridden",
    "override",
    "parameter_names",
    "parameters",
    "places",
    "reconnected",
    "samplings",
    "state_names",
    "supplied_blocks",
]
