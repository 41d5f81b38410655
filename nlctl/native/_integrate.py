"""Integration of members side by side: step control, events, memory, output samples.

Each round tries one step for every member ("lane") that is still running.  Members have their own
times and step sizes and never see each other.  A single run is one lane, and may also use the
stiff method.  All of a run's state lies in arrays that the caller holds, so that it can be
interrupted after any number of rounds and go on.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numba
import numpy as np

from . import _rodas5p, _tsit5
from ._events import AGAIN, CLEAR, EVENT, locate, step_accepted
from ._lane import DIVERGED, FIRST_PATIENCE, LANES, OK, RUNNING, STEP_LIMIT, STEP_TOO_SMALL, STIFF
from ._stiff import stiff_attempt
from ._work import AUTO, OUT, RHS, Task, evaluate, memory_rates, new_work, outputs, restart, start

TRIAL = 20  # steps of the stiff method before it is judged


@numba.njit(cache=True, error_model="numpy")
def _choose_step(task, lane):
    """Set the step to be tried, or the status of a run that has come to its end."""
    last = task.times.size - 1
    if lane.segment >= last:
        lane.status = OK
    elif lane.accepted + lane.rejected >= task.max_steps:
        lane.status = STEP_LIMIT
    elif not lane.h > 4e-16 * max(abs(lane.t), 1e-300):
        lane.status = STEP_TOO_SMALL if np.isfinite(lane.error_before) else DIVERGED
    if lane.status != RUNNING:
        lane.step = 0.0
    elif lane.tries == 0:
        # with inputs a step ends at the next corner, without at the end of the run
        stop = task.times[lane.segment + 1] if task.inputs.shape[0] else task.times[last]
        lane.ends = 1 if lane.t + 1.01 * lane.h >= stop else 0
        lane.step = stop - lane.t if lane.ends else lane.h


@numba.njit(cache=True, error_model="numpy")
def _explicit_attempt(rhs, task, lanes, w):
    """Try a step of Tsitouras' pair in all lanes."""
    n, count = w.x.shape
    for j in range(count):
        w.h[j] = lanes[j].step
    for i in range(n):
        for j in range(count):
            w.hh[i * count + j] = w.h[j]
    k, x = w.k.reshape((_tsit5.STAGES, n * count)), w.x.reshape(-1)
    for s in range(1, _tsit5.STAGES):
        target = w.x_new if s == 6 else w.x_stage
        _tsit5._combined(x, w.hh, k, s, target.reshape(-1))
        for j in range(count):
            w.t[j] = lanes[j].t + _tsit5.C[s] * w.h[j]
        evaluate(rhs, task, lanes, w, target, w.k[s], w.g)
    _tsit5.errors(w.x, w.x_new, w.x_stage, w.k, w.h, task.rtol, task.atol, w.error, w.rate)


@numba.njit(cache=True, error_model="numpy")
def _sample(task, lane, w, l, t_new, states):
    """Fill the output samples that the accepted step of a lane has passed."""
    last = task.times.size - 1
    while lane.segment < last and task.times[lane.segment + 1] <= t_new:
        lane.segment += 1
        theta = (task.times[lane.segment] - lane.t) / lane.step
        target = states[lane.segment]
        if theta >= 1.0:
            target[:, l] = w.x_new[:, l]  # exactly the solution, not its interpolant
        elif lane.stiff:
            _rodas5p.interpolate(theta, w.x, w.x_new, w.U, target)
        else:
            _tsit5.interpolate(theta, lane.step, w.x, w.k, l, target)


@numba.njit(cache=True, error_model="numpy")
def _next_step(task, lane, error, rate):
    """Propose the next step after an accepted one: PI control, and stability."""
    factor = 0.9 * max(error, 1e-10) ** -0.14 * lane.error_before**0.08
    h = lane.step * min(10.0, max(0.2, factor))
    cut_short = lane.step < lane.h  # by an event or the end: no reason for a smaller one
    lane.h = max(h, lane.h) if cut_short and error < 1.0 else h
    lane.error_before = max(error, 1e-10)
    lane.rate = rate
    if task.fixed > 0.0:
        lane.h = task.fixed
    elif not lane.stiff:
        # at the limit of stability the rates of memories are noise
        limit = 2.0 if task.memory.size else 0.8 * _tsit5.STABLE
        lane.slow = lane.slow + 1 if lane.h * rate > limit else 0
        if task.memory.size and lane.slow:
            lane.h = limit / rate


@numba.njit(cache=True, error_model="numpy")
def _judge(task, lane, w, l, states):
    """Accept or reject the step just tried; return AGAIN, CLEAR or EVENT."""
    error = w.error[l]
    if task.fixed > 0.0 and np.isfinite(error):
        error = min(error, 1.0)
    if not error <= 1.0:  # NaN and infinity are rejected as well
        lane.rejected += 1
        lane.tries = 0
        lane.h = lane.step * (max(0.2, 0.9 * error**-0.2) if np.isfinite(error) else 0.1)
        if task.fixed > 0.0:
            lane.status = DIVERGED
        if not np.isfinite(error) and not lane.h > 4e-16 * max(abs(lane.t), 1e-300):
            lane.status = DIVERGED
        return AGAIN
    w.e[: task.corners, l] = w.g[: task.corners, l]
    found = locate(lane, task.corners, task.rtol, w.e_start, w.e_low, w.e_high, w.e, l)
    if found == AGAIN:
        lane.rejected += 1
        return found
    stop = task.times[lane.segment + 1] if task.inputs.shape[0] else task.times[-1]
    t_new = stop if lane.ends else lane.t + lane.step
    _sample(task, lane, w, l, t_new, states)
    step_accepted(lane, found == EVENT)
    lane.t = t_new
    _next_step(task, lane, error, w.rate[l])
    return found


