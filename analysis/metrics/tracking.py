"""Named numbers of a response, and the usual ones of a tracking loop."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import a_function, number, text
from nlctl.attributes import described_record
from nlctl.errors import ParameterError

from . import extremes, integrals, travel


@as_annotated
@described_record
class Metric:
    """A named number of one signal.

    Raises
    ------
    ParameterError
        If it has no name, signal or function, or the interval ends before it starts.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import Metric, peak
    >>> effort = Metric(key="peak_u", signal="u", unit="1", meaning="largest input", function=peak)
    >>> effort.signals, effort.function(np.array([0.0, 1.0, 2.0]), np.array([-3.0, 1.0, 1.0]))
    (('u',), 3.0)
    """

    key: str  # Short name for tables and files.
    signal: str  # Signal of the response that it is computed from.
    unit: str  # Shown wherever the number is.
    meaning: str
    function: Callable[[np.ndarray, np.ndarray], float]  # ``function(t, y) -> float``.
    start: float = 0.0  # Interval of time (s) that counts.
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


@as_annotated
def over(t: np.ndarray, y: np.ndarray, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples with start <= t <= end.

    Parameters
    ----------
    t, y : ndarray, shape (n,)
        Sample times (s), increasing, and samples.
    start, end : float
        Interval of time (s).

    Returns
    -------
    t, y : ndarray
        Those that lie in it.

    Raises
    ------
    ValueError
        If fewer than three samples are left.

    Examples
    --------
    >>> import numpy as np
    >>> from nlctl.analysis.metrics import over
    >>> t = np.linspace(0.0, 1.0, 5)
    >>> print(*over(t, t**2, 0.4, 1.0))
    [0.5  0.75 1.  ] [0.25   0.5625 1.    ]
    """
    inside = (t >= start) & (t <= end)
    if np.count_nonzero(inside) < 3:
        raise ValueError(
            f"a metric over [{start:g}, {end:g}] s needs at least 3 samples there, "
            f"got {np.count_nonzero(inside)} (the response covers [{t[0]:g}, {t[-1]:g}] s)"
        )
    return t[inside], y[inside]


@as_annotated
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
    >>> from nlctl.analysis.robustness import tracking_metrics
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
    settled = partial(travel.settling_time, band=band)
    turns = partial(travel.reversals, above=swing)
    dead = partial(travel.time_within, lower=0.0, upper=0.0)
    rows = (
        ("iae", e, "s", f"∫|{e}| dt", integrals.absolute_integral),
        ("ise", e, "s", f"∫{e}² dt", integrals.square_integral),
        ("itae", e, "s²", f"∫t|{e}| dt", integrals.time_weighted_integral),
        ("late_peak", e, "1", f"max |{e}| {after}", extremes.peak),
        ("late_rms", e, "1", f"RMS of {e} {after}", integrals.rms),
        ("ultimate", e, "1", f"max |{e}| in the last quarter", extremes.ultimate_bound),
        ("settled", e, "s", f"time after which |{e}| ≤ {band:g}", settled),
        ("energy", u, "s", f"∫{u}² dt", integrals.square_integral),
        ("peak_u", u, "1", f"max |{u}|", extremes.peak),
        ("travel", u, "1", f"total variation of {u}", travel.total_variation),
        ("reversals", u, "1", f"turns of {u} by more than {swing:g}", turns),
        ("dead", v, "s", f"time in which {v} = 0", dead),
        ("peak_W", weights, "1", "max ‖Ŵ‖", extremes.highest),
        ("zeta_range", gain, "1", "max ζ − min ζ", extremes.spread),
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
