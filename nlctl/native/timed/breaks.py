"""When conditions of time alone switch, to the last digit or to rounding."""

from collections.abc import Callable, Container, Mapping, Sequence
from functools import partial

import numpy as np

from ...errors import ChatteringError
from ...expressions.evaluate import evaluate_expressions
from ...expressions.functions import COUNTING
from ...expressions.graph import ORDERS, Expr, needed
from ..codegen.rewrite import computed_as_written
from ..rounding.nudged import nudged_columns
from .lines import Lines, NotLines, as_lines, levels_met, switches

_GRID = 8192  # places at which a condition is looked at that is not made of lines
_PER_WAVE = 32  # of these for each wave of the fastest sine in it
_MOST = 2_000_000
_UNSEEN = 1e-3  # of a run: in what is shorter more switches do not count
_NEAR = 1e-9  # of the times: where a switch is sought around where it must be

_PERIODIC = ("remainder", "fmod", "floor_divide")  # by a quotient
_INSIDE = (0.382, 0.73)  # parts of a cell: where it is looked at
_STRAIGHT, _COUNTED = 0.1, 0.25  # of values, and of what counts: how far they may be from a line
_FINEST = 1e-13  # of the times: no cell is cut that is shorter
_PIECES = 16  # of a cell in which they are farther, or count by more than one
_SAME = 1e-12  # of the times: places that are one
_ROUNDINGS = 8  # ways of rounding in which a condition must agree on either side of its switch
_WIDER = 4.0
_AT_POINTS = ("eq", "ne")  # these differ at points alone, or from where something else switches
_CHOOSING = (*ORDERS, *COUNTING, "sign", "heaviside")  # constant from one switch to the next

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
    for condition in (c for c in conditions if not _follows(c, conditions)):
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
                at = _searched(indicator, condition, k, values, (span, fastest))
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


def _follows(condition: Expr, conditions: Container[Expr]) -> bool:
    """Whether a condition changes only where others do: it compares what these have chosen."""
    waiting, seen = list(condition.args), {condition}
    while waiting:
        node = waiting.pop()
        chooses = node in conditions and node.op in _CHOOSING
        if node in seen or not node.varies or chooses or node.op in _AT_POINTS:
            continue
        if node.op in ("leaf", "call", "solve"):
            return False
        seen.add(node)
        waiting += node.args
    return True


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
        if condition.kind == "b" or op in (*COUNTING, "sign", "heaviside"):
            return element(values([condition], t)[0]).astype(float)
        if op in _PERIODIC:
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
    """Return what an element of a condition compares with 0, or counts, as far as that is known."""
    op, args, element = condition.op, condition.args, partial(_element, k, t)
    with np.errstate(all="ignore"):
        if op in ("abs", "sign", "heaviside", *COUNTING) and op not in _PERIODIC:
            return element(values([args[0]], t)[0]) * 1.0 - 0.5 * (op == "rint")
        if op == "copysign":
            return element(values([args[1]], t)[0]) * 1.0
        if len(args) == 2:
            a, b = map(element, values(list(args), t))
            return 2.0 * a / b if op in _PERIODIC else a * 1.0 - b * 1.0
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


def _side(values: np.ndarray, counts: bool) -> np.ndarray:
    """Return between which two switches values lie."""
    return np.floor(values) if counts else np.sign(values)


