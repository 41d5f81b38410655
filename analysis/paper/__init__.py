"""What is only about Lv et al. (2017): its reproduction, loops, controllers, page."""

from .cases import BOUND, CASES, HORIZON, METRICS, TAIL, Case, sample_times
from .controllers import compared_controllers
from .reproduction import Expectation, checks, expectations, numerics

__all__ = [
    "BOUND",
    "CASES",
    "HORIZON",
    "METRICS",
    "TAIL",
    "Case",
    "Expectation",
    "checks",
    "compared_controllers",
    "expectations",
    "numerics",
    "sample_times",
]
