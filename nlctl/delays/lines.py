"""The transport delays of a diagram."""

from __future__ import annotations

from typing import Any

import control as ct

from ..blocks import Block, is_delayed, within
from ..diagrams import leaves
from ..errors import DiagramError


def delayed_blocks(system: Any) -> list[Block]:
    """Return the transport delays of a diagram, in the order of its blocks.

    Raises
    ------
    DiagramError
        If one is in discrete time, is sampled, or stands in the diagram twice.
    """
    found: dict[int, Block] = {}
    for leaf in leaves(system):
        made = within(leaf.system)
        if not is_delayed(made):
            continue
        if made is not leaf.system or not ct.isctime(system) or made.dt not in (0, None):
            raise DiagramError(
                f"block '{leaf.path}' is a TransportDelay, which needs continuous time: in "
                "discrete time k samples late is ct.tf(1, [1] + [0] * k, dt), and nlctl.sampled "
                "has delay=..."
            )
        if id(made) in found:
            raise DiagramError(
                f"TransportDelay '{leaf.path}' stands in '{system.name}' twice, with one past for "
                "both: make a block of each"
            )
        found[id(made)] = made
    return list(found.values())
