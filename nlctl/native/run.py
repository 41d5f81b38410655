"""A run in machine code while it lasts, and the memory of runs that are over.

To lay memory out takes longer than a short run: the next run has that of one before.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .along import Along
from .cache import Cache
from .chattering.steps import Jump
from .integrate.state import new_lanes
from .integrate.workspace import Work, new_work
from .machine.evaluations import Machine

_MOST = 2**20  # bytes of a workspace that is kept until the next run
_THREADS = 4  # runs at the same time whose workspaces are kept


class Spare(NamedTuple):
    """A workspace, which one run at a time has."""

    sizes: tuple[Any, ...]  # what it was laid out for
    work: Work
    arrays: tuple[np.ndarray, ...]  # those in it that are 0 when a run begins
    is_small: bool  # enough to be kept until the next run


@dataclass(frozen=True, kw_only=True)
class Run:
    """Members that are integrated in a batch, and all arrays that this needs."""

    machine: Machine
    task: Any  # see `integrate.workspace`
    work: Any
    # exact derivatives, if the stiff method has asked for them and there are any
    along: Along | None = None
    # of members that chatter, by their lanes: where
    jumps: Mapping[int, Jump] = field(default_factory=dict)
    # with Taylor's method, if it has had its turn: see `nlctl.native.taylor.turns`
    series: Any = None
    spare: Spare | None = None  # memory that the next run may take when this one is over

    @property
    def lanes(self) -> np.ndarray:
        """One record per member, see `integrate.state`."""
        return self.work.lanes


def workspace(cache: Cache, x0: np.ndarray, times: np.ndarray, *sizes: Any) -> Spare:
    """Return the workspace of a run, see `new_work`: that of a run that is over, if it fits."""
    sizes = (x0.shape, times.size, *sizes)
    try:
        spare = cache.of(Spare).pop()
    except IndexError:  # there is none, or another thread has just taken it
        spare = None
    if spare is None or spare.sizes != sizes:
        work = new_work(x0, times, *sizes[2:])
        arrays = tuple(a for path, a in arrays_of(work) if a.size and _is_0_at_first(path[-1]))
        return Spare(sizes, work, arrays, sum(array.nbytes for array in arrays) <= _MOST)
    for array in spare.arrays:
        array.fill(0)
    work = spare.work
    work.lanes[:], work.x[:] = new_lanes(times, x0.shape[1]), x0
    work.samples.fill(np.nan)
    work.y.fill(np.nan)
    return spare


def give_back(cache: Cache, spare: Spare) -> None:
    """Keep the workspace of a run that is over, and of which nothing is read any more."""
    kept = cache.of(Spare)
    if spare.is_small and len(kept) < _THREADS:
        kept.append(spare)


def _is_0_at_first(name: str) -> bool:
    """Whether an array is 0 when a run begins: flat ones are the same memory, `v` has unit ones."""
    return name not in ("lanes", "samples", "y", "v") and not name.endswith("_flat")


def arrays_of(
    record: Any, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], np.ndarray]]:
    """Yield the arrays of a record, and of those inside, by their names."""
    for name in record._fields[:-1]:
        value = getattr(record, name)
        if hasattr(value, "_fields"):
            yield from arrays_of(value, (*path, name))
        elif isinstance(value, np.ndarray):
            yield (*path, name), value
