"""Numbers of a response: one function, one number, with unit and meaning.

Every function takes sample times and samples, and numba can compile it, see `in_machine_code`.
Peaks between samples are found by a parabola, integrals by Simpson's rule, the rest by straight
lines between samples.  A response with NaN has the number NaN, or one that is not a finite number.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from nlctl.arguments import a_function, number, text
from nlctl.equations import equation
from nlctl.errors import ParameterError
from nlctl.native.machine.machine_code import kept

from . import metrics

__all__ = [
    "Metric",
    "absolute_integral",
    "consecutive_differences",
    "final",
    "highest",
    "in_machine_code",
    "integral",
    "lowest",
    "over",
    "peak",
    "reversals",
    "rms",
    "settling_time",
    "spread",
    "square_integral",
    "time_weighted_integral",
    "time_within",
    "total_variation",
    "tracking_metrics",
    "ultimate_bound",
    "vertex",
]


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

    Raises
    ------
    ParameterError
        If it has no name, signal or function, or the interval ends before it starts.
    """

    key: str
    signal: str
    unit: str
    meaning: str
    function: Callable[[np.ndarray, np.ndarray], float]
    start: float = 0.0
    end: float = np.inf

    def __post_init__(self) -> None:
        text("a metric", "key", self.key)
        text(f"metric '{self.key}'", "signal", self.signal)
        a_function(f"metric '{self.key}'", "function", self.function)
        if not self.start <= self.end:
            raise ParameterError(
                f"metric '{self.key}' needs start <= end, got {self.start:g} and {self.end:g}"
            )

    @property
    def signals(self) -> tuple[str, ...]:
        """What `function` takes, after the times."""
        return (self.signal,)


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


@equation
def consecutive_differences(y):
    """Return y_{i+1} - y_i, as `numpy.diff` does, which takes seconds to compile."""
    return y[1:] - y[:-1]


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
    """Smallest value of y, see `highest`."""
    return -highest(t, -y)


@equation
def spread(t, y):
    """Range of y, `highest` less `lowest`."""
    return highest(t, y) + highest(t, -y)


@equation
def peak(t, y):
    """Largest magnitude max |y|, see `highest`."""
    return float(np.maximum(highest(t, y), highest(t, -y)))


@equation
def ultimate_bound(t, y, share=0.25):
    """Largest magnitude in the last `share` of the time: what is left when transients are over.

    A number of this response, not a bound for all time.
    """
    late = t >= t[-1] - share * (t[-1] - t[0])
    return peak(t[late], y[late])


@equation
def final(t, y):
    """Value at the last sample."""
    return float(y[-1])


@equation
def integral(t, y):
    """Integral of y by the composite Simpson rule on any samples, exact for parabolas.

    Of an odd number of intervals the last takes the parabola through the last three samples, as
    in `scipy.integrate.simpson`.  Two samples are connected by a line.  Where neighbouring
    intervals differ by more than a factor of 2, weights may be negative.
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


@equation
def rms(t, y):
    """Root mean square over time."""
    return float(np.sqrt(integral(t, y * y) / (t[-1] - t[0])))


@equation
def absolute_integral(t, y):
    """Integral of |y| (IAE of an error); of second order where y changes sign."""
    return integral(t, np.abs(y))


@equation
def square_integral(t, y):
    """Integral of y^2: ISE of an error, energy of an input."""
    return integral(t, y * y)


@equation
def time_weighted_integral(t, y):
    """Integral of (t - t_0) |y| (ITAE of an error), time counted from the first sample t_0."""
    return integral(t, (t - t[0]) * np.abs(y))


@equation
def total_variation(t, y):
    """Sum of |y_{i+1} - y_i|, the way that y travels; between samples it is a lower bound."""
    return float(np.sum(np.abs(consecutive_differences(y))))


@equation
def settling_time(t, y, band):
    """Time after the first sample from which on |y| <= band, by a line between samples.

    Infinite where the last sample lies outside: the response has not settled.
    """
    if not np.all(np.isfinite(y)):
        return np.nan
    outside = np.nonzero(np.abs(y) > band)[0]
    if outside.size == 0:
        return 0.0
    i = outside[-1]
    if i == y.size - 1:
        return np.inf
    edge = band if y[i] > 0 else -band
    return float(t[i] - t[0] + (t[i + 1] - t[i]) * (edge - y[i]) / (y[i + 1] - y[i]))


@equation
def time_within(t, y, lower, upper):
    """Time (s) that y spends in [lower, upper], by lines between samples.

    With the break points of a dead zone it is the time in which its input has no effect; the same
    for the output v of a dead zone and lower = upper = 0, where the break points are uncertain.
    """
    if not np.all(np.isfinite(y)):
        return np.nan
    low, high = np.minimum(y[:-1], y[1:]), np.maximum(y[:-1], y[1:])
    inside = np.minimum(high, upper) - np.maximum(low, lower)  # negative: none of the interval
    span = high - low
    level = span == 0
    share = np.maximum(inside, 0.0) / (span + level) + (level & (inside >= 0))
    return float(np.sum(consecutive_differences(t) * share))


@equation
def reversals(t, y, above=0.0):
    """How often y reverses: the turns between swings of more than `above`."""
    if not np.all(np.isfinite(y)):
        return np.nan
    steps = consecutive_differences(y)
    moving = np.nonzero(steps)[0]
    up = steps[moving] > 0
    turns = y[moving[:-1][up[1:] != up[:-1]] + 1]
    count, direction = 0.0, 0
    low = high = y[0]
    for value in np.append(turns, y[-1]):
        low, high = min(low, value), max(high, value)
        if direction <= 0 and value - low > above:
            count += direction < 0
            direction, high = 1, value
        elif direction >= 0 and high - value > above:
            count += direction > 0
            direction, low = -1, value
    return count


def in_machine_code(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of this module, or one with arguments given by `partial`, as machine code.

    It keeps no thread of an ensemble waiting, and agrees with the original to rounding.  Other
    functions are returned as they are.
    """
    if isinstance(function, functools.partial):
        return functools.partial(
            in_machine_code(function.func), *function.args, **function.keywords
        )
    own = globals().get(getattr(function, "__name__", ""))
    return _compiled(function) if own is function else function


