"""Whether there is an end of a run's switches, from the times at which its conditions were at 0."""

from collections import defaultdict, deque
from collections.abc import Callable

import numpy as np

from ..accumulation import (
    AT_LEAST,
    EVER_FASTER,
    SECOND_ORDER,
    WITHIN,
    Crowd,
    StateValue,
    accumulation_words,
    crowd_of,
    reached,
    tolerance_of,
)
from ..errors import ChatteringError
from ..wording import counted

_CROWD, _CROWDED = 300, 1e-6  # so many events in this part of a run: it is chattering
_MANY = 200  # switches of one condition, from which on their pace alone says what is to come
_LOOKED_AT = 100  # switches, after each of which it is asked whether there are ever more
_AT_ONCE = 1e-10  # of a run: two switches that are no further apart are at one place
_NOTHING = "and what is compared is within tolerances of 0"
_GROWS = 10.0  # times as fast as at the first switch
_MORE = 1e4  # switches to come that are too many: each takes tens of milliseconds

Switch = tuple[float, np.ndarray, np.ndarray]  # time (s), state and rates right behind it


class Switches:
    """When the conditions of a run of a diagram have been at 0."""

    def __init__(
        self,
        name: str | None,
        label: Callable[[int], tuple[str, str]],  # block and name of a condition
        ends: tuple[float, float],  # first and last time of the run (s)
        tolerances: tuple[float, float],  # rtol and atol
    ) -> None:
        self._name, self._label, self._ends, self._tolerances = name, label, ends, tolerances
        self._last: deque[float] = deque(maxlen=_CROWD)
        self._times: defaultdict[int, list[float]] = defaultdict(list)
        self._first: dict[int, Switch] = {}
        # the last two switches of each condition: one wave may be cut close to its peak
        self._before: defaultdict[int, deque[Switch]] = defaultdict(lambda: deque(maxlen=2))

    def note(self, i: int, t: float) -> None:
        """Note that something has happened."""
        self._last.append(t)
        if len(self._last) == _CROWD and t - self._last[0] < _CROWDED * np.ptp(self._ends):
            block, which = self._label(i)
            raise self._chattering(
                t, (f"block '{block}'" if block else f"'{which}'") + " switches over and over again"
            )

    def switched(
        self, i: int, t: float, value: StateValue, x: np.ndarray, rates: np.ndarray
    ) -> None:
        """Note that a condition has been at 0.

        Shapes: `x, rates` (nstates,).
        """
        times, end = self._times[i], self._ends[1]
        times.append(t)
        small = crowd_of(
            np.array(times[-2 * AT_LEAST :]), i, end, np.max(self._tolerances[0]), _MORE
        )
        two = self._before[i]
        if small and self._are_small(value, t, two):
            if small.period < _AT_ONCE * np.ptp(self._ends):
                raise self._chattering(t, self._over_and_over(i, 3))
            raise self._accumulate(small, t, _NOTHING, value)
        self._first.setdefault(i, (t, x, rates))
        if len(times) % _LOOKED_AT == 0:
            self._check_pace(i, t, value)
        two.append((t, x, rates))

    def _check_pace(self, i: int, t: float, value: StateValue) -> None:
        """End a run whose switches are too many, or are one place to its tolerances."""
        times, end = self._times[i], self._ends[1]
        took = t - times[-_LOOKED_AT]
        if (end - t) * _LOOKED_AT > _MORE * took and self._are_small(value, t, self._before[i]):
            raise self._chattering(t, self._over_and_over(i, _LOOKED_AT))
        if len(times) >= _MANY:
            more = crowd_of(np.array(times[-len(times) // 2 :]), i, end, np.inf, _MORE)
            if more:
                raise self._accumulate(more, t, "too many for engine='python-control'", value)

    def _over_and_over(self, i: int, count: int) -> str:
        """Say that a condition is at one place, to its tolerances."""
        (block, which), times = self._label(i), self._times[i]
        whose = f"block '{block}' ({which})" if block else f"'{which}'"
        took, often = times[-1] - times[-count], counted(count, "time")
        return f"{whose} switches over and over again, {often} in {took:.3g} s, {_NOTHING}"

    def _are_small(self, value: StateValue, now: float, two: deque[Switch]) -> bool:
        """Whether what is compared has stayed within tolerances since each of two switches."""
        rtol, atol = self._tolerances
        ends = [*(t for t, *_ in two), now][1:]
        return len(two) == two.maxlen and all(
            reached(value, t, x, rates, (until - t) / 4)  # of a parabola: as far as it gets
            <= WITHIN * tolerance_of(value, t, x, (atol + rtol * np.abs(x)) * np.isfinite(rates))
            for (t, x, rates), until in zip(two, ends, strict=True)
        )

    def _accumulate(
        self, crowd: Crowd, t: float, beyond: str, value: StateValue
    ) -> ChatteringError:
        """Say that switches come ever closer together: where it moves slower, or moves faster."""
        i, ahead = crowd.row, 1e-3 * crowd.period
        first, last = (
            abs(value(s + ahead, x + ahead * rates) - value(s, x))
            for s, x, rates in (self._first[i], self._before[i][-1])
        )
        reason = EVER_FASTER if last > _GROWS * first else SECOND_ORDER
        return self._chattering(t, accumulation_words(self._label(i), crowd, beyond, reason))

    def _chattering(self, t: float, words: str) -> ChatteringError:
        return ChatteringError(f"'{self._name}' is chattering at t = {t:.6g} s: {words}", t)
