"""Numbers of a response: one function, one number, with unit and meaning.

Every function takes sample times and samples; peaks between samples are found by a parabola.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import simpson

__all__ = ["Metric", "final", "highest", "lowest", "over", "peak", "rms"]


@dataclass(frozen=True, kw_only=True)
class Metric:
    """A named number of one signal.

    Attributes
    ----------
    key : str
        Short name for tables and files.
    signal : str
        Signal of the response that it is computed from.
    unit, meaning : str
        Shown wherever the number is.
    function : callable
        ``function(t, y) -> float``.
    start, end : float
        Interval of time (s) that counts.
    """

    key: str
    signal: str
    unit: str
    meaning: str
    function: Callable[[np.ndarray, np.ndarray], float]
    start: float = 0.0
    end: float = np.inf


def over(t: np.ndarray, y: np.ndarray, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples with start <= t <= end.

    Raises
    ------
    ValueError
        If fewer than three samples are left.
    """
    inside = (t >= start) & (t <= end)
    if np.count_nonzero(inside) < 3:
        raise ValueError(
            f"a metric over [{start:g}, {end:g}] s needs at least 3 samples there, "
            f"got {np.count_nonzero(inside)} (the response covers [{t[0]:g}, {t[-1]:g}] s)"
        )
    return t[inside], y[inside]


def highest(t: np.ndarray, y: np.ndarray) -> float:
    """Largest value of y, between samples by the parabola through the largest and its neighbours.

    Its error is of third order in the sampling interval for smooth y (fourth on uniform samples).
    """
    if not np.all(np.isfinite(y)):
        return float(np.max(y))  # NaN and inf stay what they are
    i = int(np.argmax(y))
    if i in (0, y.size - 1):
        return float(y[i])
    s, w = t[i - 1 : i + 2] - t[i], y[i - 1 : i + 2]
    a, b, c = np.linalg.solve(np.vander(s, 3), w)
    return float(max(y[i], c - b * b / (4 * a))) if a < 0 else float(y[i])


def lowest(t: np.ndarray, y: np.ndarray) -> float:
    """Smallest value of y, see `highest`."""
    return -highest(t, -y)


def peak(t: np.ndarray, y: np.ndarray) -> float:
    """Largest magnitude max |y|, see `highest`."""
    return float(np.maximum(highest(t, y), highest(t, -y)))


def rms(t: np.ndarray, y: np.ndarray) -> float:
    """Root mean square over time, by Simpson's rule."""
    return float(np.sqrt(simpson(y * y, x=t) / (t[-1] - t[0])))


def final(t: np.ndarray, y: np.ndarray) -> float:
    """Value at the last sample."""
    return float(y[-1])
