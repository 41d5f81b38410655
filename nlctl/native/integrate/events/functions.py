"""Event functions: whose rows are whose, and their values at the ends of a step and in between."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ..memory import Places1, Places2, Reals1, Reals2, Reals3
from ..state import INNER
from .location import SMALL_KINK, is_kink


class EventRows(NamedTuple):
    """Whose rows of g are whose, from the first."""

    bending: int  # number of switching functions that blocks declare
    declared: int  # and with those of conditions at which nothing jumps, which follow
    guarded: int  # and with those of other conditions
    switching: int  # and with the guards
    watched: int  # the first of those that the run watches, behind the other conditions
    ways: Places1  # which of their changes count: 1 rising, -1 falling, 0 both
    ending: Places1  # and whether the run ends there
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
    came: Reals2  # the side on which it was last, 0 if it has been at 0 since the run began
    before_jump: Reals2  # at the end of a step, before anything jumps there
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
def at_zero(task, i, value):
    """Whether a condition is on neither side: exactly 0, at a kink what rounding makes of that."""
    return value == 0.0 or (is_kink(task, i) and abs(value) <= SMALL_KINK * task.atol)


@numba.njit(**INNER)
def begin_next(task, w, j):
    """Make what event functions are at the end of a lane's step those of the next one's start."""
    events, memories = w.events, w.memories
    for i in range(events.g.shape[0]):
        events.g_start[i, j] = events.g[i, j]
        if not at_zero(task, i, events.g[i, j]):
            events.came[i, j] = np.sign(events.g[i, j])
    for i in range(memories.m.shape[0]):
        memories.m_start[i, j] = memories.m[i, j]
        memories.slope_start[i, j] = memories.slope[i, j]
        memories.rate_start[i, j] = memories.rate[i, j]
