"""What is only about Lv et al. (2017): its reproduction, loops, controllers, page."""

from .controllers import compared_controllers
from .reproduction import (
    BOUND,
    CASES,
    HORIZON,
    METRICS,
    TAIL,
    Case,
    Expectation,
    checks,
    expectations,
    numerics,
    sample_times,
)

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
