"""The usual numbers of a tracking loop, for the table of a study."""

from __future__ import annotations

from functools import partial

from nlctl._arguments import number

from .. import metrics
from ..metrics import Metric

__all__ = ["tracking_metrics"]


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

    Raises
    ------
    ParameterError
        If a number is not finite, the band not positive or the swing negative.
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
