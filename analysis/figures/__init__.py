"""Results -> matplotlib figures.  Nothing here writes a file or shows a window."""

from .histories import (
    actuator_path,
    adaptation,
    control_input,
    error_comparison,
    nussbaum_gain,
    overview,
    tracking,
    tracking_error,
    upper_states,
)
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

__all__ = [
    "actuator_path",
    "adaptation",
    "bounds",
    "burst",
    "control_input",
    "envelope",
    "equality_residuals",
    "error_comparison",
    "inequality_margins",
    "long_zeta",
    "lyapunov_bound",
    "nussbaum_gain",
    "overview",
    "story",
    "tracking",
    "tracking_error",
    "upper_states",
]
