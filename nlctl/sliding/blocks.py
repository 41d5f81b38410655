"""The ideal relays of a diagram."""

from __future__ import annotations

from typing import Any

from ..blocks import Block, slides
from ..diagrams import continuous_blocks

_WHY = (
    "slides in continuous time only: sampled it switches once a sample, as a block that returns "
    "np.sign(u) does"
)


def sliding_blocks(system: Any) -> list[Block]:
    """Return the ideal relays of a diagram, in the order of its blocks.

    Raises
    ------
    DiagramError
        If one is in discrete time, is sampled, or stands in the diagram twice.
    """
    return continuous_blocks(system, slides, _WHY, "output")
