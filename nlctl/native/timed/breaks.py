"""When conditions of time alone switch, to the last digit or to rounding."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from ...expressions.evaluate import evaluate_expressions
from ...expressions.graph import Expr, needed
from ..codegen.rewrite import computed_as_written
from ..rounding.nudged import nudged_columns
from .lines import Lines, NotLines, as_lines, levels_met, switches

_GRID = 8192  # places at which a condition is looked at that is not made of lines
_PER_WAVE = 32  # of these for each wave of the fastest sine in it
_MOST = 2_000_000
_NEAR = 1e-9  # of the times: where a switch is sought around where it must be

_SAME = 1e-12  # of the times: places that are one
_ROUNDINGS = 8  # ways of rounding in which a condition must agree on either side of its switch
_WIDER = 4.0

Values = Callable[[Sequence[Expr], np.ndarray], list[np.ndarray]]
# of times: one integer between two switches and another one behind
Indicator = Callable[[np.ndarray], np.ndarray]


def break_points(
    conditions: Mapping[Expr, Sequence[Expr]],
    p: np.ndarray,
    span: tuple[float, float],
    fastest: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return until when conditions of t alone are as they were, and when they have switched.

    Of each, what it switches with: z - r and -r - z of z^2 < r^2, which is narrow.  Within a run,
    with one parameter vector.  Between the two it depends on how a sine is rounded.
    """
    given = p[:, None]

    def constant(expr: Expr) -> np.ndarray:
        (number,) = evaluate_expressions([expr], {"p": given})
        return np.squeeze(number)

    def values(exprs: Sequence[Expr], t: np.ndarray) -> list[np.ndarray]:
        return _rows(evaluate_expressions(exprs, {"t": t[None, :], "p": given}), t)

    def otherwise(alike: set[Expr], exprs: Sequence[Expr], t: np.ndarray) -> list[np.ndarray]:
        arrays = {"t": t[None, :], "p": given}
        return _rows(nudged_columns(exprs, arrays, t.size, alike), t)

    args = [arg for c in conditions for arg in c.args if arg.size is None]
    lines = as_lines(args, constant, span)
    jumps, until = [np.zeros(0)], [np.zeros(0)]
    for condition in conditions:
        crossed, elements = _known(condition, lines), range(condition.size or 1)
        levels = [partial(_level, condition, k) for k in elements]
        nodes = needed([condition])
        alike = computed_as_written(nodes, condition)
        is_rounded = any(node not in alike and node.args for node in nodes)
        if crossed is None:
            crossed = levels_met(condition, lines, constant)
            if crossed is not None:
                levels = [partial(_how_many, condition)]
        for k, level in enumerate(levels):
            indicator: Indicator = partial(level, values)
            if crossed is None:
                at = _sought(indicator, partial(_compared, condition, k, values), span, fastest)
                for factor in conditions[condition]:
                    of_factor = partial(_factor, factor, values)
                    roots = _sought(partial(_is_below, of_factor), of_factor, span, fastest)
                    at = _with_roots(indicator, at, roots, span)
            else:
                at = _exact(indicator, crossed, span)
            at = at[(at > span[0]) & (at <= span[1])]
            sides = np.nextafter(at, -np.inf), at
            if is_rounded:
                nudged = partial(level, partial(otherwise, alike))
                sides = _beyond_rounding(indicator, nudged, sides, span)
            until.append(sides[0])
            jumps.append(np.minimum(sides[1], span[1]))
    return united(np.concatenate(until), np.concatenate(jumps))


