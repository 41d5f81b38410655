"""When a requirement is violated: not by how much, but since which time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .formula import Always, And, Formula, SampledSignals, horizon, margin_trace
from .spec import Requirement, checked_breaks, margin


@dataclass(frozen=True, kw_only=True)
class ViolationTime:
    """The time to the violation of a requirement, as a metric of a run that reached its end."""

    requirement: Requirement

    start = -np.inf
    end = np.inf
    unit = "s"

    @property
    def key(self) -> str:
        """Name of its column."""
        return f"{self.requirement.key} violated at"

    @property
    def meaning(self) -> str:
        """In words, for the report."""
        return f"time at which '{self.requirement.key}' is violated, inf where it is not"

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that it looks at."""
        return self.requirement.signals

    def function(
        self, t: np.ndarray, *samples: np.ndarray, breaks: ArrayLike | None = None
    ) -> float:
        """Return the time, with the samples in the order of `signals`."""
        named = dict(zip(self.signals, samples, strict=True))
        return violation_time(self.requirement, t, named, breaks=breaks)


def violation_time(
    requirement: Requirement,
    t: np.ndarray,
    signals: Mapping[str, np.ndarray],
    *,
    breaks: ArrayLike | None = None,
) -> float:
    """Return the first time in s at which a response violates a requirement; inf if it does not."""
    # Of ``always`` it is the first time at which what should hold does not, with the signals linear
    # between their samples; of what is asked once, ``eventually``, the time ``until`` which the
    # requirement looks. A response that ended before is violated at its last good time, if it was
    # not earlier.
    # Shapes: `t` (m,), `breaks` (k,).
    rows = np.array([t, *(signals[name] for name in requirement.signals)], dtype=float)
    good = np.all(np.isfinite(rows), axis=0)
    count = rows.shape[1] if good.all() else int(np.argmin(good))
    if count < 2:
        return 0.0
    t, *samples = rows[:, :count]
    sampled = dict(zip(requirement.signals, samples, strict=True))
    until = min(requirement.until, float(t[-1]))
    is_short = until < requirement.until * (1 - 1e-12)
    first = _first(requirement.formula, SampledSignals(t, sampled, until, checked_breaks(breaks)))
    if not is_short and margin(requirement, t, sampled, breaks=breaks) > 0:
        return np.inf
    return min(first, until)


def _first(formula: Formula, signals: SampledSignals) -> float:
    """Return when something that should always hold does not, inf where nothing says so."""
    if isinstance(formula, And):
        return min(_first(part, signals) for part in formula.parts)
    if not isinstance(formula, Always):
        return np.inf
    last = min(formula.end, signals.until - horizon(formula.part))
    if last < formula.start:
        return np.inf
    inner = margin_trace(formula.part, signals, formula.start, last)
    bad = np.flatnonzero(~(inner.y > 0))
    if not bad.size:
        return np.inf
    i = int(bad[0])
    if i == 0:
        return float(inner.t[0])
    before, after = inner.y[i - 1], inner.y[i]
    return float(inner.t[i - 1] + (inner.t[i] - inner.t[i - 1]) * before / (before - after))
