"""Sampled data: controllers on computers, beside plants in continuous time.

`clock` says when a block samples, `system` makes a sampled block of one in discrete time, and
`discretised` one in discrete time of one in continuous time.
"""

from .clock import Clock
from .discretised import discretise
from .system import Sampled, sampled

__all__ = ["Clock", "Sampled", "discretise", "sampled"]
