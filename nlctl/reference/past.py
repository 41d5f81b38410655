"""What transport delays need of a run: their signals so far, as polynomials through its solution.

The method of steps: a run stops after the shortest delay at the latest, so that all that leaves a
delay until the next stop is known.  Signals are kept as Chebyshev polynomials, each of which
settles and goes through what the ends of the integrator's steps have seen: the past knows of a
pulse that a step was short for.  Where none does, it is divided between steps, and in one step
into halves.
"""

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from scipy.optimize import brentq

from ..blocks import Block
from ..delays.pieces import PLACES
from ..delays.transport import TransportDelay
from ..delays.variation import check_positive, history_breaks, variation
from ..supplied import SuppliedOutput
from .stops import TIME_ROUNDING

_DEGREE = 12
_NODES = chebyshev.chebpts2(_DEGREE + 1)
_FITTED = np.linalg.inv(chebyshev.chebvander(_NODES, _DEGREE))
_HALVINGS = 12
_ROUNDED = 1e-15  # of a signal: coefficients that are rounding
_LEAST = 1e-9  # of a run: no step is shorter for what leaves a delay
_JUMPS, _KINKS = 10.0, 1e3  # tolerances: from where on a signal jumps between two pieces, or bends
_ORDERS = np.arange(_DEGREE + 1)
_ASIDE = 1e-9  # part of a step: what lies so close to its end is read from inside


