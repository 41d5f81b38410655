"""When sampled blocks sample, and when their outputs follow."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm
from typing import NamedTuple

import numpy as np

from ..arguments import number
from ..errors import ParameterError
from ..params import integer

_MOST = 50_000_000  # instants of one run


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Sample k is taken at offset + k dt, and its outputs follow `delay` later.

    Numbers count as decimals of 15 digits, so that what was computed means what was written: clocks
    of 0.1 s and 3 * 0.1 s meet at every third instant of the first.

    Parameters
    ----------
    dt : float
        Sampling time (s).
    offset : float, optional
        Time of the first sample (s).
    delay : float, optional
        Time from a sample to its outputs (s), also longer than `dt`.
    jitter : float, optional
        Each sample is late by a random time, uniform in [0, jitter] (s); less than `dt`.
    seed : int, optional
        Of the random times.

    Raises
    ------
    ParameterError
        If a number is not finite or out of its bounds, or a delay together with the jitter reaches
        the next sample.

    Examples
    --------
    Two samples and their delayed outputs:

    >>> clock = nlctl.Clock(dt=0.1, delay=0.25)
    >>> clock.pending  # samples that wait for their outputs
    3
    """

    dt: float
    offset: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        number("Clock", "dt", self.dt, above=0)
        for name in ("offset", "delay", "jitter"):
            number("Clock", name, getattr(self, name), at_least=0)
        integer("Clock", "seed", self.seed, at_least=0)
        if self.jitter >= self.dt:
            raise ParameterError(
                f"Clock needs jitter < dt, got {self.jitter:g} and {self.dt:g} s: samples would "
                "change places"
            )
        if self.jitter and self.jitter + self.delay >= self.dt:
            raise ParameterError(
                f"Clock needs jitter + delay < dt, got {self.jitter:g} + {self.delay:g} and "
                f"{self.dt:g} s: how many samples wait would depend on chance"
            )

    @property
    def pending(self) -> int:
        """How many samples are kept until their outputs follow."""
        return -(-_exact(self.delay) // _exact(self.dt))


class Moment(NamedTuple):
    """Something that a clock does at certain instants."""

    owner: Hashable  # whose clock it is: a key of the mapping that says which clock that is
    samples: int  # 1 if it samples, 0 if delayed outputs follow


Clocks = Mapping[Hashable, Clock]


class Instants(NamedTuple):
    """When something happens in a run."""

    times: np.ndarray  # (m,): increasing (s)
    which: np.ndarray  # (m,): which of `patterns` happens
    patterns: tuple[frozenset[Moment], ...]


def moments(clocks: Clocks) -> list[Moment]:
    """Return all that these clocks do."""
    sampling = [Moment(owner, 1) for owner in clocks]
    return sampling + [Moment(owner, 0) for owner, clock in clocks.items() if clock.delay]


def meetings(clocks: Clocks) -> list[frozenset[Moment]]:
    """Return what may happen at one instant: sets of moments whose instants meet."""
    combined: list[tuple[frozenset[Moment], tuple[_Series, ...]]] = []
    for series, together in _alike(clocks).items():
        combined += [
            (what | together, (*others, series))
            for what, others in combined
            if all(_meet(series, other) for other in others)
        ] + [(together, (series,))]
    return [what for what, _ in combined]


def _meet(one: "_Series", other: "_Series") -> bool:
    if one.jitter or other.jitter:
        return False  # they would by chance, which has the probability 0
    return (one.start - other.start) % _common(one.dt, other.dt) == 0


def instants(
    clocks: Clocks, begin: float, end: float, known: Sequence[frozenset[Moment]] = ()
) -> Instants:
    """Return what happens from `begin` on, and before `end`."""
    patterns = {pattern: i for i, pattern in enumerate(known)}
    alike = _alike(clocks)
    if len(alike) == 1:  # nothing else can happen at these times
        ((series, together),) = alike.items()
        times = _times(series, begin, end)
        which = np.full(times.size, patterns.setdefault(together, len(patterns)), np.int64)
        return Instants(times, which, tuple(patterns))
    happening: dict[float, frozenset[Moment]] = {}
    for series, together in alike.items():
        for t in _times(series, begin, end).tolist():
            happening[t] = happening.get(t, frozenset()) | together
    times = sorted(happening)
    which = [patterns.setdefault(happening[t], len(patterns)) for t in times]
    return Instants(np.array(times, float), np.array(which, np.int64), tuple(patterns))


def schedules(clocks: Clocks) -> list[tuple[tuple[int, int, int], frozenset[Moment]]]:
    """Return begin, step and scale of each series of instants (begin + k step) / scale."""
    # Clocks with a jitter have none.
    return [(_integers(series), together) for series, together in _alike(clocks).items()]


def common_period(clocks: Sequence[Clock]) -> tuple[float, float, float]:
    """Return the beginning and end of a period that repeats, and its length (s)."""
    for clock in clocks:
        if clock.jitter:
            raise ParameterError(
                f"a clock of {clock.dt:g} s has a jitter of {clock.jitter:g} s: its samples have "
                "no period"
            )
    periods = [_exact(clock.dt) for clock in clocks]
    scale = lcm(*(p.denominator for p in periods))
    period = Fraction(lcm(*(int(p * scale) for p in periods)), scale)
    if period / min(periods) > 10_000:
        raise ParameterError(
            f"clocks of {', '.join(f'{float(p):.15g}' for p in periods)} s have a common period of "
            f"{float(period):g} s, which is too long: choose sampling times with a short one"
        )
    settled = max(_exact(clock.offset) + _exact(clock.delay) for clock in clocks)
    begin = -(-settled // period) * period
    return float(begin), float(begin + period), float(period)  # each rounded once


class _Series(NamedTuple):
    """Times at which something happens: start + k dt, each late by a random time."""

    start: Fraction
    dt: Fraction
    jitter: float
    seed: int


def _alike(clocks: Clocks) -> dict[_Series, frozenset[Moment]]:
    """Return what happens together, by when it does."""
    alike: dict[_Series, frozenset[Moment]] = {}
    for moment in moments(clocks):
        series = _series(moment, clocks)
        alike[series] = alike.get(series, frozenset()) | {moment}
    return alike


def _series(moment: Moment, clocks: Clocks) -> _Series:
    clock = clocks[moment.owner]
    start = _exact(clock.offset) + (0 if moment.samples else _exact(clock.delay))
    return _Series(start, _exact(clock.dt), clock.jitter, clock.seed if clock.jitter else 0)


def _times(series: _Series, begin: float, end: float) -> np.ndarray:
    start, dt, late = series.start, series.dt, _exact(series.jitter)
    # one more on either side: which are inside is asked of the rounded times
    first = max(0, -((start + late - _exact(begin)) // dt) - 1)
    last = max(first - 1, -((start - _exact(end)) // dt) + 1)
    if last - first > _MOST:
        raise ParameterError(
            f"a sampling time of {float(dt):g} s has more than {_MOST:,} samples from {begin:g} to "
            f"{end:g} s: simulate a shorter time"
        )
    begins, step, scale = _integers(series)
    if begins + last * step < 2**53 and scale < 2**53:
        times = (begins + np.arange(first, last + 1) * step) / scale
    else:
        times = np.array([(begins + k * step) / scale for k in range(first, last + 1)])
    # either way rounded once, so that instants that meet are equal
    if series.jitter:
        random = np.random.Generator(np.random.Philox(series.seed)).random(last + 1)
        times = times + series.jitter * random[first:]
    return times[(times >= begin) & (times < end)]


def _integers(series: _Series) -> tuple[int, int, int]:
    """Return begin, step and scale of (begin + k step) / scale."""
    scale = lcm(series.start.denominator, series.dt.denominator)
    return int(series.start * scale), int(series.dt * scale), scale


def _exact(value: float) -> Fraction:
    return Fraction(f"{float(value):.15g}")


def _common(a: Fraction, b: Fraction) -> Fraction:
    return Fraction(gcd(a.numerator * b.denominator, b.numerator * a.denominator),
                    a.denominator * b.denominator)  # fmt: skip
