"""Conditions of the equations: a step ends right before one, and a very short step leads across.

Behind a condition the right-hand side may have jumped.  A stage that looks behind it makes a step
wrong by as much as the jump, however little of the step lies there; so no step that counts has one.
What is tried is shortened until it ends before the condition, by less than a small part of a local
error, with all stages on the near side.  The step across is so short that what it is wrong by is
no more than that, whichever side its stages see.
"""

from __future__ import annotations

import numba
import numpy as np

from ..state import INNER
from .location import AGAIN, CLEAR, EVENT

NOTHING = -2  # no condition lies in the step just tried
_SHARE = 0.1  # of the relative tolerance, of a step: how close to a condition steps end
_TRIES = 50


@numba.njit(**INNER)
def crossing(task, lane, w, j):
    """Look for conditions in the step just tried: what becomes of it, or NOTHING.

    With AGAIN, ``lane.step`` is the next length to try; with CLEAR a step across follows.
    """
    if lane.across:
        return _across(task, lane, w, j)
    if lane.tries > 0 and lane.traces == 0:
        return NOTHING  # a break point that a block declares is being located
    inside = _first_root(task, lane, w, w.e, j, 0.0, lane.step) >= 0.0
    if not inside and lane.traces == 0:
        return NOTHING
    if lane.traces == 0:
        lane.traces, lane.low, lane.high, lane.same_side = 1, 0.0, lane.step, 0
        for i in range(task.declared, task.switching):
            w.e_low[i, j], w.e_high[i, j] = w.e_start[i, j], w.e[i, j]
    else:
        _narrow(task, lane, w, inside, j)
    return _next_try(task, lane, w, inside, j)


@numba.njit(**INNER)
def _across(task, lane, w, j):
    """Accept the step across a condition, unless its end is not finite."""
    if not np.isfinite(w.error[j]):
        return NOTHING
    for i in range(task.declared, task.switching):
        if w.e_start[i, j] * w.e[i, j] < 0.0:
            return EVENT
    return CLEAR


@numba.njit(**INNER)
def _next_try(task, lane, w, inside, j):
    """Say what to try next, or take the step just tried, which ends right before a condition."""
    t_end = max(abs(lane.t), abs(lane.t + lane.high))
    close = max(_SHARE * task.rtol * lane.high, 8e-16 * t_end)
    root = _first_root(task, lane, w, w.e_high, j, lane.low, lane.high)
    if lane.high <= 2.0 * close and inside:  # right behind the start
        lane.across, lane.traces, lane.tries = 1, 0, 0
        return EVENT if np.isfinite(w.error[j]) else NOTHING
    if not inside and (root - lane.step <= close or lane.high - lane.step <= 2.0 * close):
        lane.traces = lane.tries = 0
        if w.error[j] <= 1.0 or task.fixed > 0.0:
            lane.cross = max(min(root - lane.step + close, lane.high - lane.step), close)
            return CLEAR
        return NOTHING  # too long on this side alone: error control says what to try
    if lane.tries > _TRIES:
        lane.traces = lane.tries = 0
        return NOTHING
    lane.tries += 1
    width = lane.high - lane.low
    aim = root - 0.5 * close
    if lane.tries > 6 and lane.tries % 2:
        aim = lane.low + 0.5 * width
    rest = min(1e-3 * width, 0.5 * close)
    lane.step = min(max(aim, lane.low + rest), lane.high - rest)
    lane.ends = 0
    return AGAIN


@numba.njit(**INNER)
def _narrow(task, lane, w, inside, j):
    """Take the step just tried into the bracket; an end that stays loses weight (Illinois)."""
    if inside:
        lane.high = lane.step
        lane.same_side = max(lane.same_side, 0) + 1
    else:
        lane.low = lane.step
        lane.same_side = min(lane.same_side, 0) - 1
    weight = 0.5 if abs(lane.same_side) > 1 else 1.0
    for i in range(task.declared, task.switching):
        if inside:
            w.e_low[i, j], w.e_high[i, j] = w.e_low[i, j] * weight, w.e[i, j]
        else:
            w.e_low[i, j], w.e_high[i, j] = w.e[i, j], w.e_high[i, j] * weight


@numba.njit(**INNER)
def _first_root(task, lane, w, e_high, j, low, high):
    """Return where the first condition between two lengths lies, -1 if there is none."""
    first = -1.0
    for i in range(task.declared, task.switching):
        if w.e_start[i, j] * e_high[i, j] < 0.0:
            begin = w.e_start[i, j] if low == 0.0 else w.e_low[i, j]
            part = begin / (begin - e_high[i, j])
            root = low + min(max(part, 0.0), 1.0) * (high - low)
            if first < 0.0 or root < first:
                first = root
    return first
