"""Instants at which a run stops, as far as they are known before it."""

from typing import Any

import numpy as np

from ..sampling.clock import instants
from ..sampling.system import Happening, clocks_of
from .known import Known

TIME_ROUNDING = 1e-14  # of a time
_ALIKE = 4.0  # how far apart spaces of output samples may be without a stop between them
_DISTINCT = 1e-9  # of the run: samples closer together count as one


class Stops:
    """Samples of clocks, break points of inputs, changes of the samples' spacing, and others."""

    def __init__(
        self,
        grid: np.ndarray,  # (k,): times of the run (s), those of its inputs and of its response
        times: np.ndarray,  # (m,): times of the inputs (s)
        inputs: Any,  # (ninputs, m)
        sampled: Any,  # blocks with clocks
        conditions: Known,  # where conditions of t alone change, and how long steps may be
    ) -> None:
        begin, end = float(times[0]), float(times[-1])
        # what is due at the last instant happens there
        due = instants(clocks_of(sampled), begin, float(np.nextafter(end, np.inf)))
        what = (due.patterns[i] for i in due.which)
        self.due: dict[float, Happening] = dict(zip(due.times.tolist(), what, strict=True))
        self.borders, self.spaces = _spacing(grid)
        self.longest, self._changes = conditions.longest, conditions.stops
        self.changes = frozenset(conditions.stops[1].tolist())
        self._switched = conditions.switched
        known = (due.times, _break_points(times, inputs), conditions.stops[1])
        every = np.union1d(np.concatenate(known), np.append(self.borders, end))
        self.times = every[(every > begin) & (every <= end)]

    def after(self, t: float) -> float:
        """Return the next stop after a time."""
        return float(self.times[np.searchsorted(self.times, t, side="right")])

    def switched(self, t: float) -> list[tuple[float, str, str, str]]:
        """Return the events at a stop where functions of t alone switch."""
        return [(t, *each) for each in self._switched(t) or [("", "condition of t", "")]]

    def before(self, t: float) -> float:
        """Return the last time before a stop at which functions of t alone are as they were."""
        until, changed = self._changes
        later = until[np.searchsorted(changed, t) :][:1]
        return float(np.min([np.nextafter(t, -np.inf), *later]))

    def space(self, t: float) -> float:
        """Return how long steps may be: the shortest space of output samples near a time (s).

        A longer one from rest would see nothing of what happens within it.
        """
        space = float(self.spaces[np.searchsorted(self.borders, t, side="right") - 1])
        return min(space, self.longest(t))


def _spacing(grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where samples begin to be spaced otherwise, and their shortest space from there on."""
    apart = np.diff(grid, prepend=-np.inf) > _DISTINCT * (grid[-1] - grid[0])
    places = grid[apart]
    borders, spaces, least, most = [grid[0]], [], np.inf, 0.0
    for t, space in zip(places[:-1], np.diff(places), strict=True):
        if max(most, space) > _ALIKE * min(least, space):
            borders.append(t)
            spaces.append(least)
            least, most = np.inf, 0.0
        least, most = min(least, space), max(most, space)
    return np.array(borders), np.array([*spaces, least])


def _break_points(times: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Return the times at which an input has a break point."""
    if not np.size(inputs):
        return np.zeros(0)
    rises, lengths = np.diff(np.atleast_2d(inputs)), np.diff(times)
    bent = np.any(rises[:, :-1] * lengths[1:] != rises[:, 1:] * lengths[:-1], axis=0)
    return times[1:-1][bent]
