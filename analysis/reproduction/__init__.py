"""The reproduction of the paper: cases, runs, figures to reach."""

from .cases import CASES, HORIZON, METRICS, TAIL, Case
from .numerics import numerics
from .run import (
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
    "expectations",
    "measured",
    "numerics",
    "run",
    "run_all",
    "sample_times",
]
