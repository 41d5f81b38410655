"""Transport delays: signals that arrive later than they were sent.

`transport` is the block, `lines` finds the delays of a diagram and cuts it there, and `history`
holds what a signal was before a run.
"""

from .transport import TransportDelay

__all__ = ["TransportDelay"]
