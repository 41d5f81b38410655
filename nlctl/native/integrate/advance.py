"""Integration of batched members: step control, events, memory, output samples.

Each round tries one step for every member ("lane") that is still running.  Members have their own
times and step sizes and never see each other.  A single run is one lane, and may also use the
stiff method.  All of a run's state lies in arrays that the caller holds, so that it can be
interrupted after any number of rounds and go on.
"""

from __future__ import annotations

import numba
import numpy as np

from .control import choose_method, choose_step, limit_step, next_step, rejected
from .delays import is_full, keep, look_within, unresolved
from .evaluate import inputs_at
from .events.crossing import NOTHING, crossing, left_to_other_side
from .events.excursions import look_between
from .events.functions import at_zero, begin_next, has_events, is_of_relay
from .events.kinks import crossed_before, look_at_kinks
from .events.location import (
    AGAIN,
    CLEAR,
    EVENT,
    REFUSED,
    SHORT,
    jumped,
    locate,
    locate_jump,
    step_accepted,
)
from .events.near_side import look_before
from .events.rest import counts, ends_at_rest, note_rest
from .events.sharp import forget, look_at_sharp
from .log import OF_TIME, log_is_full, note
from .methods import explicit, taylor
from .methods.dense import solution_at
from .methods.stiff import UNKNOWN, stiff_attempt
from .methods.turn import is_to_change
from .resets import fall
from .restart import continue_behind_kinks, memory_rates, restart
from .samples import begin_afresh, next_stop, pass_jumps, take_samples
from .state import AUTO, DERIVATIVES, ENDED, INNER, METHOD, RUNNING, is_stiff, opposite

_ROUGH = 0.01  # part of a function's value: what ends a step right behind its kink is less


@numba.njit(**INNER)
def _sample(lane, j, task, t_new, w):
    """Fill the output samples that the accepted step of a lane has passed."""
    times, x, x_new, last = task.times, w.x, w.x_new, task.times.size - 1
    while lane.segment < last and times[lane.segment + 1] <= t_new:
        lane.segment += 1
        theta = (times[lane.segment] - lane.t) / lane.step
        target = w.samples[lane.segment]
        if theta >= 1.0:
            for i in range(x.shape[0]):
                target[i, j] = x_new[i, j]  # exactly the solution, not its interpolant
        else:
            solution_at(theta, task, lane, w, j, target)


@numba.njit(**INNER)
def _judge(task, lanes, w, found):
    """Say what became of the step just tried in every lane: refused, tried AGAIN, CLEAR, EVENT."""
    for j in range(lanes.size):
        lane = lanes[j]
        found[j] = REFUSED
        if lane.status != RUNNING:
            continue
        if task.rows.switching > task.rows.declared:
            found[j] = crossing(task, lane, w, j)
            if found[j] == AGAIN:
                lane.rejected += 1
            if found[j] == AGAIN or found[j] == REFUSED or (lane.across and found[j] != NOTHING):
                continue
        if rejected(lane, w.error[j], task, taylor.least_part(task, w, j)):
            found[j], lane.returns = REFUSED, 0
            continue
        found[j] = CLEAR
        is_behind = task.rows.memory.size > 0 and jumped(task, lane, w, j)
        if is_behind or lane.seeks > 0:
            found[j] = locate_jump(lane, task.rtol, is_behind)
        elif has_events(w):
            found[j] = locate(lane, task, w, j)
            if found[j] == EVENT and task.fixed == 0.0:
                found[j] = crossed_before(task, lane, w, j)
        if found[j] == AGAIN:
            lane.rejected += 1
            lane.cross = 0.0
        elif task.rows.ways.size and ends_at_rest(task, lane, w, j):
            found[j] = REFUSED


