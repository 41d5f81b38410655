"""What is known before a run of the functions of time alone in a program."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...expressions.dependence import rows_read
from ...expressions.evaluate import evaluate_expressions
from ...expressions.graph import Expr, needed
from ..equations.located import Conditions
from .breaks import break_points, united

_KEPT = 256  # parameter vectors
CELLS = 8192  # of a run, at whose ends functions are looked at
_PART = 0.5  # of its range: what a function may go up and down by in one step


@dataclass(frozen=True, kw_only=True)
class Ahead:
    """When functions of time alone switch (s), and the longest steps."""

    until: np.ndarray  # increasing times: the last before each switch
    breaks: np.ndarray  # and the first behind it
    longest: float  # half a wave of the fastest sine
    reach: np.ndarray  # shape (cells,): see `reach`


@dataclass(frozen=True, kw_only=True, eq=False)
class OfTime:
    """Functions of time alone in a program."""

    conditions: Conditions  # what the program switches at
    # what has been found of them, by the times of a run and the parameters that they depend on
    known: dict[tuple[tuple[float, float], bytes], Ahead] = field(default_factory=dict)

    @cached_property
    def parameters(self) -> np.ndarray:
        """Places of the parameters that they depend on."""
        found, places = self.conditions, set[int]()
        waves = (slope for wave in found.waves for slope in wave)
        switches = (*found.of_time, *found.declared_of_time.values())
        for node in needed([*switches, *found.pulses, *waves]):
            if node.op == "leaf" and node.data[0] == "p":
                places.update(rows_read(node))
        return np.array(sorted(places), dtype=np.int64)


def ahead(
    timed: OfTime, p: np.ndarray, times: np.ndarray, max_step: float
) -> dict[str, np.ndarray]:
    """Return what integrators take of that for each column of `p`."""
    count = p.shape[1]
    span = float(times[0]), float(times[-1])
    own = [_of(timed, p[:, j], span) for j in range(count)]
    lines = [*timed.conditions.declared_of_time.values()]
    if lines:
        until, behind = line_switches(lines, p, span)
        own = [_with_more(one, until[:, j], behind[:, j]) for j, one in enumerate(own)]
    jumps = np.full((2, count, max(one.breaks.size for one in own)), np.inf)
    limits = np.full((count, max(one.reach.size for one in own)), np.inf)
    for j, one in enumerate(own):
        jumps[:, j, : one.breaks.size] = one.until, one.breaks
        if one.reach.size:
            limits[j] = one.reach
    longest = np.minimum(max_step, np.array([one.longest for one in own]))
    return {"until": jumps[0], "jumps": jumps[1], "longest": longest, "reach": limits}


def _of(timed: OfTime, p: np.ndarray, span: tuple[float, float]) -> Ahead:
    """Return it for one parameter vector, from what is known of the program already."""
    cache, key, conditions = timed.known, (span, p[timed.parameters].tobytes()), timed.conditions
    if key not in cache:
        if len(cache) >= _KEPT:
            cache.clear()
        fastest = _fastest(conditions.waves, p)
        pulses = reach(conditions.pulses, p, span) if conditions.pulses else np.zeros(0)
        until, breaks = break_points(conditions.of_time, p, span, fastest)
        longest = np.pi / fastest if fastest else np.inf
        cache[key] = Ahead(until=until, breaks=breaks, longest=longest, reach=pulses)
    return cache[key]


def _with_more(one: Ahead, until: np.ndarray, behind: np.ndarray) -> Ahead:
    """Return what is known of a member with more switches, those that are finite."""
    switches = np.isfinite(behind)
    sides = (one.until, until[switches]), (one.breaks, behind[switches])
    before, after = united(*map(np.concatenate, sides))
    return replace(one, until=before, breaks=after)


def _fastest(waves: tuple[tuple[Expr, ...], ...], p: np.ndarray) -> float:
    """Return the largest sum of angular frequencies (rad/s)."""
    slopes = [slope for wave in waves for slope in wave]
    values = evaluate_expressions(slopes, {"p": p[:, None]})
    largest = iter(float(np.abs(each).max(initial=0.0)) for each in values)
    sums = [sum(next(largest) for _ in wave) for wave in waves]
    return max((each for each in sums if np.isfinite(each)), default=0.0)


def reach(terms: Sequence[Expr], p: np.ndarray, span: tuple[float, float]) -> np.ndarray:
    """Return until when a step may lead that begins in a cell of a run (s), shape (cells,)."""
    # From rest error control sees nothing of a pulse that all stages of a step lie next to.  A step
    # ends where a function has moved by half of its range since its beginning, up and down added: a
    # pulse that is seen at the ends of two cells is seen by the step that comes to it.
    t = np.linspace(*span, CELLS + 1)
    found = evaluate_expressions(terms, {"t": t[None, :], "p": p[:, None]})
    limit = np.full(CELLS, np.inf)
    for values in found:
        for row in np.atleast_2d(values):
            if row.size == t.size:
                limit = np.minimum(limit, _of_values(t, row))
    return limit if np.isfinite(limit).any() else np.zeros(0)


def _of_values(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the limits that one function's values give."""
    values = np.where(np.isfinite(values), values, 0.0)
    extent = np.ptp(values)
    if extent <= 1e-12 * np.abs(values).max(initial=0.0):
        return np.full(t.size - 1, np.inf)
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(values)))])
    k = np.searchsorted(moved, moved[:-1] + _PART * extent, side="left")
    return np.where(k < t.size, t[np.minimum(k, t.size - 1)], np.inf)


_NEAR = 4.0  # distances between neighbouring numbers: how far a line's root may be wrong


def line_switches(
    functions: Sequence[Expr], p: np.ndarray, span: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return until when lines are on one side of 0 and from when on the other, inf for never.

    Both of shape (lines, members), with the parameters of each member in a column of `p`.
    """
    until, behind = np.full((2, len(functions), p.shape[1]), np.inf)
    for k, function in enumerate(functions):
        until[k], behind[k] = _switches(function, p, span)
    return until, behind


def _switches(
    function: Expr, p: np.ndarray, span: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    def at(t: np.ndarray) -> np.ndarray:
        (values,) = evaluate_expressions([function], {"t": t[None, :], "p": p})
        return np.broadcast_to(values, (1, t.size))[0]

    begin, end = (np.full(p.shape[1], t) for t in span)
    first, last = at(begin), at(end)
    with np.errstate(all="ignore"):
        root = begin - first * ((end - begin) / (last - first))
    switches = (first != 0.0) & (np.sign(first) != np.sign(last)) & np.isfinite(root)
    near = _NEAR * np.spacing(np.abs(np.where(switches, root, 1.0)))
    low = np.where(switches, np.clip(root - near, begin, end), begin)
    high = np.where(switches, np.clip(root + near, begin, end), end)
    low = np.where(np.sign(at(low)) == np.sign(first), low, begin)
    high = np.where(np.sign(at(high)) == np.sign(last), high, end)
    high = np.where(switches, high, low)  # nothing to search for
    until = _last(lambda t: np.sign(at(t)) == np.sign(first), low, high)
    behind = np.nextafter(_last(lambda t: np.sign(at(t)) != np.sign(last), low, high), np.inf)
    never = np.where(switches, 0.0, np.inf)
    return until + never, np.minimum(behind, end) + never


def _last(
    holds: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the last number of each bracket for which something holds, that does at its start."""
    while True:
        middle = 0.5 * (low + high)
        inside = (middle > low) & (middle < high)
        if not inside.any():
            return low
        kept = holds(middle)
        low = np.where(inside & kept, middle, low)
        high = np.where(inside & ~kept, middle, high)
