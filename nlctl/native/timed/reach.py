"""How far a step may lead without passing over what a function of time alone does.

From rest error control sees nothing of a pulse that all stages of a step lie beside.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...expressions.evaluate import evaluate_expressions
from ...expressions.graph import Expr

CELLS = 8192  # of a run, at whose ends functions are looked at
_PART = 0.5  # of its range: what a function may go up and down by in one step


def reach(terms: Sequence[Expr], p: np.ndarray, span: tuple[float, float]) -> np.ndarray:
    """Return until when a step may lead that begins in a cell of a run (s).

    A step ends where a function has moved by half of its range since its beginning, up and down
    added.  A pulse that is seen at the ends of two cells is seen by the step that comes to it.

    Shapes: `p` (parameters,); returns (cells,).
    """
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
