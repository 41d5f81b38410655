"""Results of robustness studies -> matplotlib figures.  Nothing here writes a file or shows one."""

from .rankings import paired_differences, screening, set_apart, shares, violation_rates
from .runs import CLIP, LIMIT, Limit, fans, margins, most_frequent, quantile, running_estimate
from .searches import degradation, deviations, failure_map, radius_steps, search

__all__ = [
    "CLIP",
    "LIMIT",
    "Limit",
    "degradation",
    "deviations",
    "failure_map",
    "fans",
    "margins",
    "most_frequent",
    "paired_differences",
    "quantile",
    "radius_steps",
    "running_estimate",
    "screening",
    "search",
    "set_apart",
    "shares",
    "violation_rates",
]
