"""Sampled data: controllers on computers, next to plants in continuous time.

`clock` says when a block samples, `parameters` what may be varied of that, `system` makes a sampled
block of one in discrete time, and `discretised` one in discrete time of one in continuous time.
`triggered` samples at events.
"""

from .clock import Clock
from .discretised import discretise
from .parameters import Sampling
from .system import Sampled, sampled
from .triggered import TriggeredHold

__all__ = ["Clock", "Sampled", "Sampling", "TriggeredHold", "discretise", "sampled"]
