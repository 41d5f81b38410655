"""Integrals of a signal over time, by Simpson's rule on any samples."""

from __future__ import annotations

import numpy as np

from .samples import of_samples

__all__ = [
    "absolute_integral",
    "consecutive_differences",
    "integral",
    "rms",
    "square_integral",
    "time_weighted_integral",
]


@of_samples
def consecutive_differences(y: np.ndarray):
    """Return y_{i+1} - y_i, as `numpy.diff` does, which takes seconds to compile.

    Returns
    -------
    ndarray, shape (n - 1,)
        In the unit of y.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import consecutive_differences
    >>> print(consecutive_differences(np.array([1.0, 4.0, 9.0])))
    [3. 5.]
    """
    return y[1:] - y[:-1]


@of_samples
def integral(t: np.ndarray, y: np.ndarray):
    """Integral of y by the composite Simpson rule on any samples, exact for parabolas.

    Of an odd number of intervals the last takes the parabola through the last three samples, as
    in `scipy.integrate.simpson`.  Two samples are connected by a line.  Where neighbouring
    intervals differ by more than a factor of 2, weights may be negative.

    Returns
    -------
    float
        In the unit of y times s.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import integral
    >>> t = np.array([0.0, 0.3, 1.0])
    >>> round(integral(t, t**2), 12)  # exact for parabolas
    0.333333333333
    """
    h = consecutive_differences(t)
    if h.size == 1:
        return float(h[0] * (y[0] + y[1]) / 2)
    n = h.size - h.size % 2
    a, b = h[0:n:2], h[1:n:2]
    left, middle, right = y[0:n:2], y[1 : n + 1 : 2], y[2 : n + 1 : 2]
    weighted = (2 - b / a) * left + (a + b) ** 2 / (a * b) * middle + (2 - a / b) * right
    total = np.sum((a + b) / 6 * weighted)
    if h.size > n:
        p, q = h[-2], h[-1]
        total += (2 * q * q + 3 * p * q) / (6 * (p + q)) * y[-1]
        total += (q * q + 3 * p * q) / (6 * p) * y[-2] - q**3 / (6 * p * (p + q)) * y[-3]
    return float(total)


@of_samples
def rms(t: np.ndarray, y: np.ndarray):
    """Root mean square over time.

    Returns
    -------
    float
        In the unit of y.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import rms
    >>> t = np.linspace(0.0, 2 * np.pi, 1001)
    >>> print(round(rms(t, np.sin(t)), 6), round(np.sqrt(0.5), 6))
    0.707107 0.707107
    """
    return float(np.sqrt(integral(t, y * y) / (t[-1] - t[0])))


@of_samples
def absolute_integral(t: np.ndarray, y: np.ndarray):
    """Integral of |y| (IAE of an error); of second order where y changes sign.

    Returns
    -------
    float
        In the unit of y times s.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import absolute_integral
    >>> t = np.linspace(0.0, 1.0, 3)
    >>> absolute_integral(t, -2 * np.ones(3))
    2.0
    """
    return integral(t, np.abs(y))


@of_samples
def square_integral(t: np.ndarray, y: np.ndarray):
    """Integral of y^2: ISE of an error, energy of an input.

    Returns
    -------
    float
        In the unit of y squared times s.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import square_integral
    >>> t = np.linspace(0.0, 1.0, 3)
    >>> square_integral(t, -2 * np.ones(3))
    4.0
    """
    return integral(t, y * y)


@of_samples
def time_weighted_integral(t: np.ndarray, y: np.ndarray):
    """Integral of (t - t_0) |y| (ITAE of an error), time counted from the first sample t_0.

    Returns
    -------
    float
        In the unit of y times s squared.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import time_weighted_integral
    >>> t = np.linspace(1.0, 2.0, 3)
    >>> time_weighted_integral(t, -2 * np.ones(3))
    1.0
    """
    return integral(t, (t - t[0]) * np.abs(y))
