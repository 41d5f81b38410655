"""Backstepping without derivatives of virtual controls: dynamic surface control."""

from .connected import dynamic_surface_control
from .dynamic_surface import DynamicSurface

__all__ = ["DynamicSurface", "dynamic_surface_control"]
