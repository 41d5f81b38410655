"""The ideal relays of a diagram."""

from __future__ import annotations

from typing import Any

from ..blocks import Block, supplied_of
from ..diagrams import continuous_blocks
from .relay import SLIDING

_WHY = (
    "slides in continuous time only: sampled it switches once a sample, as a block that returns "
    "np.sign(u) does"
)


def slides(system: Any) -> bool:
    """Whether a block's equations ask for the rate that the diagram gives its input."""
    return supplied_of(system) is SLIDING


def sliding_blocks(system: Any) -> list[Block]:
    """Return the ideal relays of a diagram, in the order of its blocks."""
    return continuous_blocks(system, slides, _WHY, "output")