def united(before: np.ndarray, behind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return switches in the order of time; those that meet or overlap are one."""
    order = np.argsort(behind, kind="stable")
    behind = behind[order]
    before = np.minimum.accumulate(before[order][::-1])[::-1]
    begins = np.append(True, before[1:] > behind[:-1])[: before.size]
    return before[begins], behind[np.append(begins[1:], True)[: behind.size]]


def _rows(values: list[np.ndarray], t: np.ndarray) -> list[np.ndarray]:
    return [np.broadcast_to(rows, t.shape) if rows.ndim < 2 else rows for rows in values]


def _beyond_rounding(
    indicator: Indicator,
    otherwise: Indicator,  # the same, of which each value is rounded in a way of its own
    sides: tuple[np.ndarray, np.ndarray],
    span: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Return times before and behind switches at which a condition has one value, however rounded.

    A memory that has seen the other side too early, or too late, goes the wrong way for good.
    """
    at = sides[1]
    most = np.full(at.size, _NEAR * max(map(abs, span)))
    for gaps in (np.diff(at, prepend=-np.inf), np.diff(at, append=np.inf)):
        most = np.minimum(most, 0.25 * gaps)
    found = []
    for side, way in zip(sides, (-1.0, 1.0), strict=True):
        value, width = indicator(side), np.zeros(at.size)
        sure, open_ = side.copy(), np.arange(at.size)
        while open_.size:
            tried = at[open_] + way * width[open_]
            same = otherwise(np.repeat(tried, _ROUNDINGS)).reshape(-1, _ROUNDINGS)
            agree = np.all(same == value[open_, None], axis=1)
            sure[open_[agree]] = tried[agree]
            width = np.maximum(_WIDER * width, np.spacing(np.abs(at)))
            open_ = open_[~agree]
            open_ = open_[width[open_] <= most[open_]]
        found.append(sure)
    return found[0], found[1]


def _known(condition: Expr, lines: dict[Expr, Lines]) -> np.ndarray | None:
    """Return about when a condition switches, None if that does not follow from lines."""
    if not all(arg in lines for arg in condition.args):
        return None
    try:
        return np.unique(switches(condition, lines))
    except NotLines:
        return None


def _how_many(condition: Expr, values: Values, t: np.ndarray) -> np.ndarray:
    """Return how many elements of a condition hold."""
    return np.asarray(values([condition], t)[0].sum(axis=0) * 1.0)


def _level(condition: Expr, k: int, values: Values, t: np.ndarray) -> np.ndarray:
    """Return the indicator of an element."""
    op, args, element = condition.op, condition.args, partial(_element, k, t)
    with np.errstate(all="ignore"):
        if condition.kind == "b" or op in ("floor", "ceil", "trunc", "rint", "sign", "heaviside"):
            return element(values([condition], t)[0]).astype(float)
        if op in ("remainder", "fmod"):
            rest, by = map(element, values([condition, args[1]], t))
            return (np.abs(rest) > 0.5 * np.abs(by)).astype(float)
        if op in ("minimum", "maximum"):
            a, b = map(element, values(list(args), t))
            return (a < b).astype(float)
        a = element(values([args[1] if op == "copysign" else args[0]], t)[0])
        return (a < 0.0).astype(float)


def _element(k: int, t: np.ndarray, array: np.ndarray) -> np.ndarray:
    """Return one row of values at some times."""
    rows = array if array.ndim == 2 else array[None]
    return np.broadcast_to(rows[k if len(rows) > 1 else 0], t.shape)


def _compared(condition: Expr, k: int, values: Values, t: np.ndarray) -> np.ndarray:
    """Return what an element of a condition compares with 0, as far as that is a difference."""
    args = condition.args
    with np.errstate(all="ignore"):
        if condition.op in ("abs", "sign", "heaviside"):
            return _element(k, t, values([args[0]], t)[0])
        if len(args) == 2 and condition.op not in ("remainder", "fmod", "copysign"):
            a, b = (_element(k, t, array) for array in values(list(args), t))
            return a * 1.0 - b * 1.0
    return np.ones(t.size)


def _factor(factor: Expr, values: Values, t: np.ndarray) -> np.ndarray:
    """Return what a condition switches with."""
    with np.errstate(all="ignore"):
        return _element(0, t, values([factor], t)[0])


def _is_below(values: Indicator, t: np.ndarray) -> np.ndarray:
    """Return the indicator of a function below 0."""
    return (values(t) < 0.0).astype(float)


def _with_roots(
    indicator: Indicator, at: np.ndarray, roots: np.ndarray, span: tuple[float, float]
) -> np.ndarray:
    """Return where an indicator changes, also next to roots of what it is made of."""
    if not roots.size:
        return at
    scale = max(map(abs, span))
    width = min(_NEAR * scale, 0.25 * np.diff(roots).min(initial=np.inf))
    more = _bisected(indicator, roots - width, roots + width, None)
    apart = np.abs(more[:, None] - at).min(axis=1, initial=np.inf)
    return np.union1d(at, more[apart > _SAME * scale])


def _dips(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return times at which a parabola through three values is on another side than they are.

    A quadratic function is that parabola, however narrow it dips.
    """
    before, here, behind = values[:-2], values[1:-1], values[2:]
    with np.errstate(all="ignore"):
        slope, bend = 0.5 * (behind - before), behind - 2.0 * here + before
        at, least = -slope / bend, here - 0.5 * slope**2 / bend
        crosses = (np.abs(at) <= 1.0) & (here * before > 0.0) & (here * behind > 0.0)
        crosses &= least * here < 0.0
    return t[1:-1][crosses] + at[crosses] * (t[1] - t[0])


def _exact(indicator: Indicator, places: np.ndarray, span: tuple[float, float]) -> np.ndarray:
    """Return the numbers at which an indicator changes near `places`."""
    if not places.size:
        return places
    width = _NEAR * max(abs(span[0]), abs(span[1]))
    gaps = np.diff(places)
    width = min(width, 0.25 * gaps.min()) if gaps.size else width
    return _bisected(indicator, places - width, places + width, places)


def _sought(
    indicator: Indicator, compared: Indicator, span: tuple[float, float], fastest: float
) -> np.ndarray:
    """Return where an indicator changes on a grid that is fine enough for its fastest sine."""
    waves = fastest * (span[1] - span[0]) / (2.0 * np.pi)
    count = int(min(max(_GRID, _PER_WAVE * waves), _MOST))
    t = np.linspace(*span, count + 1)
    t = np.union1d(t, _dips(t, compared(t)))
    level = indicator(t)
    at = np.flatnonzero(level[1:] != level[:-1])
    return _bisected(indicator, t[at], t[at + 1], None)


def _bisected(
    indicator: Indicator, low: np.ndarray, high: np.ndarray, otherwise: np.ndarray | None
) -> np.ndarray:
    """Halve brackets down to neighbouring numbers; `otherwise` where nothing changes in one."""
    if not low.size:
        return low
    before, after = indicator(low), indicator(high)
    changes = before != after
    low, high = low.copy(), high.copy()
    for _ in range(1100):
        middle = 0.5 * (low + high)
        inside = (middle > low) & (middle < high) & changes
        if not inside.any():
            break
        same = indicator(middle) == before
        low = np.where(inside & same, middle, low)
        high = np.where(inside & ~same, middle, high)
    return high[changes] if otherwise is None else np.where(changes, high, otherwise)