def _straight(t: np.ndarray, compared: Indicator, counts: bool) -> np.ndarray:
    """Return times between any two of which what is compared is nearly a parabola.

    Also where this is on another side than at the times next to it, however narrow it dips.
    """
    values = compared(t)
    while True:
        length, rise = np.diff(t), np.diff(values)
        inner = [compared(t[:-1] + part * length) for part in _INSIDE]
        with np.errstate(all="ignore"):
            size = np.abs([*inner, values[:-1], values[1:]]).max(axis=0)
            bent = np.abs(np.diff(_side(values, counts))) > (1.0 if counts else 2.0)
            for part, here in zip(_INSIDE, inner, strict=True):
                off = np.abs(here - (values[:-1] + part * rise))
                bent |= off > (_COUNTED if counts else _STRAIGHT * size)
        bent[1:-1] |= bent[2:] | bent[:-2]  # what seems straight beside it may be whole waves
        bent &= length > _FINEST * np.abs(t[[0, -1]]).max()
        if not bent.any() or t.size + _PIECES * bent.sum() > _MOST:
            if length[bent].sum() > _UNSEEN * (t[-1] - t[0]):
                raise _too_many(float(t[:-1][bent][0]))
            return np.union1d(t, _dips(t, values, inner[0], counts))
        parts = np.arange(1, _PIECES) / _PIECES
        more = (t[:-1][bent, None] + length[bent, None] * parts).ravel()
        order = np.argsort(np.concatenate([t, more]), kind="stable")
        t = np.concatenate([t, more])[order]
        values = np.concatenate([values, compared(more)])[order]


def _too_many(t: float) -> ChatteringError:
    """Return the error of a run that a condition of time alone keeps from its end."""
    words = (
        f"a condition of time alone switches too fast to be located from t = {t:.6g} s on, {_MOST} "
        "times or more in the run: make it slower, let a clock sample it, or end the run before"
    )
    return ChatteringError(words, t)


def _dips(t: np.ndarray, ends: np.ndarray, here: np.ndarray, counts: bool) -> np.ndarray:
    """Return times at which a parabola is on another side than at both ends of its cell."""
    c = _INSIDE[0]
    with np.errstate(all="ignore"):
        rise, inner = np.diff(ends), here - ends[:-1]
        bend = (inner - c * rise) / (c * (c - 1.0))
        at = 0.5 - 0.5 * rise / bend
        least = ends[:-1] + at * (rise - bend) + at**2 * bend
        side, other = _side(ends, counts), _side(least, counts)
        crosses = (at > 0.0) & (at < 1.0) & (side[1:] == side[:-1]) & (other != side[1:])
    return t[:-1][crosses] + at[crosses] * np.diff(t)[crosses]


def _exact(indicator: Indicator, places: np.ndarray, span: tuple[float, float]) -> np.ndarray:
    """Return the numbers at which an indicator changes near `places`."""
    if not places.size:
        return places
    width = _NEAR * max(abs(span[0]), abs(span[1]))
    gaps = np.diff(places)
    width = min(width, 0.25 * gaps.min()) if gaps.size else width
    return _bisected(indicator, places - width, places + width, places)


def _searched(
    indicator: Indicator,
    condition: Expr,
    k: int,
    values: Values,
    where: tuple[tuple[float, float], float],  # times of the run, and the fastest sine
) -> np.ndarray:
    """Return where an element of a condition changes."""
    compared = partial(_compared, condition, k, values)
    return _sought(indicator, compared, *where, condition.op in (*COUNTING, *_PERIODIC))


def _sought(
    indicator: Indicator,
    compared: Indicator,
    span: tuple[float, float],
    fastest: float,
    counts: bool = False,  # whether it changes at integers
) -> np.ndarray:
    """Return where an indicator changes on a grid that is fine enough for what is compared."""
    waves = fastest * (span[1] - span[0]) / (2.0 * np.pi)
    count = int(min(max(_GRID, _PER_WAVE * waves), _MOST))
    t = _straight(np.linspace(*span, count + 1), compared, counts)
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
    open_ = np.flatnonzero(changes)
    while open_.size:  # next to 0 numbers are close together
        middle = 0.5 * (low[open_] + high[open_])
        inside = (middle > low[open_]) & (middle < high[open_])
        open_, middle = open_[inside], middle[inside]
        same = indicator(middle) == before[open_]
        low[open_[same]], high[open_[~same]] = middle[same], middle[~same]
    return high[changes] if otherwise is None else np.where(changes, high, otherwise)
