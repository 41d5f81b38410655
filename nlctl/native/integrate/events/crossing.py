"""Conditions of the equations: a step ends right before one, and a very short step leads across.

Behind a condition the right-hand side may have jumped.  A stage that looks behind it makes a step
wrong by as much as the jump, however little of the step lies there; so no step that counts has one.
What is tried is shortened until it ends before the condition, by less than a small part of a local
error, with all stages on the near side.  The step across is so short that what it is wrong by is
no more than that, whichever side its stages see.

A guard is found in the same way, but only where it falls; behind it comes its jump.
"""

from __future__ import annotations

import numba
import numpy as np

from ..control import shorten
from ..state import INNER, is_stiff, opposite
from .functions import at_zero, is_of_relay
from .location import AGAIN, CLEAR, EVENT, REFUSED

NOTHING = -2  # no condition lies in the step just tried
BEFORE_CONDITION = 0.01  # of the relative tolerance, of a step: how close to one steps end
_CLOSEST = 8e-16  # of the time: no condition can be told closer than that
_ROUNDING = 1e-14  # of what is integrated, in the error of a step
_WIDER = 4.0  # each time that a step across has not led across
_TRIES = 60
_DECADES = 0.01  # of a bracket: nothing is foreseen of what leaves 0, not even how soon
_GROWS = 100.0  # an error that is small by chance
# of a step with a stage behind a condition: how much is left out
_CLEARLY, _GAP, _MOST = 3.0, 1e-4, 0.05
_LEAP = 10.0  # times the fastest rate
_SLIGHT = 1e-3  # of a tolerance
_LEAST = 1e-12  # of the time: shorter steps are taken, by the explicit method, whatever stages see


@numba.njit(**INNER)
def crossing(task, lane, w, j):
    """Look for conditions in the step just tried: what becomes of it, or NOTHING."""
    # With AGAIN, ``lane.step`` is the next length to try; with REFUSED a shorter one is proposed;
    # with CLEAR a step across follows.
    if lane.across:
        return _across(task, lane, w, j)
    if lane.tries > 0 and lane.traces == 0:
        return NOTHING  # a break point that a block declares is being located
    inside = _is_behind(task, lane, w, j)
    beyond = 0.0 if inside else _beyond(task, lane, w, j)
    if beyond > 0.0:
        return _shortened(task, lane, w, beyond, j)
    if not inside and lane.traces == 0:
        return NOTHING
    bad = inside or (task.fixed == 0.0 and _has_seen_a_jump(task, lane, w, j))
    bracket(task, lane, w, bad, j)
    return next_try(task, lane, w, bad, j)


@numba.njit(**INNER)
def _has_seen_a_jump(task, lane, w, j):
    """Whether a step is wrong: one of its stages has looked behind, whatever is said of its end."""
    # On the near side the error of a shorter step is smaller at least by the cube of its part, and
    # that of a longer one larger by no more than the sixth power.
    most = 1.0
    if lane.traces > 0 and not task.taylor.highest:
        most = min(1.0, 10.0 * (lane.step / lane.whole) ** 3 + _ROUNDING / task.rtol)
        if lane.low > 0.0:
            longer = _GROWS * lane.low_error * (lane.step / lane.low) ** 6
            most = min(most, longer + _ROUNDING / task.rtol)
    return not w.error[j] <= most


@numba.njit(**INNER)
def _shortened(task, lane, w, beyond, j):
    """Propose a shorter step in the place of one with a stage behind a condition."""
    # The stiff method's stages may hold each other back there, however short it is: what is too
    # short for that, or moves no state to speak of, is tried again as a step across.
    is_short = not lane.step > _LEAST * max(abs(lane.t), lane.last)
    if is_short or (is_stiff(lane) and _is_slight(task, lane, w, j)):
        if not is_stiff(lane):
            return NOTHING
        shorten(lane, 1.0)
        lane.cross = lane.step
        return REFUSED
    left = 1.0 - min(max(_CLEARLY * beyond, _GAP), _MOST)
    if is_stiff(lane):
        left = min(left, max(0.2, 1.0 / (1.0 + beyond)))
    shorten(lane, left)
    return REFUSED


@numba.njit(**INNER)
def _is_slight(task, lane, w, j):
    """Whether a step moves all states by a small part of their tolerances, at their rates now."""
    for i in range(w.x.shape[0]):
        tolerance = task.atol + task.rtol * abs(w.x[i, j])
        if not lane.step * abs(w.k[0, i, j]) <= _SLIGHT * tolerance:
            return False
    return True


@numba.njit(**INNER)
def _is_behind(task, lane, w, j):
    """Whether the step just tried ends behind a condition."""
    for i in range(task.rows.declared, task.rows.switching):
        if has_crossed(task, w, i, w.events.g[i, j], j) or (
            _leaves(task, lane, w, i, j) and w.events.g[i, j] != 0
        ):
            return True
        if task.taylor.highest and i < task.rows.guarded and _meets(w, i, j):
            return True
    return False


