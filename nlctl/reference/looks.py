"""At how many places of a step functions are looked at, and what they may be in between.

A cubic spline through most of the places is compared with the others.  Where it does not meet
them, there are waves from place to place, or a jump: the step is looked at in thirds, and these in
thirds, until it does.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

_NEAR, _FOLLOWED = 20.0, 0.02  # of the range of a function in what is looked at
_DOUBT = 4.0  # times what a spline was wrong by: how far from it a function may be
_BENT = 0.25  # times a second difference: how far below three points a parabola may be
_FINE = 8  # parts of the way from place to place
_DIVIDED, _PARTS = 9, 3  # how often a step is divided, into how many parts
_ROUNDED_FROM = 2  # times divided, from which on what is left may be rounding
_ROUNDED = 1.0 + 4.0 * np.finfo(float).eps  # times a state: what rounding may make of it
_NOISE = 10.0  # times what that changes


class LookPlaces(NamedTuple):
    """Parts of a step, and matrices that act on the values there, see `_places`."""

    at: np.ndarray  # (k,)
    misses: np.ndarray  # (others, k): what is left at the others of a spline through the rest
    between: np.ndarray  # (_FINE (k - 1) + 1, k): the spline through all
    # the same: from place to place the parabolas through the three before, and the three behind
    before: np.ndarray
    behind: np.ndarray


def _places(rest: Sequence[float], others: Sequence[float]) -> LookPlaces:
    at = np.sort([*rest, *others])
    values, is_other = np.eye(at.size), np.isin(at, others)
    guess = CubicSpline(at[~is_other], values[~is_other])(at[is_other])
    ways = np.interp(np.arange(_FINE * (at.size - 1) + 1) / _FINE, np.arange(at.size), at)
    between = CubicSpline(at, values)(ways)
    before, behind = between.copy(), between.copy()
    for k in range(at.size - 1):
        rows = slice(_FINE * k, _FINE * (k + 1))
        for parabolas, first in ((before, k - 2), (behind, k + 1)):
            if 0 <= first <= at.size - 3:
                three = slice(first, first + 3)
                parabolas[rows] = _parabola(at[three], values[three], ways[rows])
    return LookPlaces(at, guess - values[is_other], between, before, behind)


def _parabola(at: np.ndarray, values: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Return the parabolas through three values each at some places; shapes (3,), (3, n), (m,)."""
    powers = np.vander(at - at[1], 3)
    return np.vander(where - at[1], 3) @ np.linalg.solve(powers, values)


# Not halfway, and each elsewhere: a wave that is 0 at the rest of the places is not seen there, nor
# one that makes whole turns from place to place.
STEP_PLACES = _places(
    [0.0, 1e-3, *(np.arange(1, 15) / 15.0), 1.0 - 1e-3, 1.0],
    (np.array([1.38, 5.45, 9.31, 13.41]) / 15.0).tolist(),
)
FEW_PLACES = _places([0.0, 1e-3, 0.25, 0.5, 0.75, 1.0 - 1e-3, 1.0], [1.38 / 4.0, 2.31 / 4.0])


class Looks(NamedTuple):
    """Functions at some times, the last ones of which are those of the next looks."""

    t: np.ndarray  # (k,)
    values: np.ndarray  # (k, n)
    # (_FINE (k - 1) + 1, n): a spline through them; parabolas from either side, which meet where
    # there is a kink; and (n,) how far from the spline they may be
    between: np.ndarray
    before: np.ndarray
    behind: np.ndarray
    doubt: np.ndarray

    def lowest(self, sides: np.ndarray) -> np.ndarray:
        """Return how near to 0 functions come between two places; below, on another side.

        Shapes: `sides` (k, n), result (k - 1, n).
        """
        every = (self.between, self.before, self.behind)
        return np.min([_inner(values, sides).min(axis=1) for values in every], axis=0)

    def around(self, k: int, i: int, sides: np.ndarray) -> tuple[float, float]:
        """Return between which times a function is least that comes near to 0 behind a place."""
        at = _FINE * k + 1 + int(_inner(self.between, sides)[k, :, i].argmin())
        first = max(at - _FINE, _FINE * (k - int(k > 0 and sides[k - 1, i] == sides[k, i])))
        last = min(at + _FINE, self.between.shape[0] - 1)
        return self._time(first), self._time(last)

    def _time(self, number: int) -> float:
        k, part = divmod(number, _FINE)
        return float(self.t[k] + part / _FINE * (self.t[min(k + 1, self.t.size - 1)] - self.t[k]))


def _inner(values: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return values between the places, positive where a function is on its side."""
    parts = values[:-1].reshape(-1, _FINE, sides.shape[1])[:, 1:]
    return parts * sides[:-1, None, :]


def looks_at_step(
    look: Callable[..., np.ndarray],
    ends: tuple[float, float],
    before: np.ndarray,
    places: LookPlaces,
    signed: int,
) -> Iterator[Looks]:
    """Yield what the first so many functions are in a step, piece by piece, each as fine as needed.

    ``look(t, rounded)`` returns them, of a state that is multiplied by a number.

    Shapes: `before` (n,), at the begin of the step.
    """
    rest = [(*ends, 0)]
    while rest:
        begin, end, divided = rest.pop()
        t = begin + places.at * (end - begin)
        t[-1] = end
        values = np.array([before, *(look(s) for s in t[1:].tolist())])
        known = np.where(np.isfinite(values[:, :signed]), values[:, :signed], 0.0)
        missed = np.abs(places.misses @ known).max(axis=0, initial=0.0)
        is_wild = _is_wild(known, missed)
        if divided >= _ROUNDED_FROM and is_wild.any():
            is_wild &= missed > _NOISE * _noise(look, float(t[t.size // 2]))[:signed]
        thirds = np.linspace(begin, end, _PARTS + 1)
        if is_wild.any() and divided < _DIVIDED and np.all(np.diff(thirds) > 0.0):
            rest += [(a, b, divided + 1) for a, b in pairwise(thirds.tolist())][::-1]
            continue
        before, between = values[-1], places.between @ known
        sides = places.before @ known, places.behind @ known
        bends = np.abs(np.diff(between, 2, axis=0)).max(axis=0, initial=0.0)
        yield Looks(t, values, between, *sides, _DOUBT * missed + _BENT * bends)


def _is_wild(values: np.ndarray, missed: np.ndarray) -> np.ndarray:
    """Return which functions that may be 0 are not what a spline through their values is."""
    extent = np.ptp(values, axis=0)
    return (np.abs(values).min(axis=0) <= _NEAR * extent) & (missed > _FOLLOWED * extent)


def _noise(look: Callable[..., np.ndarray], t: float) -> np.ndarray:
    """Return by how much functions change where the state changes by rounding."""
    with np.errstate(invalid="ignore"):
        return np.abs(look(t, _ROUNDED) - look(t, 1.0))