@numba.njit(**INNER)
def _accept(task, lanes, w, found, done, passed):
    """Accept the steps that were found to be right, and propose the next."""
    # ``done`` becomes whether one was accepted, ``passed`` whether it ended with an event or set a
    # memory in motion. Return whether any lane has passed.
    any_passed, memories = False, task.rows.memory.size
    for j in range(lanes.size):
        lane, event = lanes[j], found[j] == EVENT
        done[j] = passed[j] = False
        if found[j] <= AGAIN or (
            task.lines.delays.shape[0] and unresolved(task, lane, w, j, event)
        ):
            continue
        t_new = next_stop(task, lane, w, j) if lane.ends else lane.t + lane.step
        if t_new >= task.times[lane.segment + 1]:
            _sample(lane, j, task, t_new, w)
        _counted(task, lane, w, event, j)
        lane.begun, lane.t = lane.t, t_new
        if task.timed.opaque > 0.0:
            lane.rests = _rests(task, w, j)
        if lane.across:
            lane.left_zero = _from_zero(task, w, False, j)
            lane.across, lane.cross = 0, 0.0
        else:
            lane.left_zero = lane.left_zero and _from_zero(task, w, False, j)
            next_step(lane, w.error[j], w.rate[j], task)
        if task.fixed == 0.0 and has_events(w):
            lane.h = min(lane.h, w.inside.resolved[j])
        done[j] = True
        if memories:  # at a break point of the inputs memories may reverse as well
            at_break_point = lane.ends and w.u.shape[0] > 0
            if task.lines.delays.shape[0]:  # what arrives there is known, see `keep`
                at_break_point = task.inputs.shape[0] > 0 and lane.t == task.times[lane.segment]
            passed[j] = at_break_point or _began_to_move(w, j)
        passed[j] |= event
        any_passed |= passed[j]
        if task.method == AUTO:
            choose_method(lane, task)
    return any_passed


@numba.njit(**INNER)
def _counted(task, lane, w, event, j):
    """Count an accepted step; where a condition stays exactly 0 its steps across stay wide."""
    misses = lane.misses
    if event and _jumps_at_kink(task, w, j):
        lane.noisy = 1
    step_accepted(lane, event, event and not _switches(task, w, j))
    is_short = lane.step < SHORT * lane.h  # a longer one has led somewhere: it is another condition
    if misses > 0 and is_short and _from_zero(task, w, True, j):
        lane.misses = misses  # what shorter ones add to a state is lost in rounding


@numba.njit(**INNER)
def _jumps_at_kink(task, w, j):
    """Whether a function has jumped over its kink at the end of a step, as rounding does."""
    for i in range(task.rows.bending, task.rows.declared):
        before, now = w.events.g_start[i, j], w.events.g[i, j]
        if opposite(before, now) and abs(now) > _ROUGH * abs(before):
            return True
    return False


@numba.njit(**INNER)
def _switches(task, w, j):
    """Whether a step ends at an event of a switching function, and not where a memory turns."""
    for i in range(task.rows.guarded):
        before, now = w.events.g_start[i, j], w.events.g[i, j]
        if opposite(before, now) and not at_zero(task, w, i, w.events.g_start, j):
            return True
        if left_to_other_side(task, w, i, j):
            return True
    for i in range(task.rows.guarded, task.rows.switching):
        if w.guards.above[i - task.rows.guarded, j] != 0 and w.events.g[i, j] < 0.0:
            return True
    return False


@numba.njit(**INNER)
def _from_zero(task, w, stays, j):
    """Whether a step began where a condition was exactly 0, and it stays so, or has left that."""
    for i in range(task.rows.declared, task.rows.guarded):
        if w.events.g_start[i, j] == 0.0 and (w.events.g[i, j] == 0.0) == stays:
            return 1
    return 0


@numba.njit(**INNER)
def _rests(task, w, j):
    """Whether an accepted step has moved no state by more than its tolerance."""
    for i in range(w.x.shape[0]):
        if abs(w.x_new[i, j] - w.x[i, j]) > task.atol + task.rtol * abs(w.x[i, j]):
            return 0
    return 1