@numba.njit(**INNER)
def _meets(w, i, j):
    """Whether a step ends where a condition is exactly 0, and the right-hand side is another."""
    return w.events.g[i, j] == 0.0 and w.events.g_start[i, j] != 0.0 and not w.error[j] <= 1.0


@numba.njit(**INNER)
def _leaves(task, lane, w, i, j):
    """Whether a step begins where a condition is exactly 0."""
    # What the right-hand side is at 0 need not be what it is on the side to which the step leads.
    # That counts once in a row: what comes back to 0 and leaves it with every step is rounding.
    return i < task.rows.guarded and w.events.g_start[i, j] == 0.0 and not lane.left_zero


@numba.njit(**INNER)
def _beyond(task, lane, w, j):
    """Return how far a stage of the step just tried lies behind a condition, as far as kept."""
    # In parts of what the switching function is at the start; what follows a shorter step begins
    # nearer, and has better stages.
    known = task.pair.inside[1 if is_stiff(lane) else 0, 0] != 0.0
    if not known or task.fixed > 0.0:
        return 0.0
    farthest = 0.0
    for i in range(task.rows.declared, task.rows.guarded):
        start = w.events.g_start[i, j]
        for n in range(0 if is_of_relay(task, i) else 3):
            if opposite(start, w.events.g_inside[n, i, j]):
                farthest = max(farthest, -w.events.g_inside[n, i, j] / start)
    return farthest


@numba.njit(**INNER)
def _across(task, lane, w, j):
    """Accept a step across a condition, unless its end is not finite or what jumps is too much."""
    # In that case it is tried again as any other: what is close is then a part of this short step.
    if not np.isfinite(w.error[j]):
        return NOTHING
    if task.fixed == 0.0 and _costs_too_much(task, lane, w, j):
        shorten(lane, 0.5 if lane.stiff else 1.0)  # which is not to ask for this one again
        return REFUSED
    for i in range(task.rows.switching):
        end = w.events.g[i, j]
        crossed = has_crossed(task, w, i, end, j) or left_to_other_side(task, w, i, j)
        if crossed and not at_zero(task, w, i, w.events.g, j):
            lane.misses = 0
            return EVENT
    lane.misses += 1
    return CLEAR


@numba.njit(**INNER)
def _costs_too_much(task, lane, w, j):
    """Whether a step across is wrong by more than a local error: by the jump of the rates in it."""
    least = _LEAST if lane.stiff else 2.0 * _CLOSEST  # see `_shortened`
    if not lane.step > least * max(abs(lane.t), lane.last):
        return False
    for i in range(w.x.shape[0]):
        apart = 0.0
        for s in range(1, w.k.shape[0]):  # it may have led across two of them
            apart = max(apart, abs(w.k[s, i, j] - w.k[0, i, j]))
        if lane.step * apart > task.atol + task.rtol * abs(w.x[i, j]):
            return True
    return False


@numba.njit(**INNER)
def _leaps(task, lane, w, j):
    """Whether a step has led where none of its rates leads, as a polynomial far behind does."""
    for i in range(w.x.shape[0]):
        fastest = 0.0
        for s in range(w.k.shape[0]):
            fastest = max(fastest, abs(w.k[s, i, j]))
        away = abs(w.x_new[i, j] - w.x[i, j])
        if not away <= _LEAP * lane.step * fastest + task.atol + task.rtol * abs(w.x[i, j]):
            return True
    return False


@numba.njit(**INNER)
def left_to_other_side(task, w, i, j):
    """Whether a step leads from where a condition is exactly 0 to where it has not come from."""
    is_condition = task.rows.declared <= i < task.rows.guarded
    return (
        is_condition
        and w.events.g_start[i, j] == 0.0
        and opposite(w.events.behind[i, j], w.events.g[i, j])
    )


@numba.njit(**INNER)
def has_crossed(task, w, i, end, j):
    """Whether a condition has changed its sign since the start of the step, or a guard fallen."""
    # What is watched and tied to a relay changes its sign where that switches, and a step ends.
    if is_of_relay(task, i):
        return False
    if i >= task.rows.guarded:
        return w.guards.above[i - task.rows.guarded, j] != 0 and end < 0.0
    return opposite(w.events.g_start[i, j], end)


@numba.njit(**INNER)
def bracket(task, lane, w, bad, j):
    """Take the step just tried into the bracket of lengths: too long, or all on the near side."""
    # Of the near side the last two are kept, by which is foreseen where the condition lies: what a
    # step that is wrong says of its end is made of both sides.
    events = w.events
    first = lane.traces == 0
    if first:
        lane.traces, lane.low, lane.low_before, lane.whole = 1, 0.0, 0.0, lane.step
        lane.same_side = 0
    if bad or first:
        lane.high, lane.right_high = lane.step, 1 if w.error[j] <= 1.0 else 0
        lane.same_side = max(lane.same_side, 0) + 1
    else:
        lane.low_before, lane.low, lane.low_error = lane.low, lane.step, w.error[j]
        lane.same_side = min(lane.same_side, 0) - 1
    weight = 0.5 if lane.right_high and abs(lane.same_side) > 1 else 1.0  # Illinois
    for i in range(task.rows.declared, task.rows.switching):
        if first:
            events.g_low[i, j] = events.g_before[i, j] = events.g_start[i, j]
        if bad or first:
            events.g_high[i, j] = events.g[i, j]
            events.g_low[i, j] *= weight
        else:
            events.g_before[i, j], events.g_low[i, j] = events.g_low[i, j], events.g[i, j]
            events.g_high[i, j] *= weight


