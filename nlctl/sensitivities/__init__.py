"""Derivatives of runs by parameters and initial states.

`names` looks up of what and by what, `schedule` makes room for them in a diagram's, `source` has
its equations in parts, `branches` and `sides` are about jumps, `saltation` about derivatives there,
at `moving_times`, also of jumps that come back through delays, `ends` about memories that are
touched at theirs, `program` puts all of that together, `response` integrates it, and `missing` says
where there is no derivative. `gradients` are those of metrics and margins, `fitting` finds
parameters from data that `measured` reads; `tuning` finds gains for requirements: `worth` makes its
runs, `tuned` is what it returns.
"""

from .fitting import fit
from .gradients import MetricGradient, metric_gradient
from .measured import Fit, FittedExperiment, Measurement
from .record import NoDerivative, SensitivityResponse
from .response import sensitivity_response
from .tuned import Tuned
from .tuning import tune

__all__ = [
    "Fit",
    "FittedExperiment",
    "Measurement",
    "MetricGradient",
    "NoDerivative",
    "SensitivityResponse",
    "Tuned",
    "fit",
    "metric_gradient",
    "sensitivity_response",
    "tune",
]