@numba.njit(**INNER)
def _began_to_move(w, j):
    """Whether a memory that stood still at the start of the accepted step moves at its end."""
    rate_start, rate = w.memories.rate_start, w.memories.rate
    for i in range(rate.shape[0]):  # noqa: SIM110 (no generators in machine code)
        if rate_start[i, j] == 0.0 and rate[i, j] != 0.0:
            return True
    return False


@numba.njit(**INNER)
def _take(task, lanes, w, done, passed):
    """Make the ends of the accepted steps the states, and commit the memories."""
    # Return whether one has moved without an event: there what is compared with it is another.
    x, k, events, rows, last = w.x, w.k, w.events, task.rows, w.k.shape[0] - 1
    moved = False
    for j in range(done.size):
        if not done[j]:
            continue
        w.taylor.expanded[j] = 0
        for i in range(x.shape[0]):
            x[i, j] = w.x_new[i, j]
            k[0, i, j] = k[last, i, j]
        for i in range(rows.declared):
            events.behind[i, j] = opposite(events.g_start[i, j], events.g[i, j])
        for i in range(rows.declared, rows.guarded):
            before, now = events.g_start[i, j], events.g[i, j]
            if now != 0.0 or before != 0.0:
                events.behind[i, j] = np.sign(before) if now == 0.0 else 0.0
        for i in range(rows.memory.size):
            m, become = rows.memory[i], w.memories.m[i, j]
            stands = w.memories.rate_start[i, j] == 0.0 or w.memories.rate[i, j] == 0.0
            if stands and x[m, j] != become:  # otherwise locked
                x[m, j] = become
                for c in range(rows.declared):
                    events.behind[c, j] = 0.0  # with another memory the way back is an event
                if lanes[j].quiet == 0:
                    passed[j] = moved = True
        begin_next(task, w, j)
    return moved


@numba.njit(**INNER)
def _look_ahead(rhs, task, lanes, w):
    """Fill the rates of memories at the ends of the steps just tried."""
    for j in range(lanes.size):
        w.ahead.begin[j] = lanes[j].t + lanes[j].step
    memory_rates(rhs, task, lanes, w, w.x_new, w.k[w.k.shape[0] - 1])


@numba.njit(**INNER)
def _attempt(rhs, point, along, task, lanes, w):
    """Try a step in every lane, by the method of the run."""
    if is_stiff(lanes[0]):
        stiff_attempt(rhs, point, along, task, lanes, w)
    elif task.taylor.highest:
        taylor.taylor_attempt(rhs, task, lanes, w)
    else:
        explicit.explicit_attempt(rhs, task, lanes, w)


@numba.njit(**INNER)
def _chosen(task, lanes, w):
    """Choose the next steps; return in how many lanes there is one."""
    running = 0
    for j in range(lanes.size):
        if lanes[j].status == RUNNING:
            over = lanes[j].segment == task.times.size - 1
            limit_step(task, lanes[j], j)
            choose_step(lanes[j], next_stop(task, lanes[j], w, j), over, task.max_steps)
            running += lanes[j].status == RUNNING
    return running


@numba.njit(**INNER)
def _jump(rhs, task, lanes, w, done, passed, sampled, any_passed):
    """Let happen what is due at the ends of accepted steps, and begin again behind that."""
    memories = task.rows.memory.size > 0
    again = memories and any_passed
    if task.lines.delays.shape[0]:
        again |= keep(task, lanes, w, done, passed)
        if memories and w.past.bends.any():
            again |= continue_behind_kinks(rhs, task, lanes, w, passed)
    elif not memories:
        passed[:] = False
    again |= _happens(task, lanes, w, passed, sampled)
    if again:
        restart(rhs, task, lanes, w, passed)
        forget(lanes, w, passed)
    if task.rows.guarded < task.rows.switching:
        for j in range(lanes.size):
            done[j] |= passed[j]
        fall(rhs, task, lanes, w, done)


