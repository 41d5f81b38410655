"""How far, how often and for how long a signal moves, by straight lines between samples.

With `breaks`, the times (s) of kinks and jumps, it moves as `curves.path` does: on curves between
them, and at once where it jumps.
"""

from __future__ import annotations

import numpy as np

from .curves import path
from .integrals import consecutive_differences
from .samples import of_samples

__all__ = ["reversals", "settling_time", "time_within", "total_variation"]


@of_samples
def total_variation(t: np.ndarray, y: np.ndarray, breaks: np.ndarray | None = None):
    """Sum of |y_{i+1} - y_i|, the way that y travels; between samples it is a lower bound.

    Returns
    -------
    float
        In the unit of y.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import total_variation
    >>> total_variation(np.arange(4.0), np.array([0.0, 2.0, 1.0, 1.0]))
    3.0
    """
    if breaks is not None and np.all(np.isfinite(y)):
        t, y = path(t, y, np.asarray(breaks))
    return float(np.sum(np.abs(consecutive_differences(y))))


@of_samples
def settling_time(t: np.ndarray, y: np.ndarray, band: float, breaks: np.ndarray | None = None):
    """Time after the first sample from which on |y| <= band, by a line between samples.

    Infinite where the last sample lies outside: the response has not settled.

    Parameters
    ----------
    band : float
        Largest |y| that counts as settled, in the unit of y.

    Returns
    -------
    float
        Time (s) after the first sample; inf where y has not settled, NaN where a sample is not
        finite.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import settling_time
    >>> t = np.linspace(0.0, 5.0, 5001)
    >>> print(round(settling_time(t, np.exp(-t), 0.05), 4), round(np.log(20), 4))
    2.9957 2.9957
    """
    if not np.all(np.isfinite(y)):
        return np.nan
    if breaks is not None:
        t, y = path(t, y, np.asarray(breaks))
    outside = np.nonzero(np.abs(y) > band)[0]
    if outside.size == 0:
        return 0.0
    i = outside[-1]
    if i == y.size - 1:
        return np.inf
    edge = band if y[i] > 0 else -band
    return float(t[i] - t[0] + (t[i + 1] - t[i]) * (edge - y[i]) / (y[i + 1] - y[i]))


@of_samples
def time_within(
    t: np.ndarray, y: np.ndarray, lower: float, upper: float, breaks: np.ndarray | None = None
):
    """Time (s) that y spends in [lower, upper], by lines between samples.

    With the break points of a dead zone it is the time in which its input has no effect; the same
    for the output v of a dead zone and lower = upper = 0, where the break points are uncertain.

    Parameters
    ----------
    lower, upper : float
        The interval, in the unit of y.

    Returns
    -------
    float
        Time (s); NaN where a sample is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import time_within
    >>> time_within(np.array([0.0, 1.0]), np.array([-1.0, 1.0]), -0.5, 0.25)
    0.375
    """
    if not np.all(np.isfinite(y)):
        return np.nan
    if breaks is not None:
        t, y = path(t, y, np.asarray(breaks))
    low, high = np.minimum(y[:-1], y[1:]), np.maximum(y[:-1], y[1:])
    inside = np.minimum(high, upper) - np.maximum(low, lower)  # negative: none of the interval
    span = high - low
    level = span == 0
    share = np.maximum(inside, 0.0) / (span + level) + (level & (inside >= 0))
    return float(np.sum(consecutive_differences(t) * share))


@of_samples
def reversals(t: np.ndarray, y: np.ndarray, above: float = 0.0, breaks: np.ndarray | None = None):
    """How often y reverses: the turns between swings of more than `above`.

    Parameters
    ----------
    above : float, optional
        Swings up to this size (in the unit of y) do not count.

    Returns
    -------
    float
        A count; NaN where a sample is not finite.

    Examples
    --------
    Swings of 0.1 on the way do not count as reversals here:

    >>> import numpy as np
    >>> from nlctl.analysis.metrics import reversals
    >>> y = np.array([0.0, 1.0, 0.9, 2.0, 0.0])
    >>> reversals(np.arange(5.0), y), reversals(np.arange(5.0), y, 0.2)
    (3.0, 1.0)
    """
    if not np.all(np.isfinite(y)):
        return np.nan
    if breaks is not None:
        t, y = path(t, y, np.asarray(breaks))
    steps = consecutive_differences(y)
    moving = np.nonzero(steps)[0]
    up = steps[moving] > 0
    turns = y[moving[:-1][up[1:] != up[:-1]] + 1]
    count, direction = 0.0, 0
    low = high = y[0]
    for value in np.concatenate((turns, y[-1:])):
        low, high = min(low, value), max(high, value)
        if direction <= 0 and value - low > above:
            count += direction < 0
            direction, high = 1, value
        elif direction >= 0 and high - value > above:
            count += direction > 0
            direction, low = -1, value
    return count
