"""What a search for gains had to do otherwise, or could not do, in a sentence each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..wording import counted
from .worth import LOST_MARGIN, Runs, Worth

_AT_BOUND = 1e-6  # of the box


def notes(runs: Runs, before: Worth, best: np.ndarray) -> tuple[str, ...]:
    """Return all of them."""
    parts = (_start(runs, before), _flat(runs), _idle(runs), _at_bounds(runs, best))
    return (*(note for part in parts for note in part), *_without_derivatives(runs))


def _start(runs: Runs, before: Worth) -> Iterator[str]:
    """Yield what is to be said of the gains to start from."""
    if np.any(before.margins <= LOST_MARGIN) or (before.has_cost and not np.isfinite(before.cost)):
        yield "with the gains to start from a run does not reach its end: other starts were taken"
    for key, names in runs.at_first.items():
        yield (
            f"the start is at a kink of '{key}' by {', '.join(names)}: its derivatives to both "
            "sides differ there"
        )
    if runs.best()[1].rank <= before.rank:
        yield "nothing better than the start was found"


def _flat(runs: Runs) -> Iterator[str]:
    """Yield which requirements none of the gains moves."""
    tables = np.stack([worth.table for _, _, _, worth in runs.history])
    for j, metric in enumerate(runs.problem.metrics):
        values = tables[:, :, j]
        if runs.slope_of[j] == 0.0 and np.all(np.ptp(values, axis=0) == 0.0):
            yield (
                f"'{metric.key}' is flat: it was {values.min():.4g} at all "
                f"{counted(len(values), 'choice')} of gains, and had no slope"
            )


def _idle(runs: Runs) -> Iterator[str]:
    """Yield which parameters nothing depends on."""
    names = [n for n, most in zip(runs.problem.names, runs.moved, strict=True) if most == 0.0]
    if names:
        are = "are" if len(names) > 1 else "is"
        yield f"nothing that is asked depends on {', '.join(names)}, which {are} left at the start"


def _at_bounds(runs: Runs, cube: np.ndarray) -> Iterator[str]:
    """Yield which gains end at a bound."""
    problem = runs.problem
    ends = ((cube <= _AT_BOUND, problem.low), (cube >= 1.0 - _AT_BOUND, problem.high))
    at_bounds = [
        f"{problem.names[j]} at {bound[j]:g}"
        for is_there, bound in ends
        for j in np.flatnonzero(is_there & (runs.moved > 0.0))
    ]
    if at_bounds:
        yield f"the search ended at a bound, which may be too narrow: {', '.join(at_bounds)}"


def _without_derivatives(runs: Runs) -> Iterator[str]:
    """Yield where differences took the place of derivatives."""
    if runs.why:
        yield f"differences of runs took the place of derivatives: {runs.why}"
    for why, count in runs.lacking.items():
        yield (
            f"differences of runs took the place of derivatives in {counted(count, 'run')}: {why}"
        )
    for key, count in runs.kinked.items():
        yield (
            f"'{key}' had a kink at {counted(count, 'choice')} of gains: the middle of the "
            "derivatives to both sides was taken"
        )
