"""Searches for violations: the worst case, the radius, where a spec fails."""
