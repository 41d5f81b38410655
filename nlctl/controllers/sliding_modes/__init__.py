"""Sliding mode control: a law that switches across a boundary layer, and a continuous one."""

from .boundary_layer import SlidingModeLaw, sliding_mode
from .super_twisting import SuperTwistingLaw

__all__ = ["SlidingModeLaw", "SuperTwistingLaw", "sliding_mode"]
