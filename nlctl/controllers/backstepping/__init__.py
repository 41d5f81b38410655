"""Backstepping without derivatives of virtual controls: dynamic surface control."""

from .dynamic_surface import DynamicSurface, dynamic_surface_control

__all__ = ["DynamicSurface", "dynamic_surface_control"]
