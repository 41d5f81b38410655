"""A corpus of functions as users of python-control write them; one module per theme.

Each factory makes fresh functions for a number of states, so that no memory outlives a test.
"""

from . import (
    arithmetic,
    callables,
    chance,
    control_flow,
    control_objects,
    copies,
    dtypes,
    exceptions,
    joining,
    linear_algebra,
    memory,
    memory_elsewhere,
    models,
    objects,
    reductions,
    results,
    slices,
    syntax,
    tables,
    truth,
)
from ._entry import FOUND, SIZES, Entry, Pieces, system

__all__ = ["ENTRIES", "SIZES", "Entry", "Pieces", "system"]

ENTRIES: tuple[Entry, ...] = tuple(FOUND)
