"""A run without derivatives, where the one with them has no end.

It may slide along what the other switches at, or rest where a sign is 0 to the last digit: with its
derivatives it has other steps, and comes back to it from both sides.
"""

from dataclasses import replace

import numpy as np

from ..native.chattering.steps import Jump
from ..native.driver import Course, run_once, slid_from
from ..native.integrate.state import Status
from ..native.results import Statistics, Trajectory
from ..native.slid import SlidRun

_WITHIN = 100.0  # tolerances of a state: two runs come to rest
_ENDLESS = (Status.ZENO, Status.CHATTERING, Status.STEP_LIMIT)


def run_alone(course: Course, reached: Trajectory, x0: np.ndarray, p: np.ndarray) -> SlidRun:
    """Return the run without derivatives, which may slide, if the one with them has no end."""
    if reached.statistics.status not in _ENDLESS:
        return SlidRun(compiled=course.compiled, p=p, reached=reached)
    plain = run_once(course, x0, p)
    slid = slid_from(course, plain, x0, p)
    if slid.slides or plain.statistics.status is not Status.OK:
        return slid
    jump = _where_it_ended(course, reached.statistics, x0, p)
    done = plain.statistics  # of which it is known within tolerances where it was just then
    wider = {"rtol": _WITHIN * done.rtol, "atol": _WITHIN * done.atol}
    seen = replace(done, status=Status.CHATTERING, jump=jump, **wider)
    other = slid_from(course, replace(plain, statistics=seen), x0, p)
    return other if other.slides else slid


def _where_it_ended(course: Course, done: Statistics, x0: np.ndarray, p: np.ndarray) -> Jump:
    """Return the place in a run without derivatives where the one with them has ended."""
    compiled, before = course.compiled, course.times < done.time
    if done.jump is not None:
        return done.jump.first(compiled.system.nstates or 0, compiled.schedule.ninputs)
    if not before.any():
        return Jump(times=(done.time, done.time), before=x0, after=x0, inputs=course.inputs[:, 0])
    now = [[np.interp(done.time, course.times, row)] for row in course.inputs]
    inputs = np.hstack([course.inputs[:, before], np.reshape(now, (len(now), 1))])
    times = np.append(course.times[before], done.time)
    there = run_once(replace(course, times=times, inputs=inputs), x0, p)
    x, u = there.states[:, -1], there.inputs[:, -1]
    return Jump(times=(done.time, done.time), before=x, after=x, inputs=u)
