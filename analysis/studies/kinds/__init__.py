"""The kinds of analysis that a study may ask for, one module each; this is the list of them."""

from .compare import COMPARE
from .degradation import DEGRADATION
from .failure_map import FAILURE_MAP
from .faults import FAULTS
from .morris import MORRIS
from .probability import PROBABILITY
from .radius import RADIUS
from .regional import REGIONAL
from .sequential import SEQUENTIAL
from .sobol import SOBOL
from .tornado import TORNADO
from .tuning import GAIN_TUNING
from .worst_case import WORST_CASE

__all__ = ["KINDS"]

KINDS = (  # in the order of the report
    PROBABILITY,
    SEQUENTIAL,
    WORST_CASE,
    RADIUS,
    DEGRADATION,
    TORNADO,
    MORRIS,
    SOBOL,
    REGIONAL,
    FAILURE_MAP,
    FAULTS,
    COMPARE,
    GAIN_TUNING,
)
