"""Derivatives of runs by parameters and initial states.

`names` looks up of what and by what, `schedule` makes room for them in a diagram's, `source` has
its equations in parts, `branches` and `sides` are about jumps, `saltation` about
derivatives there, `program` puts all of that together, `run` integrates it, and `missing` says
where there is no derivative.  `gradients` are those of metrics and margins, `fitting`
finds parameters from data, `tuning` gains for requirements: `worth` makes its runs, `tuned` is what
it returns.
"""

from .fitting import Fit, fit
from .gradients import MetricGradient, metric_gradient
from .record import NoDerivative, SensitivityResponse
from .response import sensitivity_response
from .tuned import Tuned
from .tuning import tune

__all__ = [
    "Fit",
    "MetricGradient",
    "NoDerivative",
    "SensitivityResponse",
    "Tuned",
    "fit",
    "metric_gradient",
    "sensitivity_response",
    "tune",
]
