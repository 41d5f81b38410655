"""What leaves transport delays at a time: polynomials that were kept, and when it was sent."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from .memory import Places1, Places2, Places3, Reals1, Reals2, Reals3, Reals4, arrays_of
from .state import INNER

DEGREE = 5  # of the polynomials that delayed signals are kept as


class DelayLines(NamedTuple):
    """The transport delays of a diagram, one line for each signal that is delayed."""

    delays: Reals2  # (lines, lanes) in s, without what varies in time
    varied: Places1  # (lines,): number of pieces of what does
    vary_t: Reals2  # (pieces, lines): when they begin
    vary_h: Reals2  # and how long they are
    vary: Reals3  # (pieces, lines, DEGREE + 1): polynomials in s
    kinks: Reals2  # (lines, kinks): when a derivative of it jumps, then inf
    direct: Places2  # (lines, lines): whether what arrives at one is what leaves the other
    signals: Places1  # the function that fills the outputs, and then what arrives at the lines
    table: Places2


class KeptSignals(NamedTuple):
    """What a run keeps of the signals that are delayed."""

    powers: Reals4  # polynomials of the lines' signals: (steps, lines, powers, lanes)
    t: Reals2  # when these steps began
    h: Reals2  # and how long they were
    level: Places3  # (steps, lines, lanes): which derivative jumps at their beginnings
    kept: Places1  # how many there are
    first: Places2  # (lines, lanes): the break that has arrived last
    next: Places2  # and that will arrive next, -1 if none is known
    fresh: Places2  # which derivative jumps now
    until: Reals1  # where the polynomials that are kept end
    bends: Places1  # whether a kink arrives at the end of a step
    seen: Reals3  # outputs and signals at nodes of that step
    tried: Reals3  # its polynomials
    missed: Reals1  # what these miss, over its tolerance; -1 where it is a jump
    missed_at_end: Reals1
    shown: Reals3  # what leaves the lines at the task's times: (times, lines, lanes)
    shown_to: Places1  # up to which of these
    table: Places2


def new_past(times: int, outputs: int, lines: int, lanes: int) -> KeptSignals:
    """Return the arrays for delayed signals; there is no place for a step yet."""
    return arrays_of(
        KeptSignals,
        powers=(0, lines, DEGREE + 1, lanes),
        **dict.fromkeys(("t", "h"), (0, lanes)),
        level=(0, lines, lanes),
        **dict.fromkeys(("kept", "shown_to", "bends"), (lanes,)),
        **dict.fromkeys(("first", "next", "fresh"), (lines, lanes)),
        **dict.fromkeys(("until", "missed", "missed_at_end"), (lanes,)),
        seen=(DEGREE + 3 if lines else 0, outputs, lanes),
        tried=(lines, DEGREE + 1, lanes),
        shown=(times, lines, lanes),
    )


@numba.njit(**INNER)
def piece_at(starts, column, low, high, t):
    """Return which piece from `low` to `high` a time lies in: the last that has begun."""
    while low < high:
        middle = (low + high + 1) // 2
        if starts[middle, column] <= t:
            low = middle
        else:
            high = middle - 1
    return low


@numba.njit(**INNER)
def _within(start, length, t):
    """Return where a time lies in a piece, from -1 to 1."""
    # What looks ahead of a step, or of the run, sees the polynomial standing still.
    z = 2.0 * (t - start) / length - 1.0
    return min(max(z, -1.0 - 1e-6), 1.0 + 1e-6)


@numba.njit(**INNER)
def _variation(task, i, t):
    """Return by how much the delay of line `i` is longer at time t, and the slope of that."""
    lines = task.lines
    k = piece_at(lines.vary_t, i, 0, lines.varied[i] - 1, t)
    z = _within(lines.vary_t[k, i], lines.vary_h[k, i], t)
    value, slope = lines.vary[k, i, DEGREE], 0.0
    for n in range(DEGREE - 1, -1, -1):
        slope = slope * z + value
        value = value * z + lines.vary[k, i, n]
    return value, 2.0 * slope / lines.vary_h[k, i]


@numba.njit(**INNER)
def sent(task, i, j, t):
    """Return when line `i` of a lane was given what leaves it at time t."""
    if task.lines.varied[i] == 0:
        return t - task.lines.delays[i, j]
    return t - (task.lines.delays[i, j] + _variation(task, i, t)[0])


@numba.njit(**INNER)
def arrival(task, i, j, s):
    """Return when leaves line `i` of a lane what it is given at time s; inf behind the run."""
    # The delay grows by less than 1 s per second: Newton's method, with the bracket that this
    # gives.
    lines = task.lines
    if lines.varied[i] == 0:
        return s + lines.delays[i, j]
    last = lines.varied[i] - 1
    low, high = lines.vary_t[0, i], lines.vary_t[last, i] + lines.vary_h[last, i]
    if sent(task, i, j, high) < s:
        return np.inf
    t = min(max(s + lines.delays[i, j], low), high)
    for _ in range(100):
        value, slope = _variation(task, i, t)
        missed = t - (lines.delays[i, j] + value) - s
        if missed > 0.0:
            high = t
        else:
            low = t
        new = t - missed / (1.0 - slope)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - t) <= 1e-15 * abs(t) or new == t:
            return new
        t = new
    return t


@numba.njit(**INNER)
def past_value(task, w, i, j, t):
    """Return what leaves line `i` of a lane at time t."""
    # Of the polynomials between two breaks only, so that rounding never reads the other side.
    past = w.past
    s = sent(task, i, j, t)
    last = past.next[i, j] - 1 if past.next[i, j] >= 0 else past.kept[j] - 1
    k = piece_at(past.t, j, past.first[i, j], last, s)
    z = _within(past.t[k, j], past.h[k, j], s)
    value = past.powers[k, i, DEGREE, j]
    for n in range(DEGREE - 1, -1, -1):
        value = value * z + past.powers[k, i, n, j]
    return value


@numba.njit(**INNER)
def next_arrival(task, w, j):
    """Return when the next break that is known leaves a line of a lane, inf if none is known."""
    first, past = np.inf, w.past
    for i in range(task.lines.delays.shape[0]):
        if past.next[i, j] >= 0:
            first = min(first, arrival(task, i, j, past.t[past.next[i, j], j]))
    return first
