"""Events inside a step: break points, and memories that reverse.

A switching function that changes its sign marks a break point; a memory reverses where the rate at
which it would be carried along changes its sign or becomes zero.  In both cases the step is
repeated, shorter each time, until it ends right behind the event: all stages but a negligible
rest then lie on one side, and what the rest costs is below one local error.  Regula falsi with the
Illinois modification finds the length; every attempt is a step of full order, so nothing rests on
an interpolant that has seen the other side.

A memory that jumps where no switching function of its block changes its sign is one more event:
error control does not see it, since memories stand still within a step.  The length is halved.
"""

from __future__ import annotations

import numba
import numpy as np

from ..control import SMALLEST
from ..state import INNER, is_stiff, opposite

STARTS_BEHIND = 1e-5  # part of a step in which the event before is not met again
SMALL_KINK = 0.01  # of the absolute tolerance
REFUSED, AGAIN, CLEAR, EVENT = -1, 0, 1, 2  # what became of the step just tried
TRIES = 30
FAR_SIDE = 0.9  # part of an attempt: the near side has not been looked at close to its end
CONFIRMED = 3.0  # times as far as a line from the start says that a root lies
SHORT = 1e-3  # part of a step: a shorter one between events is no progress
PATIENCE, REST = 3, 20  # after so many short ones, so many steps without memory events
_NOISE, _LONGEST = 10, 10  # steps with a kink of rounding, then times two of steps without kinks


@numba.njit(**INNER)
def is_kink(task, i):
    """Whether an event function is one of a condition at which nothing jumps."""
    return task.rows.bending <= i < task.rows.declared


@numba.njit(**INNER)
def goes_over_kinks(task, lane):
    """Whether kinks are left to error control, for a while: a polynomial sees one side only."""
    return lane.dull > 0 and task.taylor.highest == 0


@numba.njit(**INNER)
def triggered(start, end, behind):
    """Whether a switching function's values at the ends of a step show an event in between."""
    # With `behind` its own event was the end of the step before: on a surface that attracts from
    # both sides, going back through it at once is no event.
    return opposite(start, end) and not (behind and abs(start) <= STARTS_BEHIND * abs(end))


@numba.njit(**INNER)
def behind_event(rtol):
    """Return the part of a step by which it may end behind a break point."""
    return min(10.0 * rtol, 1e-4)


@numba.njit(**INNER)
def behind_turn(rtol):
    """Return the part of a step by which it may end behind where a memory turns."""
    return 0.3 * np.sqrt(rtol)


@numba.njit(**INNER)
def first_root(lane, task, every, w, low, high, j):
    """Return where the first event between the lengths low and high lies, -1 if there is none."""
    # `low` and `high` are values of the switching functions there. Conditions at which something
    # may jump, and guards, are for `crossing`, unless `every` event is asked for.
    first, rows, small = -1.0, task.rows, SMALL_KINK * task.atol
    start, behind = w.events.g_start, w.events.behind
    for i in range(rows.switching if every else rows.declared):
        if is_kink(task, i) and (
            goes_over_kinks(task, lane) or abs(start[i, j]) + abs(high[i, j]) <= small
        ):
            continue  # rounding of what is 0: a kink that small is seen by nobody
        if triggered(start[i, j], high[i, j], behind[i, j] != 0.0):
            root = _root(lane, low[i, j], high[i, j])
            if first < 0.0 or root < first:
                first = root
    return first


@numba.njit(**INNER)
def first_turn(lane, w, low, high, j):
    """Return where the first memory between the lengths low and high turns, -1 if none does."""
    # `low` and `high` are the rates there.
    first, start = -1.0, w.memories.rate_start
    for i in range(start.shape[0]):
        if start[i, j] != 0.0 and not opposite(start[i, j], -high[i, j]):
            root = _root(lane, low[i, j], high[i, j])
            if first < 0.0 or root < first:
                first = root
    return first


