"""Bounds that hold for all time: the loop with a known sign of the control direction."""
