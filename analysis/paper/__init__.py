"""What is only about Lv et al. (2017): its reproduction, loops, controllers, page."""

from .cases import BOUND, CASES, HORIZON, METRICS, TAIL, Case
from .controllers import compared_controllers
from .reproduction import (
    CaseRun,
    Check,
    Expectation,
    checks,
    compile_cases_ahead,
    expectations,
    measured,
    numerics,
    run_all,
    run_case,
    sample_times,
)

__all__ = [
    "BOUND",
    "CASES",
    "HORIZON",
    "METRICS",
    "TAIL",
    "Case",
    "CaseRun",
    "Check",
    "Expectation",
    "checks",
    "compared_controllers",
    "compile_cases_ahead",
    "expectations",
    "measured",
    "numerics",
    "run_all",
    "run_case",
    "sample_times",
]
