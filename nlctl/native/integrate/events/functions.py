"""Event functions: whose rows are whose, and their values at the ends of a step and in between."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ..memory import Places1, Places2, Reals1, Reals2, Reals3
from ..state import INNER
from .location import SHORT, SMALL_KINK, is_kink

_ROUGH = 0.01  # of that: what changes by more in a short step jumps


class EventRows(NamedTuple):
    """Whose rows of g are whose, from the first."""

    bending: int  # number of switching functions that blocks declare
    declared: int  # and with those of conditions at which nothing jumps, which follow
    guarded: int  # and with those of other conditions
    switching: int  # and with the guards
    watched: int  # the first of those that the run watches, behind the other conditions
    ways: Places1  # which of their changes count: 1 rising, -1 falling, 0 both
    ending: Places1  # and whether the run ends there
    # what each of them is 0 with: a row of a kink, or -2 - m for the relay whose mode is state m
    ties: Places1
    # of each row how far behind it, or with a sign before, its partner is: of what jumps at
    # integers one has its roots at even ones, one at odd ones; 0 for none
    partners: Places1
    memory: Places1  # indices of memory states
    table: Places2


class Events(NamedTuple):
    """Values of switching functions: (rows, lanes), or (parts, rows, lanes)."""

    g: Reals2  # at the end of the step being tried
    g_start: Reals2
    g_inside: Reals3  # see `excursions`; the last is scratch
    g_before: Reals2  # at the end of a step that ended before a condition, see `crossing`
    g_low: Reals2  # at the ends of the bracket in which an event is located
    g_high: Reals2
    behind: Reals2  # 1 where the step before ended with this event; of a condition that is
    # exactly 0 the side that it has come from
    # the side on which it was last, 0 if it has been at 0 since the run began; twice the other one
    # where it has come to rest at 0, which counts as a change of its sign
    came: Reals2
    before_jump: Reals2  # at the end of a step, before anything jumps there
    largest: Reals2  # absolute values so far
    side: Reals2  # on which it has last been for more than a short step
    table: Places2


class Memories(NamedTuple):
    """What memories would become, and how fast that changes: the rates are event functions."""

    m: Reals2  # (memories, lanes), at the end of the step being tried
    m_start: Reals2
    m_inside: Reals3  # (parts, memories, lanes), as of switching functions
    slope: Reals2  # rates of m (1/s)
    slope_start: Reals2
    rate: Reals2  # the same over a small part of a step, exactly 0 where a memory stands still
    rate_start: Reals2
    rate_low: Reals2  # at the ends of the bracket in which an event is located
    rate_high: Reals2
    table: Places2


class Inside(NamedTuple):
    """What is looked at inside of the step being tried, one number for each lane or more."""

    values: Reals1  # of one event function over a step: (5,)
    newton: Reals1  # (5,)
    wanted: Places1  # whether a step is to be looked into
    resolved: Reals1  # the longest step over which event functions can be followed
    sought: Places1  # the event function whose minimum is sought, -1 if none is
    carried: Places1  # whether that is a memory's
    attempts: Places1
    part: Reals1  # of the step: where it is evaluated
    looked: Reals1  # what it is there
    foreseen: Reals1  # and was foreseen to be
    wrong: Reals1  # what the polynomial may be wrong by
    narrow: Reals1  # part of the step below which it is not sought closer
    floor: Reals1  # below 0: what is not told from it
    bracket: Reals2  # (3, lanes): parts below, at and above the least value that is known
    height: Reals2  # and the values there
    table: Places2


@numba.njit(**INNER)
def has_events(w):
    """Whether there are event functions: switching functions, or rates of memories."""
    return w.events.g.shape[0] > 0 or w.memories.m.shape[0] > 0


@numba.njit(**INNER)
def at_zero(task, w, i, g, j):
    """Whether a condition is on neither side: exactly 0, at a kink what rounding makes of that."""
    # What the run watches is where it is tied to a kink or a relay: while that slides, see `tied`.
    value = g[i, j]
    if value == 0.0 or (is_kink(task, i) and abs(value) <= SMALL_KINK * task.atol):
        return True
    k = i - task.rows.watched
    if not 0 <= k < task.rows.ties.size or value != value:
        return False
    tie = task.rows.ties[k]
    if tie >= 0:  # what has come to rest there has not left it before it is seen
        least = 1.0 if abs(w.events.came[i, j]) > 1.0 else SMALL_KINK
        return abs(g[tie, j]) <= least * task.atol
    return tie < -1 and abs(w.x[-2 - tie, j]) < 1.0


@numba.njit(**INNER)
def is_of_relay(task, i):
    """Whether an event function is 0 where a relay of a condition slides."""
    k = i - task.rows.watched
    return 0 <= k < task.rows.ties.size and task.rows.ties[k] < -1


@numba.njit(**INNER)
def begin_next(task, w, j):
    """Make what event functions are at the end of a lane's step those of the next one's start."""
    events, memories = w.events, w.memories
    for i in range(events.g.shape[0]):
        events.largest[i, j] = max(events.largest[i, j], abs(events.g[i, j]))
        stays = events.g_start[i, j] == events.g[i, j]
        is_short = w.lanes[j].last < SHORT * w.lanes[j].h
        jumps = is_short and abs(events.g_start[i, j]) > _ROUGH * events.largest[i, j]
        if jumps and events.g[i, j] == 0.0:  # that counts where it jumps on
            events.side[i, j] = 0.0
        events.g_start[i, j] = events.g[i, j]
        waits = events.came[i, j] != 0.0 and is_of_relay(task, i)  # see `changed_side`
        if not at_zero(task, w, i, events.g, j) and not stays and not waits:
            events.came[i, j] = np.sign(events.g[i, j])
            if not is_short:
                events.side[i, j] = events.came[i, j]
    for i in range(memories.m.shape[0]):
        memories.m_start[i, j] = memories.m[i, j]
        memories.slope_start[i, j] = memories.slope[i, j]
        memories.rate_start[i, j] = memories.rate[i, j]
