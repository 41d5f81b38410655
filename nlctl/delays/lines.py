"""The transport delays of a diagram."""

from __future__ import annotations

from typing import Any

from ..blocks import Block, is_delayed
from ..diagrams import continuous_blocks

_WHY = (
    "needs continuous time: in discrete time k samples late is ct.tf(1, [1] + [0] * k, dt), and "
    "nlctl.sampled has delay=..."
)


def delayed_blocks(system: Any) -> list[Block]:
    """Return the transport delays of a diagram, in the order of its blocks.

    Raises
    ------
    DiagramError
        If one is in discrete time, is sampled, or stands in the diagram twice.
    """
    return continuous_blocks(system, is_delayed, _WHY, "past")
