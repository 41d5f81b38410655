"""How a forecast of the slow drift ended: held, failed, or open."""

from __future__ import annotations

from typing import Literal

import numpy as np

from .slow_drift import SlowDrift

Outcome = Literal["held", "failed", "open"]
REST_TOLERANCE = 0.01  # how far from the place that was forecast zeta may come to rest
_STILL = 0.1  # share of it by which zeta may move from one window to the next, at rest


def outcome(forecast: SlowDrift, time: np.ndarray, zeta: np.ndarray) -> Outcome:
    """Tell whether a run bore a forecast out.

    Shapes: `time` (m,), `zeta` (m,).
    """
    beyond = np.flatnonzero(zeta >= forecast.lobe.high)
    if forecast.rest is not None:
        return "failed" if beyond.size else _rest(forecast, forecast.rest, time, zeta)
    first, last = forecast.burst_range
    if not np.isfinite(forecast.burst):
        return "failed" if beyond.size else "open"
    if beyond.size:
        return "held" if first <= time[beyond[0]] <= last else "failed"
    return "failed" if time[-1] > last else "open"


def _rest(forecast: SlowDrift, place: float, time: np.ndarray, zeta: np.ndarray) -> Outcome:
    ends = time[-1] - forecast.window * np.arange(3)
    if not ends[-1] >= forecast.time:
        return "open"
    late, before = (
        float(np.mean(zeta[(time > a) & (time <= b)])) for a, b in ((ends[1], ends[0]), ends[:0:-1])
    )
    if late > place + REST_TOLERANCE:
        return "failed"
    still = abs(late - before) <= _STILL * REST_TOLERANCE
    return "held" if still and abs(late - place) <= REST_TOLERANCE else "open"
