"""What has happened in each lane, as it happens: when, which row of g, in which direction."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba

from .memory import Places2, Reals2
from .state import INNER, RUNNING

OF_TIME = -1  # instead of a row: a condition of t alone
_ROOM = 4  # entries of one row in one step at most: its event, and jumps that follow


class Log(NamedTuple):
    """What has happened: a column for each lane."""

    t: Reals2  # when (s)
    row: Places2  # twice the row of g, and 1 if it rises
    table: Places2


def log_room(task: Any, rows: int, expected: int = 0) -> int:
    """Return for how many entries of a lane there is to be room, with so many rows of g."""
    notes = task.rows.switching or task.timed.jumps.shape[1]
    return 2 * _ROOM * rows + 256 + expected if notes else 0


@numba.njit(**INNER)
def note(task, lane, w, t, row, rises, j):
    """Write down an event of a lane: there is room for it."""
    if lane.noted >= w.log.t.shape[0]:  # never, see `log_is_full`
        return
    w.log.t[lane.noted, j] = t
    w.log.row[lane.noted, j] = 2 * row + (1 if rises else 0)
    lane.noted += 1


@numba.njit(**INNER)
def log_is_full(task, lanes, w):
    """Whether what may happen in a step has no room any more."""
    if task.rows.switching == 0 and task.timed.jumps.shape[1] == 0:
        return False
    most = w.log.t.shape[0] - _ROOM * w.events.g.shape[0] - 128
    for j in range(lanes.size):  # noqa: SIM110 (no generators in machine code)
        if lanes[j].status == RUNNING and lanes[j].noted > most:
            return True
    return False
