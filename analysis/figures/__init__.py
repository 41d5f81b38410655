"""Results -> matplotlib figures.  Nothing here writes a file or shows a window."""

from nlctl.plotting.bands import LIMIT, Limit, most_frequent, quantile

from .proof import (
    bounds,
    burst,
    equality_residuals,
    inequality_margins,
    long_zeta,
    lyapunov_bound,
    story,
    windowed_maximum,
)
from .rankings import (
    paired_differences,
    screening,
    set_apart,
    shares,
    tornado,
    trend,
    violation_rates,
)
from .runs import CLIP, fans, margins_figure, overlaid, running_estimate
from .searches import (
    bought,
    degradation,
    deviations,
    failure_map_figure,
    fault_margins,
    fault_pairs,
    margins_of_both,
    radius_steps,
    search,
    tried,
)

__all__ = [
    "CLIP",
    "LIMIT",
    "Limit",
    "bought",
    "bounds",
    "burst",
    "degradation",
    "deviations",
    "equality_residuals",
    "failure_map_figure",
    "fans",
    "fault_margins",
    "fault_pairs",
    "inequality_margins",
    "long_zeta",
    "lyapunov_bound",
    "margins_figure",
    "margins_of_both",
    "most_frequent",
    "overlaid",
    "paired_differences",
    "quantile",
    "radius_steps",
    "running_estimate",
    "screening",
    "search",
    "set_apart",
    "shares",
    "story",
    "tornado",
    "trend",
    "tried",
    "violation_rates",
    "windowed_maximum",
]