@functools.cache
def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    return kept(nogil=True, error_model="numpy")(function)


def tracking_metrics(
    *,
    start: float,
    band: float,
    swing: float = 0.01,
    error: str = "e",
    control: str = "u",
    actuated: str = "v",
    weights: str = "W_norm",
    gain: str = "zeta",
) -> tuple[Metric, ...]:
    """Return the usual numbers of a tracking loop.

    Units are those of dimensionless signals, as in the paper.

    Parameters
    ----------
    start : float
        Time (s) after which the error should be small.
    band : float
        What counts as settled.
    swing : float, optional
        Swings of the control input up to this size do not count as reversals.
    error, control, actuated, weights, gain : str, optional
        Names of the signals e, u, v, |W_hat| and zeta; an empty name leaves its numbers out.

    Returns
    -------
    tuple of Metric
        Each a function of a response, with unit and meaning.

    Raises
    ------
    ParameterError
        If a number is not finite, the band not positive or the swing negative.

    Examples
    --------
    >>> import numpy as np
    >>> from analysis.robustness import tracking_metrics
    >>> metrics = {metric.key: metric for metric in tracking_metrics(start=1.0, band=0.1)}
    >>> times = np.linspace(0.0, 2 * np.pi, 1001)
    >>> peak = metrics["peak_u"]
    >>> round(float(peak.function(times, *(3.0 * np.sin(times) for signal in peak.signals))), 6)
    3.0
    """
    number("tracking metrics", "start", start)
    number("tracking metrics", "band", band, above=0)
    number("tracking metrics", "swing", swing, at_least=0)
    e, u, v, after = error, control, actuated, f"for t ≥ {start:g} s"
    settled = partial(metrics.settling_time, band=band)
    turns = partial(metrics.reversals, above=swing)
    dead = partial(metrics.time_within, lower=0.0, upper=0.0)
    rows = (
        ("iae", e, "s", f"∫|{e}| dt", metrics.absolute_integral),
        ("ise", e, "s", f"∫{e}² dt", metrics.square_integral),
        ("itae", e, "s²", f"∫t|{e}| dt", metrics.time_weighted_integral),
        ("late_peak", e, "1", f"max |{e}| {after}", metrics.peak),
        ("late_rms", e, "1", f"RMS of {e} {after}", metrics.rms),
        ("ultimate", e, "1", f"max |{e}| in the last quarter", metrics.ultimate_bound),
        ("settled", e, "s", f"time after which |{e}| ≤ {band:g}", settled),
        ("energy", u, "s", f"∫{u}² dt", metrics.square_integral),
        ("peak_u", u, "1", f"max |{u}|", metrics.peak),
        ("travel", u, "1", f"total variation of {u}", metrics.total_variation),
        ("reversals", u, "1", f"turns of {u} by more than {swing:g}", turns),
        ("dead", v, "s", f"time in which {v} = 0", dead),
        ("peak_W", weights, "1", "max ‖Ŵ‖", metrics.highest),
        ("zeta_range", gain, "1", "max ζ − min ζ", metrics.spread),
    )
    return tuple(
        Metric(
            key=key,
            signal=signal,
            unit=unit,
            meaning=meaning,
            function=function,
            start=start if key.startswith("late") else 0.0,
        )
        for key, signal, unit, meaning, function in rows
        if signal
    )
