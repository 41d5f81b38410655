"""What transport delays need of a run: their signals so far, as polynomials through its solution.

The method of steps: a run stops after the shortest delay at the latest, so that all that leaves a
delay until the next stop is known.  Signals are kept as Chebyshev polynomials; a piece whose
polynomials do not settle is halved.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from scipy.optimize import brentq

from ..blocks import Block
from ..delays.pieces import PLACES
from ..delays.transport import TransportDelay
from ..delays.variation import check_positive, variation
from ..supplied import SuppliedOutput
from .stops import TIME_ROUNDING

_DEGREE = 12
_NODES = chebyshev.chebpts2(_DEGREE + 1)
_FITTED = np.linalg.inv(chebyshev.chebvander(_NODES, _DEGREE))
_HALVINGS = 12
_STEPS = 256  # of the longest step between two stops
_ASIDE = 1e-9  # part of a step: what lies so close to its end is read from inside


class Past:
    """What is known of delayed signals while a run goes on."""

    def __init__(
        self, blocks: list[Block], begin: float, end: float, tolerances: tuple[float, float]
    ) -> None:
        # Of transport delays with the parameters of the run; polynomials settle to rtol and atol.
        self.specs: list[Any] = [made.current_spec for made in blocks]
        self.begin, self.end, self._tolerances = begin, end, tolerances
        # from where to where the run goes now, the side from which signals that jump are read; and
        # times at which a signal, or one of its derivatives, jumps
        self.step, self.breaks = (begin, begin), []
        self._starts, self._ends, self._pieces = [], [], []
        self.lines: dict[Any, SuppliedOutput] = {}  # what leaves each block
        for number, made in enumerate(blocks):
            spec: Any = made.current_spec
            varied = variation(spec, begin, end, str(made.name))
            check_positive(varied, np.array([spec.delay]), str(made.name))
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
        return np.asarray(chebyshev.chebval((2.0 * s - a - b) / (b - a), self._pieces[k][number]))

    def after(self, t: float, stop: float) -> float:
        """Return the next stop: that one, or where a break or the first unknown signal leaves."""
        if not self.specs:
            return stop
        later = [self._arrival(spec, s) for s in self.breaks for spec in self.specs]
        ahead = (s for s in later if s > t + TIME_ROUNDING * abs(t))
        next_stop = min([stop, *(self._arrival(spec, t) for spec in self.specs), *ahead])
        next_stop = stop if stop - next_stop <= TIME_ROUNDING * abs(stop) else next_stop
        least = self._rounding(next_stop)  # pieces may be as short as that
        while next_stop - t > max(_STEPS * min(self._read(t, next_stop), default=math.inf), least):
            next_stop = t + 0.5 * (next_stop - t)  # short steps only where they are needed
        return next_stop

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

    def longest_step(self, a: float, b: float) -> float:
        """Return how long steps from a to b may be to go over no pulse that leaves a delay.

        A function that nobody knows between two places is looked at at 1000; pieces of the past
        are shorter the faster their signals move.
        """
        found = self._read(a, b)
        for spec in self.specs:
            if spec.varying is not None:
                found.append((self.end - self.begin) / PLACES)
            if spec.history is not None and _sent(spec, a) < self.begin:
                found.append((self.begin - _sent(spec, self.begin)) / PLACES)
        return min(found, default=math.inf)

    def _read(self, a: float, b: float) -> list[float]:
        """Return the lengths of the pieces that leave delays from a to b.

        Of three together: one alone may be what is left between two breaks.
        """
        starts, ends = self._starts, self._ends
        return [
            (ends[k + 2] - starts[k]) / 3
            for spec in self.specs
            for k in range(
                bisect_right(ends, _sent(spec, a)), bisect_right(starts, _sent(spec, b)) - 2
            )
        ]

    def reach(self, t: float, is_break: bool) -> None:
        """Note a stop: a break, or where one leaves a delay; those that all have left are gone."""
        if not self.specs:
            return
        near = TIME_ROUNDING * abs(t)
        left = (self._arrival(spec, s) for s in self.breaks for spec in self.specs)
        if is_break or any(abs(s - t) <= near for s in left):
            oldest = min(_sent(spec, t) for spec in self.specs)
            self.breaks = [s for s in self.breaks if s > oldest - 1e-9 * abs(t)]
            if not self.breaks or self.breaks[-1] != t:
                self.breaks.append(t)

    def keep(
        self, a: float, b: float, arriving: Callable[[float], list[np.ndarray]], halvings: int = 0
    ) -> None:
        """Keep what has arrived from a to b, at each delay: ``arriving(t)``."""
        if not self.specs or b - a <= self._rounding(b):
            return
        nodes = 0.5 * ((b - a) * _NODES + (a + b))
        nodes[0], nodes[-1] = a, b
        seen = [arriving(float(t)) for t in nodes]
        pieces = [_FITTED @ np.array(own) for own in zip(*seen, strict=True)]
        if halvings < _HALVINGS and not all(map(self._settled, pieces)):
            middle = 0.5 * (a + b)
            self.keep(a, middle, arriving, halvings + 1)
            self.keep(middle, b, arriving, halvings + 1)
            return
        self._starts.append(a)
        self._ends.append(b)
        self._pieces.append(pieces)

    def _settled(self, piece: np.ndarray) -> bool:
        """Whether the last coefficients of a polynomial are within the tolerance."""
        rtol, atol = self._tolerances
        size = np.abs(piece).sum(axis=0)
        return bool(np.all(np.abs(piece[-2:]) <= atol + rtol * size))


def _sent(spec: TransportDelay, t: float) -> float:
    """Return when a delay was given what leaves it at time t."""
    return t - (spec.delay + spec.varied(t))
