"""Straight lines of t that blocks declare, as a fault's beginning: when they switch, by member."""

from collections.abc import Callable, Sequence

import numpy as np

from ...expressions.evaluate import evaluate_expressions
from ...expressions.graph import Expr

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