def advance(rhs, point, along, task, w, rounds):
    """Try at most `rounds` steps in every lane; fill ``w.samples[m, :, lane]`` for passed times."""
    # A run's ``lane.status`` is RUNNING until it has ended, or DERIVATIVES where it cannot go on
    # before the stiff method knows where to get its Jacobian from, or METHOD where another one pays
    # or is needed.
    lanes, rows = w.lanes, task.rows
    done, passed = np.zeros(lanes.size, np.bool_), np.zeros(lanes.size, np.bool_)
    sampled, found = np.zeros(lanes.size, np.bool_), np.zeros(lanes.size, np.int64)
    for tried in range(rounds):
        if task.taylor.highest:
            taylor.expand(task, lanes, w)
            if lanes[0].status == METHOD:
                return
        if not _chosen(task, lanes, w):
            return
        if is_full(task, lanes, w) or log_is_full(task, lanes, w):
            lanes[0].untried = rounds - tried
            return
        if lanes[0].stiff and task.stiff.derivatives == UNKNOWN:
            lanes[0].status = DERIVATIVES
            return
        _attempt(rhs, point, along, task, lanes, w)
        if task.lines.delays.shape[0]:
            look_within(task, lanes, w)
        if rows.memory.size:
            _look_ahead(rhs, task, lanes, w)
        _judge(task, lanes, w, found)
        if rows.watched < rows.switching and task.fixed == 0.0:
            look_at_kinks(rhs, task, lanes, w, found)
        if has_events(w) and not task.taylor.highest:
            look_between(rhs, task, lanes, w, found)
        look_at_sharp(task, lanes, w, found)
        if rows.memory.size:
            look_before(rhs, task, lanes, w, found)
        any_passed = _accept(task, lanes, w, found, done, passed)
        _note_events(task, lanes, w, found, done)
        any_passed |= _take(task, lanes, w, done, passed)
        _see(task, lanes, w)
        _jump(rhs, task, lanes, w, done, passed, sampled, any_passed)
        if rows.ways.size:
            _note_jumps(task, lanes, w, done)
            _look_at_inputs(task, lanes, w)
        if lanes[0].status == RUNNING and is_to_change(task, lanes[0]):
            lanes[0].status = METHOD
            return


@numba.njit(**INNER)
def _see(task, lanes, w):
    """Keep what the functions that the run watches are, before anything jumps."""
    for i in range(task.rows.watched, task.rows.watched + task.rows.ways.size):
        for j in range(lanes.size):
            w.events.before_jump[i, j] = w.events.g_start[i, j]


@numba.njit(**INNER)
def _note_jumps(task, lanes, w, done):
    """Note the functions that the run watches whose signs have jumped at the ends of steps."""
    # With a condition of t alone, a sample, or a state behind a guard's fall. One that has jumped
    # to 0 is noted where it leaves that for the other side, by another jump or without.
    events = w.events
    for i in range(task.rows.watched, task.rows.watched + task.rows.ways.size):
        ends = task.rows.ending[i - task.rows.watched]
        for j in range(lanes.size):
            before, now = events.before_jump[i, j], events.g_start[i, j]
            if not done[j] or before == now:
                continue
            came = events.behind[i, j] if before == 0.0 else before
            leaves = opposite(came, now) or (came == 0.0 and abs(now) > 0.0 and not ends)
            if leaves and counts(task, lanes[j], i, now):
                note(task, lanes[j], w, lanes[j].t, i, now > 0.0, j)
            events.behind[i, j] = np.sign(before) if now == 0.0 else 0.0
            if now == 0.0 and abs(before) > _ROUGH * events.largest[i, j]:
                events.side[i, j] = 0.0  # that counts where it jumps on


