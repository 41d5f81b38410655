"""Memory of runs that are over, for the next run: to lay it out takes longer than a short run."""

from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from .cache import Cache
from .integrate.memory import named_arrays
from .integrate.state import new_lanes
from .integrate.workspace import Work, new_work

_MOST = 2**20  # bytes of a workspace that is kept until the next run
_KEPT = 4  # workspaces: of threads, and of runs with other times or methods in turn


class Spare(NamedTuple):
    """A workspace, which one run at a time has."""

    sizes: tuple[Any, ...]  # what it was laid out for
    work: Work
    arrays: tuple[np.ndarray, ...]  # those in it that are 0 when a run begins
    is_small: bool  # enough to be kept until the next run


def workspace(cache: Cache, x0: np.ndarray, times: np.ndarray, *sizes: Any) -> Spare:
    """Return the workspace of a run, see `new_work`: that of a run that is over, if it fits."""
    sizes = (x0.shape, times.size, *sizes)
    spare = _fitting(cache.of(Spare), sizes)
    if spare is None:
        work = new_work(x0, times, *sizes[2:])
        # of those that are 0 when a run begins flat ones are the same memory; `v` has unit vectors
        arrays = tuple(
            array
            for (*_, name), array in named_arrays(work)
            if array.size
            and name not in ("lanes", "samples", "y", "v")
            and not name.endswith("_flat")
        )
        return Spare(sizes, work, arrays, sum(array.nbytes for array in arrays) <= _MOST)
    for array in spare.arrays:
        array.fill(0)
    work = spare.work
    work.lanes[:], work.x[:] = new_lanes(times, x0.shape[1]), x0
    work.samples.fill(np.nan)
    work.y.fill(np.nan)
    return spare


def _fitting(kept: list[Spare], sizes: tuple[Any, ...]) -> Spare | None:
    """Take the workspace of these sizes, if one is kept."""
    with suppress(IndexError):  # another thread has just taken the last
        for _ in range(len(kept)):
            spare = kept.pop(0)
            if spare.sizes == sizes:
                return spare
            kept.append(spare)
    return None


def give_back(cache: Cache, spare: Spare) -> None:
    """Keep the workspace of a run that is over, and of which nothing is read any more."""
    kept = cache.of(Spare)
    if spare.is_small:
        kept.append(spare)
        del kept[:-_KEPT]  # those that have not been asked for
