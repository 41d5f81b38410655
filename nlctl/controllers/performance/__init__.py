"""Control inside of a bound that is given in advance: prescribed performance, funnel control."""

from .funnel import FunnelControl
from .prescribed import PrescribedPerformance

__all__ = ["FunnelControl", "PrescribedPerformance"]