@numba.njit(**INNER)
def next_try(task, lane, w, bad, j):
    """Say what to try next, or take the step just tried, which ends right before a condition."""
    close = _close(task, lane)
    root = _foreseen(task, lane, w, bad, j)
    if lane.high <= 2.0 * close and bad:  # right behind the start
        if task.fixed == 0.0 and _leaps(task, lane, w, j):
            lane.whole, lane.misses = lane.high, 0  # what was tried first says nothing
            close = _close(task, lane)
        if lane.high <= 2.0 * close:
            lane.across, lane.traces, lane.tries = 1, 0, 0
            return EVENT if np.isfinite(w.error[j]) else NOTHING
    near = lane.high - lane.step <= 2.0 * close or 0.0 <= root - lane.step <= close
    if not bad and near:
        lane.traces = lane.tries = 0
        cross = lane.high - lane.step if root < 0.0 else root - lane.step + close
        lane.cross = max(min(cross, lane.high - lane.step), close)
        return CLEAR
    if lane.tries > _TRIES:
        lane.traces = lane.tries = 0
        return NOTHING
    lane.tries += 1
    width = lane.high - lane.low
    aim = root - 0.5 * close if root > close else 1.5 * close
    if root < 0.0 or (lane.tries > 6 and lane.tries % 2):
        leaves_zero = root < 0.0 and 0.0 < lane.low < _DECADES * lane.high
        aim = np.sqrt(lane.low * lane.high) if leaves_zero else lane.low + 0.5 * width
    rest = min(1e-3 * width, 0.5 * close)
    lane.step = min(max(aim, lane.low + rest), lane.high - rest)
    lane.ends = 0
    return AGAIN


@numba.njit(**INNER)
def _close(task, lane):
    """Return how close before a condition a step is to end."""
    # No closer than rounding allows, which is more than that of the time where a state hardly
    # moves: what a short step adds to it may be lost, and the step across leads nowhere.
    t_end = max(abs(lane.t), abs(lane.t + lane.high))
    wider = _WIDER ** min(max(lane.misses - 1, 0), _TRIES)
    return wider * max(BEFORE_CONDITION * task.rtol * lane.whole, _CLOSEST * t_end)


@numba.njit(**INNER)
def _foreseen(task, lane, w, bad, j):
    """Return where the first condition lies in the bracket, -1 if nothing is known of that."""
    # Between both ends where the farther one is right, unless the near side leads away from 0;
    # otherwise by what is known of the near side: of a guard that is exactly 0 there, nothing.
    first = -1.0
    for i in range(task.rows.declared, task.rows.switching):
        root = -1.0
        now, end = w.events.g_low[i, j], w.events.g_high[i, j]
        leads_away = lane.low > 0.0 and abs(now) > abs(w.events.g_start[i, j])
        right = (lane.right_high or lane.low == 0.0) and not leads_away
        unknown = i >= task.rows.guarded and now == 0.0
        if has_crossed(task, w, i, end, j) and right and not unknown:
            root = lane.low + (lane.high - lane.low) * min(max(now / (now - end), 0.0), 1.0)
        elif lane.low > 0.0:
            root = _extrapolated(lane, w, i, j)
        if 0.0 <= root < lane.high and (first < 0.0 or root < first):
            first = root
    if first < 0.0 and lane.low == 0.0 and lane.tries == 0:
        first = 0.0  # it leaves 0, mostly at once
    return first


@numba.njit(**INNER)
def _extrapolated(lane, w, i, j):
    """Return where a function is 0 by its last values on the near side, -1 if it goes elsewhere."""
    # By a secant, and where there are three values by the parabola through them, one step of
    # Newton's method from there.
    before, now, length = w.events.g_before[i, j], w.events.g_low[i, j], lane.low - lane.low_before
    if before * now <= 0.0 or abs(now) >= abs(before):
        return -1.0
    slope = (now - before) / length
    root = lane.low - now / slope
    if lane.low_before > 0.0:
        bend = (slope - (before - w.events.g_start[i, j]) / lane.low_before) / lane.low
        steeper = slope + bend * (2.0 * root - lane.low - lane.low_before)
        if steeper * slope > 0.0:
            nearer = root - bend * (root - lane.low) * (root - lane.low_before) / steeper
            root = nearer if nearer > lane.low else root
    return root
