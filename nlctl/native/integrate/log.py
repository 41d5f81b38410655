"""What has happened in a single run, as it happens: when, which row of g, in which direction."""

from __future__ import annotations

from typing import Any

import numba

from .state import INNER

OF_TIME = -1  # instead of a row: a condition of t alone
_ROOM = 4  # entries of one row in one step at most: its event, and jumps that follow


def log_room(task: Any, rows: int, expected: int = 0) -> int:
    """Return how many entries there is to be room for, with so many rows of g; 0 for none."""
    notes = task.alone and (task.switching or task.jumps.shape[1])
    return 2 * _ROOM * rows + 256 + expected if notes else 0


@numba.njit(**INNER)
def note(task, lane, w, row, rises, j):
    """Note an event of a lane, if it is a single run; there is room, see `log_is_full`."""
    if not task.alone or lane.noted >= w.log_t.size:
        return
    w.log_t[lane.noted] = lane.t
    w.log_row[lane.noted] = 2 * row + (1 if rises else 0)
    lane.noted += 1


@numba.njit(**INNER)
def log_is_full(task, lanes, w):
    """Whether what may happen in a step has no room any more."""
    if not task.alone or (task.switching == 0 and task.jumps.shape[1] == 0):
        return False
    return lanes[0].noted + _ROOM * w.g.shape[0] + 128 > w.log_t.size
