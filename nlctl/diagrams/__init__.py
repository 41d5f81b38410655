"""Diagrams: connecting blocks by signal name, and addressing what is inside."""

from .connecting import as_system, interconnect
from .connecting import reconnected as reconnected
from .parameters import all_parameter_rows as all_parameter_rows
from .parameters import check_read as check_read
from .parameters import overridden, parameters
from .parameters import override as override
from .parameters import parameter_names as parameter_names
from .parameters import samplings as samplings
from .places import Place, initial_state, leaves, state_names
from .places import known_system as known_system
from .places import not_a_system as not_a_system
from .places import places as places
from .places import supplied_blocks as supplied_blocks
from .third_party import Apart as Apart
from .third_party import apart as apart

__all__ = ["Place", "as_system", "initial_state", "interconnect", "leaves", "overridden"]
__all__ += ["parameters", "state_names"]