class Past:
    """What is known of delayed signals while a run goes on."""

    def __init__(
        self, blocks: list[Block], begin: float, end: float, tolerances: tuple[float, float]
    ) -> None:
        # Of transport delays with the parameters of the run; polynomials settle to rtol and atol.
        self.specs: list[Any] = [made.current_spec for made in blocks]
        self.begin, self.end, self._tolerances = begin, end, tolerances
        # from where to where the run goes now, the side from which signals that jump are read
        self.step = (begin, begin)
        # of each block, increasing: when what jumps, or bends, leaves it
        self._due: list[deque[float]] = []
        self.left: list[float] = []  # when such things have left a delay
        self._starts, self._ends, self._pieces = [], [], []
        self.lines: dict[Any, SuppliedOutput] = {}  # what leaves each block
        for number, made in enumerate(blocks):
            spec: Any = made.current_spec
            varied = variation(spec, begin, end, str(made.name))
            check_positive(varied, np.array([spec.delay]), str(made.name))
            jumps = [*history_breaks(spec, _sent(spec, begin), begin), begin]
            self._due.append(deque(self._arrival(spec, t) for t in jumps))
            self.left += [] if varied is None else varied.kinks.tolist()
            self.lines[made] = SuppliedOutput(
                leaving=lambda t, number=number: self._leaving(number, t),
                arriving=np.full(made.noutputs or 0, np.nan),
            )

    def leaving(self, t: float) -> np.ndarray:
        """Return what leaves all blocks, one after the other."""
        found = [line.leaving(t) for line in self.lines.values()]
        return np.concatenate(found) if found else np.zeros(0)

    def _leaving(self, number: int, t: float) -> np.ndarray:
        """Return what leaves a block: of the side of a break that the step lies on."""
        spec = self.specs[number]
        a, b = self.step
        aside = _ASIDE * (b - a)
        s, inside = _sent(spec, t), _sent(spec, min(max(t, a + aside), b - aside))
        if inside < self.begin:
            return spec.earlier(min(s, self.begin))
        k = max(bisect_right(self._starts, inside) - 1, 0)
        a, b = self._starts[k], self._ends[k]
        return _at(self._pieces[k][number], (2.0 * s - a - b) / (b - a))

    def after(self, t: float, stop: float) -> float:
        """Return the next stop: that one, or where a break or the first unknown signal leaves."""
        next_stop = stop
        for spec, due in zip(self.specs, self._due, strict=True):
            while due and due[0] <= t + TIME_ROUNDING * abs(t):
                self.left.append(due.popleft())
            next_stop = min(next_stop, self._arrival(spec, t), due[0] if due else math.inf)
        return stop if stop - next_stop <= TIME_ROUNDING * abs(stop) else next_stop

    def _rounding(self, t: float) -> float:
        """Return what rounding alone may set two times apart by, at a time of the run (s)."""
        return TIME_ROUNDING * max(abs(t), self.end - self.begin)

    def _arrival(self, spec: TransportDelay, s: float) -> float:
        """Return when leaves a delay what it is given at time s; inf behind the run."""
        if spec.varying is None:
            return s + spec.delay
        if _sent(spec, self.end) <= s:
            return math.inf
        found: Any = brentq(lambda t: _sent(spec, t) - s, self.begin, self.end, xtol=1e-14)
        return float(found)

    def longest_step(self, t: float) -> float:
        """Return how long a step from a time on may be to go over no pulse that leaves a delay.

        It ends in the piece behind the one in which it begins: pieces are shorter the faster their
        signals move.  A function that nobody knows between two places is looked at at 1000.
        """
        found = [math.inf]
        for spec in self.specs:
            sent = _sent(spec, t)
            if spec.varying is not None:
                found.append((self.end - self.begin) / PLACES)
            if sent >= self.begin:
                k = bisect_right(self._ends, sent) + 1
                if k < len(self._ends):  # else a stop is near
                    length = self._ends[k] - sent
                    ahead = _sent(spec, min(t + length, self.end)) - sent
                    length *= min(length / ahead, 1.0) if ahead > 0.0 else 1.0
                    found.append(max(length, _LEAST * (self.end - self.begin)))
            elif spec.history is not None:
                found.append((self.begin - _sent(spec, self.begin)) / PLACES)
        return min(found)

    def keep(self, ends: Sequence[float], arriving: Callable[[float], list[np.ndarray]]) -> None:
        """Keep what has arrived at each delay, ``arriving(t)``, where steps begin and end."""
        if not self.specs or ends[-1] - ends[0] <= self._rounding(ends[-1]):
            return
        first = len(self._starts)
        self._keep(list(ends), [arriving(t) for t in ends], arriving, 0)
        if first:
            self._note_breaks(first)

    def _keep(
        self, ends: list[float], seen: list[list[np.ndarray]], arriving: Any, halvings: int
    ) -> None:
        """Keep what has arrived, divided between steps until one polynomial says it."""
        a, b = ends[0], ends[-1]
        nodes = 0.5 * ((b - a) * _NODES + (a + b))
        values = [seen[0], *(arriving(float(t)) for t in nodes[1:-1]), seen[-1]]
        pieces = [_fitted(np.array(signals)) for signals in zip(*values, strict=True)]
        inside = (2.0 * np.array(ends[1:-1]) - a - b) / (b - a)
        is_right = all(
            self._says(piece, inside, np.array([one[number] for one in seen[1:-1]]))
            for number, piece in enumerate(pieces)
        )
        if not is_right and len(ends) > 2:
            k = 1 + int(np.argmin(np.abs(inside)))
            self._keep(ends[: k + 1], seen[: k + 1], arriving, halvings)
            self._keep(ends[k:], seen[k:], arriving, halvings)
        elif not is_right and halvings < _HALVINGS:
            middle = 0.5 * (a + b)
            there = arriving(middle)
            self._keep([a, middle], [seen[0], there], arriving, halvings + 1)
            self._keep([middle, b], [there, seen[-1]], arriving, halvings + 1)
        else:
            self._starts.append(a)
            self._ends.append(b)
            self._pieces.append(pieces)

    def _says(self, piece: np.ndarray, places: np.ndarray, seen: np.ndarray) -> bool:
        """Whether a polynomial has settled, and is what has been seen at some places of it."""
        allowed = self._allowed(piece)
        if not np.all(np.abs(piece[_DEGREE - 1 :]) <= allowed):
            return False
        guessed = _at(piece, places[:, None])
        return bool(np.all(np.abs(guessed - seen.reshape(guessed.shape)) <= allowed))

    def _allowed(self, piece: np.ndarray) -> np.ndarray:
        """Return the tolerances of a piece's signals."""
        rtol, atol = self._tolerances
        return atol + rtol * np.abs(piece).sum(axis=0)

    def _note_breaks(self, k: int) -> None:
        """Note which signals jump, or bend, where a piece begins, and when that leaves."""
        begin, before = self._starts[k], self._ends[k - 1] - self._starts[k - 1]
        behind = self._ends[k] - begin
        short = 2.0 * min(before, behind)
        for number, spec in enumerate(self.specs):
            left, right = self._pieces[k - 1][number], self._pieces[k][number]
            allowed = np.maximum(self._allowed(left), self._allowed(right))
            jump = _at(right, -1.0) - _at(left, 1.0)
            bend = short * (_slope(right, -1.0) / behind - _slope(left, 1.0) / before)
            calm = (np.abs(jump) <= _JUMPS * allowed) & (np.abs(bend) <= _KINKS * allowed)
            if not np.all(calm):
                self._due[number].append(self._arrival(spec, begin))


def _fitted(values: np.ndarray) -> np.ndarray:
    """Return the coefficients of polynomials through values at the nodes, without their rounding.

    What rests is a constant to the last digit, and a condition that compares it has no noise.

    Shapes: `values` (nodes, n), result (at most nodes, n).
    """
    least, most = values.min(axis=0), values.max(axis=0)
    found = np.where(least == most, (_ORDERS == 0)[:, None] * least, _FITTED @ values)
    calm = np.abs(found) <= _ROUNDED * np.abs(values).max(axis=0)  # NaN is not
    last = np.flatnonzero(~np.all(calm, axis=1))
    return found[: int(last[-1]) + 1 if last.size else 1]


def _at(piece: np.ndarray, z: Any) -> np.ndarray:
    """Return polynomials at a place between -1 and 1, or at places in a column."""
    return np.cos(_ORDERS[: len(piece)] * np.arccos(np.clip(z, -1.0, 1.0))) @ piece


def _slope(piece: np.ndarray, end: float) -> np.ndarray:
    """Return the slopes of polynomials at -1 or at 1."""
    orders = _ORDERS[: len(piece)]
    return (orders**2 * end ** (orders + 1)) @ piece


def _sent(spec: TransportDelay, t: float) -> float:
    """Return when a delay was given what leaves it at time t."""
    return t - (spec.delay + spec.varied(t))
