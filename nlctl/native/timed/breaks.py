"""When conditions of time alone switch, to the last digit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ...expressions.evaluate import evaluate_expressions
from ...expressions.graph import Expr
from .lines import Lines, NotLines, as_lines, levels_met, switches

_GRID = 8192  # places at which a condition is looked at that is not made of lines
_PER_WAVE = 32  # of these for each wave of the fastest sine in it
_MOST = 2_000_000
_NEAR = 1e-9  # of the times: where a switch is sought around where it must be

Values = Callable[[Sequence[Expr], np.ndarray], list[np.ndarray]]
# of times: one integer between two switches and another one behind
Indicator = Callable[[np.ndarray], np.ndarray]


def break_points(
    conditions: Sequence[Expr], p: np.ndarray, span: tuple[float, float], fastest: float
) -> np.ndarray:
    """Return when conditions of t alone switch within a run with one parameter vector."""

    def values(exprs: Sequence[Expr], t: np.ndarray) -> list[np.ndarray]:
        numbers = evaluate_expressions(exprs, {"t": t[None, :], "p": p[:, None]})
        return [np.broadcast_to(each, t.shape) if each.ndim < 2 else each for each in numbers]

    def constant(expr: Expr) -> np.ndarray:
        (number,) = evaluate_expressions([expr], {"p": p[:, None]})
        return np.squeeze(number)

    args = [arg for c in conditions for arg in c.args if arg.size is None]
    lines = as_lines(args, constant, span)
    instants = [np.zeros(0)]
    for condition in conditions:
        crossed, elements = _known(condition, lines), range(condition.size or 1)
        indicators: list[Indicator] = [partial(_level, condition, values, k) for k in elements]
        if crossed is None:
            crossed = levels_met(condition, lines, constant)
            if crossed is not None:  # how many elements hold
                indicators = [lambda t, c=condition: values([c], t)[0].sum(axis=0) * 1.0]
        for indicator in indicators:
            if crossed is None:
                instants.append(_sought(indicator, span, fastest))
            else:
                instants.append(_exact(indicator, crossed, span))
    every = np.unique(np.concatenate(instants))
    return every[(every > span[0]) & (every <= span[1])]


def _known(condition: Expr, lines: dict[Expr, Lines]) -> np.ndarray | None:
    """Return about when a condition switches, None if that does not follow from lines."""
    if not all(arg in lines for arg in condition.args):
        return None
    try:
        return np.unique(switches(condition, lines))
    except NotLines:
        return None


def _level(condition: Expr, values: Values, k: int, t: np.ndarray) -> np.ndarray:
    """Return the indicator of an element."""
    op, args = condition.op, condition.args

    def element(array: np.ndarray) -> np.ndarray:
        rows = array if array.ndim == 2 else array[None]
        return np.broadcast_to(rows[k if len(rows) > 1 else 0], t.shape)

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


def _exact(indicator: Indicator, places: np.ndarray, span: tuple[float, float]) -> np.ndarray:
    """Return the numbers at which an indicator changes near `places`."""
    if not places.size:
        return places
    width = _NEAR * max(abs(span[0]), abs(span[1]))
    gaps = np.diff(places)
    width = min(width, 0.25 * gaps.min()) if gaps.size else width
    return _bisected(indicator, places - width, places + width, places)


def _sought(indicator: Indicator, span: tuple[float, float], fastest: float) -> np.ndarray:
    """Return where an indicator changes on a grid that is fine enough for its fastest sine."""
    waves = fastest * (span[1] - span[0]) / (2.0 * np.pi)
    count = int(min(max(_GRID, _PER_WAVE * waves), _MOST))
    t = np.linspace(*span, count + 1)
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
