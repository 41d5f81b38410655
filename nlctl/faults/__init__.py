"""Faults on any signal of any diagram: stuck, bias, drift, gain, noise, dropout, disconnection."""

from .cut import with_faults
from .effects import NEVER
from .fault import FAULT_KINDS, Fault

__all__ = ["FAULT_KINDS", "NEVER", "Fault", "with_faults"]
