"""Largest and smallest values of a signal, between samples by a parabola.

A signal with NaN has the number NaN, or one that is not a finite number.
"""

from __future__ import annotations

import numpy as np

from nlctl.equations import equation

__all__ = [
    "final",
    "highest",
    "lowest",
    "peak",
    "spread",
    "ultimate_bound",
    "vertex",
]


@equation
def vertex(h_before, h_after, before, here, after):
    """Return where the parabola through three samples has its vertex, and its value there.

    Parameters
    ----------
    h_before, h_after : float or ndarray
        Distances (s) to the neighbours of the middle sample.
    before, here, after : float or ndarray
        The samples, not on a line.

    Returns
    -------
    offset, value : float or ndarray
        Offset (s) from the middle sample.

    Examples
    --------
    Of 1 - (t - 0.25)^2 at -1, 0 and 1:

    >>> from analysis.metrics import vertex
    >>> vertex(1.0, 1.0, 1 - 1.25**2, 1 - 0.25**2, 1 - 0.75**2)
    (0.25, 1.0)
    """
    d_before, d_after = (here - before) / h_before, (after - here) / h_after
    curvature = (d_after - d_before) / (h_before + h_after)  # half the second derivative
    slope = (d_before * h_after + d_after * h_before) / (h_before + h_after)
    offset = -slope / (2 * curvature)
    return offset, here + slope * offset / 2


@equation
def highest(t, y):
    """Largest value of y, between samples by the parabola through the largest and its neighbours.

    Its error is of third order in the sampling interval for smooth y (fourth on uniform samples).

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times (s), increasing.
    y : ndarray, shape (n,)
        Samples.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    The parabola between samples is found exactly:

    >>> import numpy as np
    >>> from analysis.metrics import highest
    >>> t = np.array([-1.0, 0.0, 1.0])
    >>> highest(t, 1 - (t - 0.25) ** 2)
    1.0
    """
    if not np.all(np.isfinite(y)):
        top = np.max(y)  # NaN and inf stay what they are, -inf is no calm maximum of the rest
        return np.nan if np.isfinite(top) else float(top)
    i = int(np.argmax(y))
    if i == 0 or i == y.size - 1 or y[i - 1] + y[i + 1] == 2 * y[i]:
        return float(y[i])
    top = vertex(t[i] - t[i - 1], t[i + 1] - t[i], y[i - 1], y[i], y[i + 1])[1]
    return float(top) if top > y[i] else float(y[i])  # rounding may have lost a flat parabola


@equation
def lowest(t, y):
    """Smallest value of y, see `highest`.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times (s), increasing.
    y : ndarray, shape (n,)
        Samples.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from analysis.metrics import lowest
    >>> t = np.array([-1.0, 0.0, 1.0])
    >>> lowest(t, (t - 0.25) ** 2 - 1)
    -1.0
    """
    return -highest(t, -y)


@equation
def spread(t, y):
    """Range of y, `highest` less `lowest`.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times (s), increasing.
    y : ndarray, shape (n,)
        Samples.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from analysis.metrics import spread
    >>> t = np.linspace(0.0, 2 * np.pi, 1001)
    >>> round(spread(t, 3 * np.sin(t)), 6)
    6.0
    """
    return highest(t, y) + highest(t, -y)


@equation
def peak(t, y):
    """Largest magnitude max |y|, see `highest`.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times (s), increasing.
    y : ndarray, shape (n,)
        Samples.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from analysis.metrics import peak
    >>> peak(np.array([0.0, 1.0, 2.0]), np.array([-3.0, 1.0, 1.0]))
    3.0
    """
    return float(np.maximum(highest(t, y), highest(t, -y)))


@equation
def ultimate_bound(t, y, share=0.25):
    """Largest magnitude in the last `share` of the time: what is left when transients are over.

    A number of this response, not a bound for all time.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times (s), increasing.
    y : ndarray, shape (n,)
        Samples.
    share : float, optional
        Part of the time that counts as late, in (0, 1].

    Returns
    -------
    float
        In the unit of y; NaN where a late sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from analysis.metrics import ultimate_bound
    >>> t = np.linspace(0.0, 4.0, 401)
    >>> print(round(ultimate_bound(t, np.exp(-t)), 6), round(np.exp(-3), 6))
    0.049787 0.049787
    """
    late = t >= t[-1] - share * (t[-1] - t[0])
    return peak(t[late], y[late])


@equation
def final(t, y):
    """Value at the last sample.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times (s), increasing.
    y : ndarray, shape (n,)
        Samples.

    Returns
    -------
    float
        In the unit of y.

    Examples
    --------
    >>> import numpy as np
    >>> from analysis.metrics import final
    >>> final(np.array([0.0, 1.0]), np.array([5.0, 7.0]))
    7.0
    """
    return float(y[-1])
