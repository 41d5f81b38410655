"""Largest and smallest values of a signal, between samples by a curve where they support one.

`curves` says where that is, and what `breaks` are: the times (s) of kinks and jumps, such as those
of the events of a run.  A signal with NaN has the number NaN, or one that is not a finite number.
"""

from __future__ import annotations

import numpy as np

from .curves import largest_of, limits_at_breaks, turning_points
from .samples import of_samples

__all__ = ["final", "highest", "lowest", "peak", "spread", "ultimate_bound", "vertex"]


@of_samples
def vertex(h_before: float, h_after: float, before: float, here: float, after: float):
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

    >>> from nlctl.analysis.metrics import vertex
    >>> vertex(1.0, 1.0, 1 - 1.25**2, 1 - 0.25**2, 1 - 0.75**2)
    (0.25, 1.0)
    """
    d_before, d_after = (here - before) / h_before, (after - here) / h_after
    curvature = (d_after - d_before) / (h_before + h_after)  # half the second derivative
    slope = (d_before * h_after + d_after * h_before) / (h_before + h_after)
    offset = -slope / (2 * curvature)
    return offset, here + slope * offset / 2


@of_samples
def highest(t: np.ndarray, y: np.ndarray, breaks: np.ndarray | None = None):
    """Largest value of y, between samples by a curve where y is smooth there.

    The curve goes through up to nine samples around each of the largest ones; where these show that
    y is not smooth, such as behind a saturation, and of fewer than four, the sample counts.  The
    error is of eighth order in the sampling interval for smooth y, of second order otherwise.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    A parabola's vertex is found exactly, a clipped one has the limit as its largest value:

    >>> import numpy as np
    >>> from nlctl.analysis.metrics import highest
    >>> t = np.linspace(-1.0, 1.0, 9)
    >>> y = 1 - (t - 0.1) ** 2
    >>> round(highest(t, y), 9), highest(t, np.minimum(y, 0.9))
    (1.0, 0.9)
    """
    top = largest_of(y)
    if not np.all(np.isfinite(y)):  # NaN and inf stay, -inf is no calm maximum of the rest
        return np.nan if np.isfinite(top) else float(top)
    breaks = t[:0] if breaks is None else np.asarray(breaks)
    _, _, values = turning_points(t, y, breaks)
    if values.size:
        top = max(top, largest_of(values))
    _, values = limits_at_breaks(t, y, breaks)
    if values.size:
        top = max(top, largest_of(values))
    return float(top)


@of_samples
def lowest(t: np.ndarray, y: np.ndarray, breaks: np.ndarray | None = None):
    """Smallest value of y, see `highest`.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import lowest
    >>> t = np.linspace(-1.0, 1.0, 9)
    >>> round(lowest(t, (t - 0.1) ** 2 - 1), 9)
    -1.0
    """
    return -highest(t, -y, breaks)


@of_samples
def spread(t: np.ndarray, y: np.ndarray, breaks: np.ndarray | None = None):
    """Range of y, `highest` less `lowest`.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import spread
    >>> t = np.linspace(0.0, 2 * np.pi, 1001)
    >>> round(spread(t, 3 * np.sin(t)), 6)
    6.0
    """
    return highest(t, y, breaks) + highest(t, -y, breaks)


@of_samples
def peak(t: np.ndarray, y: np.ndarray, breaks: np.ndarray | None = None):
    """Largest magnitude max |y|, see `highest`.

    Returns
    -------
    float
        In the unit of y; NaN where a sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import peak
    >>> peak(np.array([0.0, 1.0, 2.0]), np.array([-3.0, 1.0, 1.0]))
    3.0
    """
    return float(np.maximum(highest(t, y, breaks), highest(t, -y, breaks)))


@of_samples
def ultimate_bound(
    t: np.ndarray, y: np.ndarray, share: float = 0.25, breaks: np.ndarray | None = None
):
    """Largest magnitude in the last `share` of the time: what is left when transients are over.

    A number of this response, not a bound for all time.

    Parameters
    ----------
    share : float, optional
        Part of the time that counts as late, in (0, 1].

    Returns
    -------
    float
        In the unit of y; NaN where a late sample is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import ultimate_bound
    >>> t = np.linspace(0.0, 4.0, 401)
    >>> print(round(ultimate_bound(t, np.exp(-t)), 6), round(np.exp(-3), 6))
    0.049787 0.049787
    """
    late = t >= t[-1] - share * (t[-1] - t[0])
    return peak(t[late], y[late], breaks)


@of_samples
def final(t: np.ndarray, y: np.ndarray):
    """Value at the last sample.

    Returns
    -------
    float
        In the unit of y.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import final
    >>> final(np.array([0.0, 1.0]), np.array([5.0, 7.0]))
    7.0
    """
    return float(y[-1])
