"""Results -> matplotlib figures.  Nothing here writes a file or shows a window."""

from .faults import fault_margins, fault_pairs
from .proof import (
    bounds,
    burst,
    envelope,
    equality_residuals,
    inequality_margins,
    long_zeta,
    lyapunov_bound,
    story,
)
from .rankings import paired_differences, screening, set_apart, shares, violation_rates
from .runs import CLIP, LIMIT, Limit, fans, margins, most_frequent, quantile, running_estimate
from .searches import degradation, deviations, failure_map, radius_steps, search

__all__ = [
    "CLIP",
    "LIMIT",
    "Limit",
    "bounds",
    "burst",
    "degradation",
    "deviations",
    "envelope",
    "equality_residuals",
    "failure_map",
    "fans",
    "fault_margins",
    "fault_pairs",
    "inequality_margins",
    "long_zeta",
    "lyapunov_bound",
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
    "story",
    "violation_rates",
]
