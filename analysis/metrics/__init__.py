"""Numbers of a response: one function, one number, with unit and meaning."""

from nlctl.responses.breaks import breaks_of, sampled_between, with_breaks

from .compiled import in_machine_code
from .extremes import final, highest, lowest, peak, spread, ultimate_bound, vertex
from .integrals import (
    absolute_integral,
    consecutive_differences,
    integral,
    rms,
    square_integral,
    time_weighted_integral,
)
from .tracking import Metric, over, tracking_metrics
from .travel import reversals, settling_time, time_within, total_variation

__all__ = [
    "Metric",
    "absolute_integral",
    "breaks_of",
    "consecutive_differences",
    "final",
    "highest",
    "in_machine_code",
    "integral",
    "lowest",
    "over",
    "peak",
    "reversals",
    "rms",
    "sampled_between",
    "settling_time",
    "spread",
    "square_integral",
    "time_weighted_integral",
    "time_within",
    "total_variation",
    "tracking_metrics",
    "ultimate_bound",
    "vertex",
    "with_breaks",
]
