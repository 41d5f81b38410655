"""Sliding motion: the ideal relay, whose output at the jump follows from the whole diagram.

What the diagram's equations give it there is derived in `nlctl.native.sliding`.
"""

from .relay import IdealRelay

__all__ = ["IdealRelay"]
