"""Switches and jumps that accumulate: ever closer together, and there is no end of them.

Behind a lag, or with u'' as the first derivative of its input that it acts on, a sign drives its
input back and forth through 0 (second-order sliding).  Where every way back is shorter than the
one before, the switches are so many that no run comes to its end: in a geometric sequence, whose
sum is finite, or as exp(t).  Each engine asks `crowd_of` for the times at which one condition has
been at 0, and `reached` and `tolerance_of` for whether what is compared is still more than nothing.

Jumps of a guard accumulate before a time (Zeno) where the times in which their distances halve
become shorter as well: a geometric sequence, or one as 1 / n^2, but none as 1 / n.  `jumps_end` is
asked at each jump, by machine code too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

__all__ = [
    "AT_LEAST", "EVER_FASTER", "PACE", "SECOND_ORDER", "WITHIN", "Crowd", "accumulation_words",
    "crowd_of", "jumps_end", "limit_of", "reached", "tolerance_of",
]  # fmt: skip

AT_LEAST = 5  # switches that are examined
WITHIN = 100.0  # tolerances that what is compared changes by in between
SECOND_ORDER = (
    "what switches does not reach the rate of what is compared, and cannot hold it at 0 (second-"
    "order sliding): give it hysteresis (nlctl.Relay), smooth it over a small width, make a sign "
    "an nlctl.IdealRelay with a larger rest_rate, or let the run end before"
)
EVER_FASTER = (
    "what is compared moves ever faster: have it counted by something smooth, stop it where it is "
    "too fast, or let the run end before"
)
_LOCATED = 50.0  # relative tolerances by which periods fall at least; switches are located to 10
_SUDDEN = 0.02  # of the ratio of two periods: the next one, in a sequence
_FALLS = 0.2  # part by which it is enough that they fall, whatever the tolerance is
_FINITE = 0.9  # of two periods: those that fall as 1 / n do not fall so much for long

PACE = 8  # numbers that are kept of a guard's jumps
_LAST, _APART, _BEGUN, _HALF, _AT, _TOOK, _HALVED, _JUMPS = range(PACE)
_SHORTER, _AT_ONCE = 0.9, 1e-3  # of the time of the halving before: that of 1 / n is as long
_FEW, _NEAR = 6, 1e-9  # halvings, of a sequence whose rest is this part of its time so far
_LONG, _COUNT = 13, 1000  # halvings and jumps after which none is waited for

StateValue = Callable[[float, np.ndarray], float]


@dataclass(frozen=True, kw_only=True)
class Crowd:
    """Switches that come ever closer together.

    Attributes
    ----------
    row : int
        Which condition, in the order of the engine.
    last : float
        Time of the last switch (s).
    period : float
        From the last switch but two to it: two of them (s).
    ratio : float
        Of two such periods in a row.
    more : float
        Switches that there would be until the end of the run, at that pace.
    """

    row: int
    last: float
    period: float
    ratio: float
    more: float

    @property
    def end(self) -> float:
        """Where a geometric sequence has its end (s); periods that fall as 1 / n have none."""
        half = self.ratio**0.5
        return self.last + 0.5 * self.period * half / (1 - half)


def crowd_of(times: np.ndarray, row: int, end: float, rtol: float, most: float) -> Crowd | None:
    """Return how switches at some times accumulate, if they do."""
    if times.size < AT_LEAST:
        return None
    periods = times[2:] - times[:-2]
    enough = min(_FALLS, _LOCATED * rtol)
    if not (np.all(periods[2:] < periods[:-2]) and periods[-1] < (1 - enough) * periods[0]):
        return None
    # Where places lie close together by chance, the last one falls by far more than those before.
    if not periods[-1] * periods[-3] > _SUDDEN * periods[-2] ** 2:
        return None
    fall = np.log(periods[0] / periods[-1])
    pace = fall / (times[-1] - times[-1 - periods.size])
    with np.errstate(over="ignore"):
        more = 2.0 * np.expm1(pace * (end - times[-1])) / (pace * periods[-1])
    if not more > most:
        return None
    ratio = float(np.exp(-2.0 * fall / (periods.size - 1)))
    return Crowd(
        row=row, last=float(times[-1]), period=float(periods[-1]), ratio=ratio, more=float(more)
    )


def reached(value: StateValue, t: float, x: np.ndarray, rates: np.ndarray, ahead: float) -> float:
    """Return how far from 0 what is compared comes in a time, at the rates behind a switch."""
    return abs(value(t + ahead, x + ahead * rates))


def tolerance_of(value: StateValue, t: float, x: np.ndarray, away: np.ndarray) -> float:
    """Return by how much a switching function changes where states change by their tolerances."""
    here = value(t, x)
    places = np.flatnonzero(away)
    return float(sum(abs(value(t, x + away[i] * (np.arange(x.size) == i)) - here) for i in places))


def accumulation_words(
    which: tuple[str, str], crowd: Crowd, beyond: str, reason: str = SECOND_ORDER
) -> str:
    """Return whose switches accumulate, and how."""
    whose = f"block '{which[0]}' ({which[1]})" if which[0] else which[1]
    left = f"{crowd.more:.2g}" if np.isfinite(crowd.more) else "no end of them"
    where = f"near t = {crowd.end:.6g} s" if crowd.ratio < _FINITE else "ever faster"
    return (
        f"the switches of {whose} accumulate {where}: two of them in {crowd.period:.3g} s at "
        f"t = {crowd.last:.6g} s, {left} to come, {beyond}; {reason}"
    )


def jumps_end(pace: np.ndarray, t: float) -> bool:
    """Note that a guard has fallen; return whether its jumps accumulate before a time close by.

    Shapes: `pace` (PACE,), zeros before the first jump.
    """
    apart = t - pace[_LAST] if pace[_JUMPS] > 0.0 else np.inf
    pace[_LAST] = t
    pace[_JUMPS] += 1.0
    shorter = apart < pace[_APART]
    pace[_APART] = apart
    if shorter and apart > 0.5 * pace[_HALF]:
        return False
    took, before = t - pace[_AT], pace[_TOOK]
    pace[_AT], pace[_HALF] = t, apart
    follows = before == np.inf or _AT_ONCE * before < took < _SHORTER * before
    if not (shorter and follows):  # a sequence may begin here
        pace[_BEGUN], pace[_TOOK], pace[_HALVED] = t, np.inf, 0.0
        pace[_JUMPS] = min(pace[_JUMPS], 1.0)
        return False
    pace[_TOOK] = took
    pace[_HALVED] += 1.0
    rest = took / (1.0 - _SHORTER)
    is_near = pace[_HALVED] >= _FEW and rest <= _NEAR * (t - pace[_BEGUN])
    return is_near or (pace[_HALVED] >= _LONG and pace[_JUMPS] >= _COUNT)


def limit_of(times: Sequence[float], last: float) -> float:
    """Return where jumps at these times accumulate: `last`, where they have no limit."""
    pace, took = np.zeros(PACE), np.inf
    for t in times:
        before, ends = pace[_TOOK], jumps_end(pace, t)
        took = pace[_TOOK] / before if ends else np.inf
    if took < 1.0:
        return float(times[-1] + pace[_TOOK] * took / (1.0 - took))
    apart = [b - a for a, b in pairwise(times[-3:])]
    if len(apart) == 2 and 0.0 < apart[1] < apart[0]:
        return times[-1] + apart[1] ** 2 / (apart[0] - apart[1])  # of a geometric sequence
    return last
