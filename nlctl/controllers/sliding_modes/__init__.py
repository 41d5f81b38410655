"""Sliding mode control: a law that switches across a boundary layer, and a continuous one."""

from .boundary_layer import SlidingModeLaw, SuperTwistingLaw, sliding_mode

__all__ = ["SlidingModeLaw", "SuperTwistingLaw", "sliding_mode"]