@numba.njit(cache=True, error_model="numpy")
def _began_to_move(task, w, l):
    """Whether a memory that stood still at the start of the accepted step moves at its end."""
    for i in range(task.corners, w.e.shape[0]):
        if w.e_start[i, l] == 0.0 and w.e[i, l] != 0.0:
            return True
    return False


@numba.njit(cache=True, error_model="numpy")
def _take(task, w, done):
    """Make the ends of the accepted steps the states, and commit the memories."""
    n, count = w.x.shape
    for i in range(n):
        for j in range(count):
            w.x[i, j] = w.x_new[i, j] if done[j] else w.x[i, j]
            w.k[0, i, j] = w.k[6, i, j] if done[j] else w.k[0, i, j]
    for i in range(task.memory.size):
        for j in range(count):
            if done[j] and w.e_start[task.corners + i, j] == 0.0:  # otherwise locked
                w.x[task.memory[i], j] = w.g[task.corners + i, j]
    for i in range(w.e.shape[0]):
        for j in range(count):
            w.e_start[i, j] = w.e[i, j] if done[j] else w.e_start[i, j]


@numba.njit(cache=True, error_model="numpy")
def _choose_method(task, lane, w):
    """Go over to the stiff method where stability limits the step, and back where it does not pay.

    The stiff method is first tried; it stays while its steps are longer than the explicit ones by
    more than what they cost.
    """
    if task.method != AUTO:
        return
    if not lane.stiff:
        if lane.slow >= lane.patience * (1 if task.alone else 100):
            lane.slow, lane.explicit_step = 0, lane.h
            lane.stiff = 1 if task.alone else 0
            lane.status = RUNNING if task.alone else STIFF
        return
    lane.stiff += 1
    if lane.stiff % TRIAL == 0:
        cost = 0.2 * (w.x.shape[0] + 10)
        limit = _tsit5.STABLE / max(lane.rate, 1e-300)
        pays = lane.h > cost * limit
        if lane.stiff == TRIAL:
            lane.patience = FIRST_PATIENCE if pays else min(2 * lane.patience, 2000)
        if not pays:
            lane.stiff, lane.h = 0, min(lane.h, limit)


def advance(rhs, task, lanes, w, states, rounds):
    """Try at most `rounds` steps in every lane; fill ``states[m, :, lane]`` for passed times.

    A run's ``lane.status`` is RUNNING until it has ended.
    """
    done, passed = np.zeros(lanes.size, np.bool_), np.zeros(lanes.size, np.bool_)
    for _ in range(rounds):
        running = 0
        for l in range(lanes.size):
            if lanes[l].status == RUNNING:
                _choose_step(task, lanes[l])
                running += lanes[l].status == RUNNING
        if not running:
            return
        if lanes[0].stiff:
            stiff_attempt(rhs, task, lanes, w)
        else:
            _explicit_attempt(rhs, task, lanes, w)
        if task.memory.size:
            for l in range(lanes.size):
                w.t_end[l] = lanes[l].t + lanes[l].step
            memory_rates(rhs, task, lanes, w, w.x_new, w.k[6])
        any_passed = False
        for l in range(lanes.size):
            found = AGAIN
            if lanes[l].status == RUNNING:
                found = _judge(task, lanes[l], w, l, states)
            done[l] = found != AGAIN
            passed[l] = found == EVENT or (done[l] and _began_to_move(task, w, l))
            any_passed |= passed[l]
        _take(task, w, done)
        if any_passed and task.memory.size:
            restart(rhs, task, lanes, w, passed)
        for l in range(lanes.size):
            if done[l]:
                _choose_method(task, lanes[l], w)


@functools.cache
def machine_code() -> dict[str, Callable[..., None]]:
    """Return the compiled functions: made when first needed, from the cache in later sessions."""
    one = np.zeros(1)
    task = numba.typeof(Task(one, one[None], one[None], 0, np.zeros(1, np.int64), 0.0, 0.0, 0.0, 0, 0, 0))
    work = numba.typeof(new_work(1, 1, 1, 1))
    samples = numba.float64[:, :, ::1]
    signatures = {
        start: (RHS, task, LANES, work),
        advance: (RHS, task, LANES, work, samples, numba.int64),
        outputs: (RHS, OUT, task, work, samples, samples),
    }
    return {
        function.__name__: numba.njit(
            numba.void(*arguments), cache=True, nogil=True, error_model="numpy"
        )(function)
        for function, arguments in signatures.items()
    }
