"""What requirements always ask of signals, as lines for figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nlctl.plotting.bands import Limit

from .formula import Always, And, Band, Formula


def limits_of_requirements(requirements: Sequence[Any]) -> dict[str, list[Limit]]:
    """Return what requirements always ask of each signal; what they ask else is not a line."""
    limits: dict[str, list[Limit]] = {}

    def walk(formula: Formula, start: float, end: float, until: float) -> None:
        if isinstance(formula, And):
            for part in formula.parts:
                walk(part, start, end, until)
        elif isinstance(formula, Always):
            walk(formula.part, start + formula.start, end + formula.end, until)
        elif isinstance(formula, Band) and end > start:
            for value in (formula.lower, formula.upper):
                line = (value, start, min(end, until))
                if np.isfinite(value) and line not in limits.setdefault(formula.signal, []):
                    limits[formula.signal].append(line)

    for requirement in requirements:
        walk(requirement.formula, 0.0, 0.0, requirement.until)
    return limits
