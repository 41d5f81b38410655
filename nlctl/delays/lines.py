"""The transport delays of a diagram."""

from __future__ import annotations

from ..blocks import Block, supplied_of
from ..diagrams import continuous_blocks
from ..upstream.systems import System
from .transport import PAST


def is_delayed(system: System) -> bool:
    """Whether a block's outputs are its inputs at earlier times."""
    return supplied_of(system) is PAST


def delayed_blocks(system: System) -> list[Block]:
    """Return the transport delays of a diagram, in the order of its blocks."""
    return continuous_blocks(system, is_delayed, f"needs continuous time: {PAST.discrete}", "past")