@numba.njit(**INNER)
def _root(lane, low, high):
    """Return where a function is 0 between two lengths, by its values there."""
    if not opposite(low, high):
        high = -low  # a memory that would stand still says no more than that: halve
    part = 0.5 if low == high else low / (low - high)
    return lane.low + part * (lane.high - lane.low)


@numba.njit(**INNER)
def locate(lane, task, w, j):
    """Look for events in the step just tried: AGAIN, or accepted as CLEAR or with an EVENT."""
    # With AGAIN, ``lane.step`` is the next length to try.
    root, memory = _narrowed(lane, task, w, j)
    if root < 0.0:
        return CLEAR
    lane.tries += 1
    # behind a break point stages are wrong by the rest; what a memory misses is quadratic in it
    behind = behind_turn(task.rtol) if memory else behind_event(task.rtol)
    tolerance = max(lane.high * behind, SMALLEST * abs(lane.t), lane.at_once if memory else 0.0)
    is_behind, is_close = lane.high == lane.step, lane.high - root <= tolerance
    if is_behind and ((is_close and lane.nearly) or lane.tries > TRIES):
        return EVENT
    if lane.high - lane.low <= tolerance:
        lane.step = lane.high
        lane.tries = TRIES
    else:
        before = root - tolerance  # whether it is: what lies there says so
        aim = before if is_close and is_behind and before > lane.low else root + 0.5 * tolerance
        width = lane.high - lane.low
        if lane.tries > 4 and lane.tries % 2:
            aim = lane.low + 0.5 * width
        lane.step = min(max(aim, lane.low + 0.001 * width), lane.high - 0.001 * width)
    lane.ends = 0
    return AGAIN


@numba.njit(**INNER)
def _narrowed(lane, task, w, j):
    """Take the attempt into the bracket; return the first root in it, -1 if there is none."""
    # And whether it is a memory's.
    events, memories, before, weight, inside = w.events, w.memories, lane.high, 1.0, True
    lane.nearly = 1 if task.taylor.highest else 0  # whose polynomials have been followed to there
    if lane.tries == 0:
        lane.low, lane.high, lane.same_side = 0.0, lane.step, 0
        _bracketed(events.g_low, events.g_high, events.g_start, events.g, j)
        _bracketed(memories.rate_low, memories.rate_high, memories.rate_start, memories.rate, j)
    else:
        lane.high = lane.step
        inside = first_root(lane, task, False, w, events.g_low, events.g, j) >= 0.0
        inside |= first_turn(lane, w, memories.rate_low, memories.rate, j) >= 0.0
        if not inside:
            lane.low, lane.high = lane.step, before
            lane.same_side = min(lane.same_side, 0) - 1
        else:
            lane.same_side = max(lane.same_side, 0) + 1
            lane.nearly = 1
            if not task.taylor.highest and lane.low < FAR_SIDE * lane.high:
                _confirm(lane, task.rtol, before, w.events, j)
        weight = 0.5 if abs(lane.same_side) > 1 else 1.0  # Illinois: an end that stays loses some
        _nearer(inside, weight, events.g_low, events.g_high, events.g, j)
        _nearer(inside, weight, memories.rate_low, memories.rate_high, memories.rate, j)
    root = first_root(lane, task, False, w, events.g_low, events.g_high, j)
    turn = first_turn(lane, w, memories.rate_low, memories.rate_high, j)
    is_memory = turn >= 0.0 and not 0.0 <= root <= turn
    return (turn if is_memory else root), is_memory


@numba.njit(**INNER)
def _confirm(lane, rtol, before, events, j):
    """Forget that an attempt ends nearly at a root, if the last two do not lead to it."""
    # Next to the crest of a narrow pulse they are small beside what they were at the start, and 0
    # is far: a line from there says nothing.
    farther = before - lane.step
    for i in range(events.g.shape[0]):
        start, high, end = events.g_start[i, j], events.g_high[i, j], events.g[i, j]
        if not opposite(start, end) or farther <= 0.0:
            continue
        distance, part = end * farther / (high - end), end / (end - start)
        most = CONFIRMED * (part + behind_event(rtol)) * lane.step
        if part <= behind_event(rtol) and not 0.0 <= distance <= most:
            lane.nearly = 0


