"""A formula as the conjunction of many: what the least margin is the least of.

    rho of always(a & b) = min(rho of always(a), rho of always(b))
    rho of always over [s, e] = min of those over the pieces of [s, e]
    rho of lower <= y <= upper = min of those of both bounds

Each of many has fewer kinks than all of them together: which time and which bound decide changes
only within a piece.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from .formula import Always, And, Band, Formula, horizon


def conjunction(formula: Formula, until: float, pieces: int) -> tuple[tuple[Formula, ...], ...]:
    """Return formulas whose margins have that of `formula` as the least, at the start.

    Windows are cut into `pieces`, up to the time (s) `until` where they have no end; those of the
    same window follow each other in a row of their own.  What is not a conjunction is alone.
    """
    return tuple(_rows(formula, until, pieces))


def _rows(formula: Formula, until: float, pieces: int) -> Iterator[tuple[Formula, ...]]:
    match formula:
        case And():
            for part in formula.parts:
                yield from _rows(part, until, pieces)
        case Band() if np.isfinite([formula.lower, formula.upper]).all():
            yield (replace(formula, lower=-np.inf),)
            yield (replace(formula, upper=np.inf),)
        case Always():
            last = min(formula.end, until - horizon(formula.part))
            cuts = np.linspace(formula.start, last, pieces + 1).tolist()
            windows = list(pairwise(cuts))
            for row in _rows(formula.part, until, 1):
                for part in row:
                    yield tuple(replace(formula, part=part, start=a, end=b) for a, b in windows)
        case _:
            yield (formula,)
