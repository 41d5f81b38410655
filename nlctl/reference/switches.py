"""Whether there is an end of a run's switches, from the times at which its conditions were at 0."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable

import numpy as np

from ..accumulation import (
    AT_LEAST,
    WITHIN,
    Crowd,
    StateValue,
    accumulation_words,
    crowd_of,
    reached,
    tolerance_of,
)
from ..errors import ChatteringError

_CROWD, _CROWDED = 300, 1e-6  # so many events in this part of a run: it is chattering
_MANY = 200  # switches of one condition, from which on their pace alone says what is to come
_LOOKED_AT = 100  # switches, after each of which it is asked whether there are ever more
_MORE = 1e4  # switches to come that are too many: each takes tens of milliseconds


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
        if small and self._is_small(small, t, value, x, rates):
            raise self._accumulate(small, t, "and what is compared is within tolerances of 0")
        if len(times) % _LOOKED_AT == 0 and len(times) >= _MANY:
            more = crowd_of(np.array(times[-len(times) // 2 :]), i, end, np.inf, _MORE)
            if more:
                raise self._accumulate(more, t, "too many for engine='python-control'")

    def _is_small(
        self, crowd: Crowd, t: float, value: StateValue, x: np.ndarray, rates: np.ndarray
    ) -> bool:
        """Whether from one switch to the next what is compared stays within tolerances."""
        rtol, atol = self._tolerances
        away = (atol + rtol * np.abs(x)) * np.isfinite(rates)
        there = reached(value, t, x, rates, crowd.period / 8)
        return there <= WITHIN * tolerance_of(value, t, x, away)

    def _accumulate(self, crowd: Crowd, t: float, beyond: str) -> ChatteringError:
        return self._chattering(t, accumulation_words(self._label(crowd.row), crowd, beyond))

    def _chattering(self, t: float, words: str) -> ChatteringError:
        return ChatteringError(f"'{self._name}' is chattering at t = {t:.6g} s: {words}", t)
