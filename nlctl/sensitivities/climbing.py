"""Searches from one start: the least margin by linear programs, a cost by SLSQP.

The least of many margins has a kink at its highest point, where several are equally low, so that
a method for smooth functions creeps there.  Each step is a linear program (HiGHS, by
`scipy.optimize.linprog`) for all margins at once, within a reach that grows and shrinks with
what steps have kept of what they promised (Madsen: An algorithm for minimax solution of
overdetermined systems of non-linear equations, J. Inst. Maths Applics 16 (1975) 321-328).  Only
gains that matter move, those of the shortest step with nine tenths of that promise: one that brings
next to nothing would else go to the end of the reach, where slopes say nothing any more.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import linprog, minimize

from .worth import LOST_MARGIN, Worth

_REACH = 0.5  # of the first step, in widths of the box
_SHORTEST = 2e-3  # of a reach
_KEPT = (0.1, 0.75)  # of what a step has promised: less shortens the reach, more doubles it
_REMEMBERED = 2  # choices of gains whose slopes count as well
_SHARE = 0.9  # of the most that a step within reach promises: what gains that matter bring
_MOVED = 1e-9  # of the width of the box
_ENOUGH = 5e-4  # of a margin, or of a cost: less is no progress
_ROOM = 1e-3  # that a cost leaves to all margins, so that rounding violates none
_PATIENCE = 8  # choices of gains without progress, after which SLSQP ends

WorthOf = Callable[[np.ndarray], Worth]


def raise_least_margin(worth_of: WorthOf, start: np.ndarray) -> None:
    """Go where the least margin is as high as it gets."""
    at, here, reach = start, worth_of(start), _REACH
    others: list[tuple[np.ndarray, Worth]] = []
    while reach > _SHORTEST:
        step, promised = _step(at, here, others, reach)
        if promised <= _ENOUGH * (1.0 + abs(here.least)):
            if not others:
                return
            others, reach = [], 0.5 * reach
            continue
        there = np.clip(at + step, 0.0, 1.0)
        new, length = worth_of(there), float(np.abs(step).max())
        kept = (new.least - here.least) / promised
        if kept < _KEPT[0]:
            reach = 0.5 * length
        elif kept > _KEPT[1] and length > 0.9 * reach:
            reach = min(2.0 * reach, 1.0)
        if new.least > here.least:
            others.append((at, here))
            at, here = there, new
        else:
            others.append((there, new))
        others = others[-_REMEMBERED:]


def _step(
    at: np.ndarray, here: Worth, others: list[tuple[np.ndarray, Worth]], reach: float
) -> tuple[np.ndarray, float]:
    """Return the best step within reach of the gains that matter, if margins were linear."""
    # Slopes of other choices of gains count, too, as far as they do not say less of this one than
    # what is known of it.
    rows, limits, k = [], [], at.size
    for place, worth in [(at, here), *others]:
        rows.append(np.hstack([-worth.slopes, worth.slopes, np.ones((len(worth.slopes), 1))]))
        limits.append(np.maximum(worth.parts + worth.slopes @ (at - place), here.parts))
    lines, room = np.vstack(rows), np.concatenate(limits)
    bounds = [min(reach, max(1.0 - x, 0.0)) for x in at] + [min(reach, max(x, 0.0)) for x in at]
    first = _shortest(lines, room, bounds, here.least, _SHARE)
    if first is None:
        return np.zeros(k), 0.0
    moved = np.where(first[:-1] > _MOVED, bounds, 0.0).tolist()
    taken = _shortest(lines, room, moved, here.least, 1.0)
    taken = first if taken is None else taken
    return taken[:k] - taken[k : 2 * k], float(taken[-1]) - here.least


def _shortest(
    lines: np.ndarray, room: np.ndarray, bounds: list[float], before: float, share: float
) -> np.ndarray | None:
    """Return the shortest step, up and down, with a share of the most, and its least margin."""
    ways, count = [(0.0, most) for most in bounds], len(bounds)
    highest = linprog([*np.zeros(count), -1.0], lines, room, bounds=[*ways, (None, None)])
    if not (highest.success and highest.x[-1] > before):
        return None
    least = before + share * (float(highest.x[-1]) - before)
    shortest = linprog([*np.ones(count), 0.0], lines, room, bounds=[*ways, (least, None)])
    return shortest.x if shortest.success else highest.x


class _SettledError(Exception):
    """Nothing better has been found for some time."""


def lower_cost(worth_of: WorthOf, start: np.ndarray) -> None:
    """Go where the cost is as low as margins allow."""
    cached, first = _Patient(worth_of), worth_of(start)
    scale = abs(first.cost) or 1.0 if np.isfinite(first.cost) else 1.0
    within: Any = {
        "type": "ineq", "fun": lambda x: cached(x).parts - _ROOM, "jac": lambda x: cached(x).slopes
    }  # fmt: skip
    try:
        minimize(
            lambda x: cached(x).cost / scale if np.isfinite(cached(x).cost) else -LOST_MARGIN,
            start, jac=lambda x: cached(x).cost_slopes / scale, method="SLSQP",
            bounds=[(0.0, 1.0)] * start.size, constraints=[within] if first.parts.size else [],
            options={"ftol": 1e-6, "maxiter": 1000},
        )  # fmt: skip
    except _SettledError:
        return


class _Patient:
    """What gains are worth, asked for several times in a row, as long as it gets better."""

    def __init__(self, worth_of: WorthOf) -> None:
        self.worth_of = worth_of
        self.at = b""
        self.last: Worth | None = None
        self.best = (-np.inf, -np.inf)
        self.waited = 0

    def __call__(self, cube: np.ndarray) -> Worth:
        cube = np.clip(cube, 0.0, 1.0)
        if self.last is None or cube.tobytes() != self.at:
            self.last, self.at = self.worth_of(cube), cube.tobytes()
            rank = self.last.rank
            pairs = zip(rank, self.best, (1.0, 0.0), strict=True)
            better = any(new > old + _ENOUGH * (abs(old) + size) for new, old, size in pairs
                         if np.isfinite(old)) or self.best[0] == -np.inf  # fmt: skip
            self.best, self.waited = max(rank, self.best), 0 if better else self.waited + 1
            if self.waited >= _PATIENCE:
                raise _SettledError
        return self.last