@numba.njit(**INNER)
def _bracketed(low, high, start, end, j):
    """Make the values at the ends of a step those at the ends of the bracket."""
    for i in range(end.shape[0]):
        low[i, j], high[i, j] = start[i, j], end[i, j]


@numba.njit(**INNER)
def _nearer(inside, weight, low, high, end, j):
    """Take values into the bracket: at its far end, or at the near one."""
    for i in range(end.shape[0]):
        if inside:
            low[i, j], high[i, j] = low[i, j] * weight, end[i, j]
        else:
            low[i, j], high[i, j] = end[i, j], high[i, j] * weight


@numba.njit(**INNER)
def jumped(task, lane, w, j):
    """Whether a memory that stands still at both ends of a step just tried is another behind it."""
    # And no event of the step says why. Where such a jump is being located, one at a stage counts:
    # it is the first that is sought.
    memories, events = w.memories, w.events
    for i in range(memories.m.shape[0]):
        before = w.x_new[task.rows.memory[i], j]
        if memories.rate_start[i, j] != 0.0 or memories.slope[i, j] != 0.0:
            continue  # it is carried along, also while memories are committed step by step
        changed = _apart(task, before, memories.m[i, j])
        if lane.seeks > 0 and task.pair.inside[1 if is_stiff(lane) else 0, 0] != 0.0:
            for n in range(3):
                changed |= _apart(task, before, memories.m_inside[n, i, j])
        if changed:
            if lane.seeks > 0:
                return True
            return (
                first_root(lane, task, True, w, events.g_start, events.g, j) < 0.0
                and first_turn(lane, w, memories.rate_start, memories.rate, j) < 0.0
            )
    return False


@numba.njit(**INNER)
def _apart(task, before, after):
    """Whether a memory has changed by more than its tolerance."""
    return abs(after - before) > task.atol + task.rtol * max(abs(before), abs(after))


@numba.njit(**INNER)
def locate_jump(lane, rtol, is_behind):
    """Halve the way to where a memory jumps: AGAIN, or accepted with an EVENT right behind it."""
    if lane.seeks == 0:
        lane.seeks, lane.low, lane.high = 1, 0.0, lane.step
    elif is_behind:
        lane.high = lane.step
    else:
        lane.low = lane.step
    lane.tries += 1
    rest = max(behind_event(rtol) * lane.high, SMALLEST * abs(lane.t))
    found = lane.high - lane.low <= rest
    if found and (is_behind or lane.low == lane.high):
        return EVENT
    lane.step = lane.high if found else 0.5 * (lane.low + lane.high)
    lane.ends = 0
    return AGAIN


@numba.njit(**INNER)
def step_accepted(lane, event, turn):
    """Count an accepted step; turns without progress rest, after several, and noisy kinks."""
    lane.accepted += 1
    lane.last = lane.step
    lane.tries = lane.seeks = lane.returns = 0
    lane.quiet, lane.dull = max(0, lane.quiet - 1), max(0, lane.dull - 1)
    if not lane.across and lane.cross == 0.0:
        lane.misses = 0
    lane.events += event
    lane.kinks, lane.noisy = max(0, lane.kinks + (1 if lane.noisy else -1)), 0
    if lane.kinks >= _NOISE:  # error control is enough: rates are alike on both sides
        lane.kinks, lane.dull = 0, REST << min(lane.longer, _LONGEST)
        lane.longer += 1
    if lane.step >= SHORT * lane.h:
        lane.short = 0
    elif turn and not lane.across:  # what else is located does not come back by rounding
        lane.short += 1
        if lane.short >= PATIENCE:
            lane.short, lane.quiet = 0, REST