@numba.njit(**INNER)
def _look_at_inputs(task, lanes, w):
    """Leave in w.u the inputs where a run has ended."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t
    if lanes[0].status == ENDED and w.u.shape[0]:
        inputs_at(task, lanes, w)


@numba.njit(**INNER)
def _note_events(task, lanes, w, found, done):
    """Note the switching functions that have changed their signs in accepted steps."""
    # Guards are noted where they fall. Where none has changed its sign it was a memory.
    events, rows = w.events, task.rows
    for j in range(lanes.size):
        if done[j]:
            _note_left(task, lanes[j], w, found[j] == EVENT, j)
            if found[j] != EVENT and w.memories.rate_start[:, j].any():
                lanes[j].turned = 0
        if not done[j] or found[j] != EVENT:
            continue
        turns = 1 if rows.memory.size else 0
        for i in range(rows.guarded):
            before, now = events.g_start[i, j], events.g[i, j]
            if opposite(before, now):
                turns = 0
                if at_zero(task, w, i, events.g_start, j) or at_zero(task, w, i, events.g, j):
                    continue  # noted where it has left that
                if is_of_relay(task, i):
                    continue  # noted where it has settled
                events.came[i, j] = 2.0 * np.sign(now)  # until it is seen there
                if counts(task, lanes[j], i, now):
                    note(task, lanes[j], w, lanes[j].t, i, _rises(task, w, i, now, j), j)
            elif left_to_other_side(task, w, i, j):
                turns = 0
        for i in range(rows.guarded, rows.switching):
            if w.guards.above[i - rows.guarded, j] != 0 and events.g[i, j] < 0.0:
                turns = 0
        if turns and not (lanes[j].at_once > 0.0 and lanes[j].turned):  # that is the same one
            lanes[j].turns += 1
            lanes[j].turned = 1


@numba.njit(**INNER)
def _rises(task, w, i, now, j):
    """Whether what switches rises where its function changes its sign to that of `now`."""
    # Functions of integers rise and fall in turns: the partner's sign says what that means.
    partner = task.rows.partners[i]
    return (now > 0.0) != (partner != 0 and partner * w.events.g[i + partner, j] > 0.0)


@numba.njit(**INNER)
def _note_left(task, lane, w, located, j):
    """Note conditions that a step has led away from 0: to the side that they do not come from."""
    # What has been 0 since the run began comes from neither; no run ends by that. What blocks
    # declare is 0 as long as a memory is carried along: where it turns is no event.
    events, rows = w.events, task.rows
    for i in range(rows.bending if rows.memory.size else 0, rows.guarded):
        before, now, came = events.g_start[i, j], events.g[i, j], events.came[i, j]
        if 0 <= i - rows.watched < rows.ways.size and note_rest(task, lane, w, i, j):
            continue
        at_start = at_zero(task, w, i, events.g_start, j)
        if not at_start or at_zero(task, w, i, events.g, j) or now != now:
            continue
        if came == 0.0 and i >= rows.watched and rows.ending[i - rows.watched]:
            continue
        if came == 0.0 and i < rows.bending:
            continue
        if came == 0.0 or opposite(came, now):
            t = lane.t if located and came != 0.0 and before == 0.0 else lane.begun
            if counts(task, lane, i, now):
                note(task, lane, w, t, i, _rises(task, w, i, now, j), j)


@numba.njit(**INNER)
def _happens(task, lanes, w, passed, sampled):
    """Let happen what is due at the times that lanes have come to; add them to ``passed``."""
    # Return whether anything is.
    again = False
    if task.timed.jumps.shape[1] and pass_jumps(task, lanes, sampled):
        again = True
        for j in range(lanes.size):
            passed[j] |= sampled[j]
            lanes[j].log_error_before *= 0.0 if sampled[j] else 1.0
            if sampled[j]:
                note(task, lanes[j], w, lanes[j].t, OF_TIME, True, j)
    if task.clocks.ticks.size and take_samples(task, lanes, w, sampled):
        again = True
        for j in range(lanes.size):
            passed[j] |= sampled[j]
        begin_afresh(task, lanes, w, sampled)
    return again
