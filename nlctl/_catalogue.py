"""The blocks that come with nlctl."""

from __future__ import annotations

import dataclasses

from . import actuators, controllers, plants, references
from ._names import unknown


def block_records() -> dict[str, type]:
    """Return every block record of nlctl by name."""
    found = {}
    for module in (plants, actuators, references, controllers):
        for name in module.__all__:
            thing = getattr(module, name)
            if isinstance(thing, type) and dataclasses.is_dataclass(thing):
                found[name] = thing
    return found


def named_block(name: str) -> type:
    """Return the block record of that name.

    Raises
    ------
    UnknownNameError
        With the nearest ones.
    """
    records = block_records()
    if name not in records:
        raise unknown("block", name, records)
    return records[name]
