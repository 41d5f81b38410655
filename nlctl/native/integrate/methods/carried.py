"""Memories that are carried along within a step of Taylor's method, and where they turn.

What a memory would become has a polynomial like any function of the states, and its derivative one
as well: it is carried along until that derivative changes its sign.
"""

from __future__ import annotations

import numba

from ..control import SMALLEST
from ..events.location import behind_turn
from ..state import INNER, opposite
from .crossings import first_crossing, followed_part, part_behind_root
from .dips import value_and_slope

_MISSED = 0.1  # of its tolerance: what a memory may have gone on behind its turn


@numba.njit(**INNER)
def memory_row(task, w, i):
    """Return the row of coefficients of what a memory would become."""
    return w.x.shape[0] + task.rows.switching + i


@numba.njit(**INNER)
def memory_rate_row(task, w, i):
    """Return the row of coefficients of its derivative."""
    return memory_row(task, w, i) + task.rows.memory.size


@numba.njit(**INNER)
def fill_slopes(task, w, j):
    """Fill the coefficients of memories' derivatives from those of what they would become."""
    terms, highest = w.taylor.terms, task.taylor.highest - 1
    for i in range(task.rows.memory.size):
        row, slope = memory_row(task, w, i), memory_rate_row(task, w, i)
        for k in range(highest):
            terms[k, slope, j] = (k + 1.0) * terms[k + 1, row, j]
        terms[highest, slope, j] = 0.0


@numba.njit(**INNER)
def part_of_rates(task, w, h, j):
    """Return in which part of a step h the rates of memories that are carried are followed."""
    part = 1.0
    for i in range(task.rows.memory.size):
        if w.memories.rate_start[i, j] != 0.0:
            row, highest = memory_rate_row(task, w, i), task.taylor.highest - 2
            part = min(part, followed_part(highest, h, w.taylor.terms, row, 0.0, j))
    return part


@numba.njit(**INNER)
def foreseen_turn(task, lane, w, j):
    """Return the part of a step that ends right behind the first turn of a memory, 1 for none."""
    first, terms, highest = 1.0, w.taylor.terms, task.taylor.highest - 2
    rest = 0.5 * behind_turn(task.rtol)
    for i in range(task.rows.memory.size):
        start, row = w.memories.rate_start[i, j], memory_rate_row(task, w, i)
        end = value_and_slope(highest, lane.step, terms, row, j)[0]
        if opposite(start, end) and opposite(terms[0, row, j], end):
            ends = terms[0, row, j], end
            root = part_behind_root(highest, lane.step, terms, row, ends, rest, j)
            first = min(first, root * (1.0 + rest))
        elif _turns_at_once(task, w, i, j):
            part = _missing_little(task, lane, w, i, rest, j)
            lane.at_once, first = part * lane.step, min(first, part)
    return first


@numba.njit(**INNER)
def _turns_at_once(task, w, i, j):
    """Whether a memory turns where a step begins: its rate is seen by rounding there."""
    return opposite(w.memories.rate_start[i, j], w.taylor.terms[0, memory_rate_row(task, w, i), j])


@numba.njit(**INNER)
def _missing_little(task, lane, w, i, part, j):
    """Return up to which part of a step a memory that is to turn there may be carried along."""
    row, terms, highest = memory_row(task, w, i), w.taylor.terms, task.taylor.highest - 1
    begins = terms[0, row, j]
    while part * lane.step > SMALLEST * abs(lane.t):
        missed = value_and_slope(highest, part * lane.step, terms, row, j)[0] - begins
        if not abs(missed) > _MISSED * (task.atol + task.rtol * abs(begins)):
            break
        part *= 0.25
    return part


@numba.njit(**INNER)
def turns_until(task, lane, w, until, j):
    """Return before which part of a step memories turn that have turned at its end."""
    for i in range(task.rows.memory.size):
        row, terms = memory_rate_row(task, w, i), w.taylor.terms
        first = terms[0, row, j]
        end = value_and_slope(task.taylor.highest - 2, w.h[j], terms, row, j)[0]
        if opposite(w.memories.rate_start[i, j], end) and opposite(first, end):
            part = first / (first - end)
            until = min(until, lane.low / lane.step if lane.tries else part)
    return until


@numba.njit(**INNER)
def turns_inside(task, w, until, j):
    """Return the part of a step at which a memory turns and turns again, 1 for nowhere."""
    first, terms, highest = 1.0, w.taylor.terms, task.taylor.highest - 2
    for i in range(task.rows.memory.size):
        start, row = w.memories.rate_start[i, j], memory_rate_row(task, w, i)
        if start == 0.0:
            continue
        if _turns_at_once(task, w, i, j):
            start = -start
        part = followed_part(highest, w.h[j], terms, row, 0.0, j)
        if part < 1.0:
            first = min(first, part)
            continue
        turn = first_crossing(highest, w.h[j], terms, row, start, until, w.taylor.shifted, j)[0]
        if turn < until:
            first = min(first, turn)
    return first
