"""What is only about Lv et al. (2017): its reproduction, loops, controllers, page."""

from .cases import CASES, HORIZON, METRICS, TAIL, Case
from .controllers import contenders
from .numerics import numerics
from .reproduction import (
    Check,
    Expectation,
    Run,
    checks,
    compile_ahead,
    expectations,
    measured,
    run,
    run_all,
    sample_times,
)

__all__ = [
    "CASES",
    "HORIZON",
    "METRICS",
    "TAIL",
    "Case",
    "Check",
    "Expectation",
    "Run",
    "checks",
    "compile_ahead",
    "contenders",
    "expectations",
    "measured",
    "numerics",
    "run",
    "run_all",
    "sample_times",
]
