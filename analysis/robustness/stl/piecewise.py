"""Piecewise linear functions of time, and their least and largest values over sliding windows.

The trace of a formula is one: signals are connected by lines between samples, and minimum, maximum
and windows of piecewise linear functions are piecewise linear again, so nothing is lost on the way.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...metrics.compiled import SAMPLE_FUNCTIONS, as_row


@dataclass(frozen=True)
class Trace:
    """A continuous function, linear between its points."""

    t: np.ndarray  # (m,): increasing times (s); one is enough
    y: np.ndarray  # (m,)
    jump: float = 0.0  # an interval (s) that is not longer is a jump: only its ends are values

    def __neg__(self) -> "Trace":
        return Trace(self.t, -self.y, self.jump)

    def at(self, t: np.ndarray) -> np.ndarray:
        """Values at times between the first and the last; within a jump those behind it."""
        values = np.interp(t, self.t, self.y)
        if self.jump:
            k = np.clip(np.searchsorted(self.t, t, "left"), 1, self.t.size - 1)
            jumps = (self.t[k] - self.t[k - 1] <= self.jump) & (t > self.t[k - 1])
            values = np.where(jumps, self.y[k], values)
        return values

    def between(self, low: float, high: float) -> "Trace":
        """The part with low <= t <= high."""
        i, j = np.searchsorted(self.t, low, "right"), np.searchsorted(self.t, high, "left")
        ends = np.array([low, high] if low < high else [low])
        first, last = np.split(self.at(ends), [1])
        t = np.concatenate([ends[:1], self.t[i:j], ends[1:]])
        return Trace(t, np.concatenate([first, self.y[i:j], last]), self.jump)

    def refined(self, t: np.ndarray) -> "Trace":
        """The same function with more points."""
        if t is self.t:
            return self
        t = np.union1d(self.t, t)
        return Trace(t, self.at(t), self.jump)


_NONE = np.empty(0)


def _path(t: Any, y: Any, breaks: Any, apart: float) -> tuple[np.ndarray, np.ndarray]:
    return SAMPLE_FUNCTIONS.functions["path"](*map(as_row, (t, y, breaks)), apart)


def _vertices(t: Any, y: Any, breaks: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return SAMPLE_FUNCTIONS.functions["turning_points"](*map(as_row, (t, y, breaks)))


def with_vertices(
    t: np.ndarray, y: np.ndarray, breaks: np.ndarray | None = None, apart: float = 0.0
) -> Trace:
    """Return a signal between samples: lines, through the extremes that samples support."""
    # Peaks between samples are then seen as `nlctl.analysis.metrics.highest` sees them. Where
    # breaks are known, also that there are none, it is the path of `nlctl.analysis.metrics.curves`:
    # curves between them, and jumps, each `apart` (s) before and after its break.
    if breaks is not None:
        return Trace(*_path(t, y, breaks, apart), jump=3 * apart)
    at, place, value = _vertices(t, y, _NONE)
    return Trace(np.insert(t, at, place), np.insert(y, at, value)) if at.size else Trace(t, y)


def extremes(
    t: np.ndarray,
    y: np.ndarray,
    low: float,
    high: float,
    breaks: np.ndarray | None = None,
    apart: float = 0.0,
) -> tuple[float, float]:
    """Return the least and the largest value of a signal between samples in [low, high]."""
    i, j = np.searchsorted(t, low, "left"), np.searchsorted(t, high, "right")
    known = _NONE if breaks is None else breaks
    if known.size or t[i] != low or t[j - 1] != high:  # ends between samples
        inside = with_vertices(t, y, breaks, apart).between(low, high).y
    else:
        inside = y[i:j]
    _, place, value = _vertices(t, y, known)
    inside = np.concatenate([inside, value[(place > low) & (place < high)]])
    return float(np.min(inside)), float(np.max(inside))


def crossings(t0, t1, a0, a1, b0, b1, jump=0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return where two lines cross inside an interval, and in which intervals they do."""
    # Shapes: `t0, t1` (n,), `a0, a1, b0, b1` (n,).
    d0, d1 = a0 - b0, a1 - b1
    k = np.nonzero((((d0 < 0) & (d1 > 0)) | ((d0 > 0) & (d1 < 0))) & (t1 - t0 > jump))[0]
    share = 1 / (1 - d1[k] / d0[k])
    return t0[k] + share * (t1[k] - t0[k]), k


def higher(one: Trace, other: Trace) -> Trace:
    """Return the larger of two functions over the same interval."""
    one, other = one.refined(other.t), other.refined(one.t)
    t, a, b = one.t, one.y, other.y
    jump = max(one.jump, other.jump)
    at, k = crossings(t[:-1], t[1:], a[:-1], a[1:], b[:-1], b[1:], jump)
    y = np.maximum(a, b)
    if not k.size:
        return Trace(t, y, jump)
    return Trace(np.insert(t, k + 1, at), np.insert(y, k + 1, one.at(at)), jump)


def largest(part: Trace, low: float, high: float, start: float, end: float) -> Trace:
    """Return max of `part` over [t + start, t + end], for t in [low, high]."""
    last = part.t[-1]
    if low == high:  # one window: nothing slides
        window = part.between(low + start, min(low + end, last))
        return Trace(np.array([low]), np.max(window.y, keepdims=True), part.jump)
    events = np.concatenate([part.t - start, part.t - end])
    events = np.unique(np.append(events[(events > low) & (events < high)], [low, high]))
    t0, t1 = events[:-1], events[1:]

    def ends(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return part.at(t + start), part.at(np.minimum(t + end, last))

    middle = (t0 + t1) / 2
    inner = _inner_largest(part, middle + start, np.minimum(middle + end, last))
    (a0, b0), (a1, b1) = ends(t0), ends(t1)
    times, values = [t0, t1], [np.maximum(a0, b0), np.maximum(a1, b1)]
    intervals = [np.arange(t0.size)] * 2
    for p0, p1, q0, q1 in ((a0, a1, b0, b1), (a0, a1, inner, inner), (b0, b1, inner, inner)):
        t, k = crossings(t0, t1, p0, p1, q0, q1, part.jump)
        times.append(t)
        values.append(np.maximum(*ends(t)))
        intervals.append(k)
    t, first = np.unique(np.concatenate(times), return_index=True)
    y = np.maximum(np.concatenate(values), inner[np.concatenate(intervals)])
    return Trace(t, y[first], part.jump)


def _inner_largest(part: Trace, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Largest value at the points strictly between; -inf where there is none."""
    i, j = np.searchsorted(part.t, low, "right"), np.searchsorted(part.t, high, "left")
    pairs = np.stack([i, np.maximum(j, i)], axis=1).ravel()
    padded = np.append(part.y, -np.inf)  # a pair may point one past the end
    return np.where(j > i, np.maximum.reduceat(padded, pairs)[::2], -np.inf)


def pointwise_maximum(traces: list[Trace]) -> Trace:
    """Return the largest of several functions over the same interval."""
    result = traces[0]
    for trace in traces[1:]:
        result = higher(result, trace)
    return result
