"""When sampled blocks sample, and when their outputs follow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm
from typing import NamedTuple

import numpy as np

from ..arguments import number
from ..errors import ParameterError
from ..params import whole_number

_MOST = 50_000_000  # instants of one run


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Sample k is taken at offset + k dt, and its outputs follow `delay` later.

    Numbers count as the decimals that they are printed as: clocks of 0.1 s and 0.3 s meet at every
    third instant of the first.

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
        whole_number("Clock", "seed", self.seed, at_least=0)
        if self.jitter >= self.dt:
            raise ParameterError(
                f"Clock needs jitter < dt, got {self.jitter:g} and {self.dt:g} s: samples would "
                "change places"
            )
        if self.jitter and self.jitter + self.delay >= self.dt:
            raise ParameterError(
                f"Clock needs jitter + delay < dt, got {self.jitter:g} + {self.delay:g} and "
                f"{self.dt:g} s: how many samples are on their way would depend on chance"
            )

    @property
    def pending(self) -> int:
        """How many samples are kept until their outputs follow."""
        return -(-_exact(self.delay) // _exact(self.dt))

    @property
    def sampling(self) -> Moment:
        """What happens when it samples: the same for all clocks with these instants."""
        return Moment(Clock(dt=self.dt, offset=self.offset, jitter=self.jitter, seed=self.seed), 1)

    @property
    def release(self) -> Moment:
        """What happens when outputs follow that were delayed."""
        return Moment(self, 0)


class Moment(NamedTuple):
    """Something that clocks do at certain instants.

    Attributes
    ----------
    clock : Clock
    samples : int
        1 if it samples, 0 if delayed outputs follow.
    """

    clock: Clock
    samples: int


class Instants(NamedTuple):
    """When something happens in a run.

    Attributes
    ----------
    times : ndarray of shape (m,)
        Increasing (s).
    which : ndarray of int, shape (m,)
        Which of `patterns` happens.
    patterns : tuple of frozenset of Moment
    """

    times: np.ndarray
    which: np.ndarray
    patterns: tuple[frozenset[Moment], ...]


def moments(clocks: Iterable[Clock]) -> list[Moment]:
    """Return all that these clocks do."""
    found: dict[Moment, None] = {}
    for clock in clocks:
        found[clock.sampling] = None
        if clock.delay:
            found[clock.release] = None
    return list(found)


def meetings(clocks: Iterable[Clock]) -> list[frozenset[Moment]]:
    """Return what may happen at one instant: sets of moments whose instants meet."""
    found: list[frozenset[Moment]] = []
    for moment in moments(clocks):
        joined = [s | {moment} for s in found if all(_meet(moment, other) for other in s)]
        found += [*joined, frozenset({moment})]
    return found


def _meet(one: Moment, other: Moment) -> bool:
    if one.clock.jitter or other.clock.jitter:
        return False  # they would by chance, which has the probability 0
    a, b = one.clock, other.clock
    apart = _start(one) - _start(other)
    return apart % _common(_exact(a.dt), _exact(b.dt)) == 0


def instants(
    clocks: Iterable[Clock], begin: float, end: float, known: Sequence[frozenset[Moment]] = ()
) -> Instants:
    """Return what happens from `begin` on, and before `end`.

    Parameters
    ----------
    clocks : iterable of Clock
    begin, end : float
        Times of a run (s).  What happens at its end is left to a run that resumes there.
    known : sequence of frozenset, optional
        Patterns that come first, in this order.

    Raises
    ------
    ParameterError
        If there are too many.
    """
    each = {moment: _instants_of(moment, begin, end) for moment in moments(clocks)}
    happening: dict[float, set[Moment]] = {}
    for moment, times in each.items():
        for t in times.tolist():
            happening.setdefault(t, set()).add(moment)
    patterns = {pattern: i for i, pattern in enumerate(known)}
    times = sorted(happening)
    which = [patterns.setdefault(frozenset(happening[t]), len(patterns)) for t in times]
    return Instants(np.array(times, float), np.array(which, np.int64), tuple(patterns))


def common_period(clocks: Sequence[Clock]) -> tuple[float, float, float]:
    """Return the beginning and end of a period that repeats, and its length (s).

    Raises
    ------
    ParameterError
        If samples are late at random, or the period has too many of them.
    """
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
            f"clocks of {', '.join(f'{float(p):g}' for p in periods)} s have a common period of "
            f"{float(period):g} s, which is too long: choose sampling times with a short one"
        )
    settled = max(_exact(clock.offset) + _exact(clock.delay) for clock in clocks)
    begin = -(-settled // period) * period
    return float(begin), float(begin + period), float(period)  # each rounded once


def _instants_of(moment: Moment, begin: float, end: float) -> np.ndarray:
    clock, start, dt = moment.clock, _start(moment), _exact(moment.clock.dt)
    late = _exact(clock.jitter)
    # one more on either side: which are inside is asked of the rounded times
    first = max(0, -((start + late - _exact(begin)) // dt) - 1)
    last = max(first - 1, -((start - _exact(end)) // dt) + 1)
    if last - first > _MOST:
        raise ParameterError(
            f"a sampling time of {clock.dt:g} s has more than {_MOST:,} samples from {begin:g} to "
            f"{end:g} s: simulate a shorter time"
        )
    scale = lcm(start.denominator, dt.denominator)
    begins, step = int(start * scale), int(dt * scale)
    if begins + last * step < 2**53:
        times = (begins + np.arange(first, last + 1) * step) / scale
    else:
        times = np.array([(begins + k * step) / scale for k in range(first, last + 1)])
    # either way rounded once, so that instants that meet are equal
    if clock.jitter:
        random = np.random.Generator(np.random.Philox(clock.seed)).random(last + 1)
        times = times + clock.jitter * random[first:]
    return times[(times >= begin) & (times < end)]


def _start(moment: Moment) -> Fraction:
    clock = moment.clock
    return _exact(clock.offset) + (0 if moment.samples else _exact(clock.delay))


def _exact(value: float) -> Fraction:
    return Fraction(repr(float(value)))


def _common(a: Fraction, b: Fraction) -> Fraction:
    return Fraction(gcd(a.numerator * b.denominator, b.numerator * a.denominator),
                    a.denominator * b.denominator)  # fmt: skip
