"""What has happened in a single run, as it happens: when, which row of g, in which direction."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba

from .memory import Places1, Places2, Reals1
from .state import INNER

OF_TIME = -1  # instead of a row: a condition of t alone
_ROOM = 4  # entries of one row in one step at most: its event, and jumps that follow


class Log(NamedTuple):
    """What has happened in a single run."""

    t: Reals1  # when (s)
    row: Places1  # twice the row of g, and 1 if it rises
    table: Places2


def log_room(task: Any, rows: int, expected: int = 0) -> int:
    """Return how many entries there is to be room for, with so many rows of g; 0 for none."""
    notes = task.alone and (task.rows.switching or task.timed.jumps.shape[1])
    return 2 * _ROOM * rows + 256 + expected if notes else 0


@numba.njit(**INNER)
def note(task, lane, w, t, row, rises, j):
    """Count an event of a lane, and write it down in a single run: there is room for it."""
    if task.alone:
        if lane.noted >= w.log.t.size:  # never, see `log_is_full`
            return
        w.log.t[lane.noted] = t
        w.log.row[lane.noted] = 2 * row + (1 if rises else 0)
    lane.noted += 1


@numba.njit(**INNER)
def log_is_full(task, lanes, w):
    """Whether what may happen in a step has no room any more."""
    if not task.alone or (task.rows.switching == 0 and task.timed.jumps.shape[1] == 0):
        return False
    return lanes[0].noted + _ROOM * w.events.g.shape[0] + 128 > w.log.t.size
