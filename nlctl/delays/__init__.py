"""Transport delays: signals that arrive later than they were sent.

`transport` is the block, `variation` how its delay varies in time, as polynomials by `pieces`.
What runs keep of the signals is in `nlctl.native.histories` and `nlctl.reference.past`.
"""

from .transport import TransportDelay

__all__ = ["TransportDelay"]
