"""Sliding mode control: a law that switches across a boundary layer, and a continuous one."""
