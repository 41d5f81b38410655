"""The blocks that come with nlctl."""

from __future__ import annotations

import dataclasses

from nlctl import actuators, controllers, plants, references
from nlctl.names import unknown


def block_records() -> dict[str, type]:
    """Return every block record of nlctl by name."""
    found = {}
    for module in (plants, actuators, references, controllers):
        for name in module.__all__:
            thing = getattr(module, name)
            if isinstance(thing, type) and dataclasses.is_dataclass(thing):
                found[name] = thing
    return found


def block_groups() -> dict[str, dict[str, type]]:
    """Return the block records by what they are for: plants, actuators, ..."""
    records = block_records()
    groups: dict[str, dict[str, type]] = {}
    for module in (plants, actuators, references, controllers):
        title = module.__name__.rpartition(".")[2]
        groups[title] = {name: records[name] for name in module.__all__ if name in records}
    return groups


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
