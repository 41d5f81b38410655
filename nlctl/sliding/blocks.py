"""The ideal relays of a diagram."""

from __future__ import annotations

from typing import Any

import control as ct

from ..blocks import Block, slides, within
from ..diagrams import leaves
from ..errors import DiagramError


def sliding_blocks(system: Any) -> list[Block]:
    """Return the ideal relays of a diagram, in the order of its blocks.

    Raises
    ------
    DiagramError
        If one is in discrete time, is sampled, or stands in the diagram twice.
    """
    found: dict[int, Block] = {}
    for leaf in leaves(system):
        made = within(leaf.system)
        if not slides(made):
            continue
        if made is not leaf.system or not ct.isctime(system) or made.dt not in (0, None):
            raise DiagramError(
                f"block '{leaf.path}' is an IdealRelay, which slides in continuous time only: "
                "sampled it switches once a sample, as a block that returns np.sign(u) does"
            )
        if id(made) in found:
            raise DiagramError(
                f"IdealRelay '{leaf.path}' stands in '{system.name}' twice, with one output for "
                "both: make a block of each"
            )
        found[id(made)] = made
    return list(found.values())
