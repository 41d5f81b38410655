"""What is known of each member while it is integrated, and how a run ends."""

from __future__ import annotations

from enum import IntEnum

import numba
import numpy as np

from ..machine.export import AS_SHIPPED


class Status(IntEnum):
    """How a run ended."""

    OK = 0
    DIVERGED = 1
    STEP_LIMIT = 2
    STEP_TOO_SMALL = 3
    STOPPED = 4
    CHATTERING = 5
    ZENO = 6
    ENDED = 7


# compiled code's
OK, DIVERGED, STEP_LIMIT, STEP_TOO_SMALL, STOPPED, CHATTERING, ZENO, ENDED = map(int, Status)
RUNNING, STIFF = -1, -2  # STIFF: to be finished by a method that only single runs have
DERIVATIVES = -3  # to go on once it is known where the stiff method has its Jacobian from
METHOD = -4  # to go on by Taylor's method, or again by the explicit one
AUTO, EXPLICIT, IMPLICIT, TAYLOR = 0, 1, 2, 3  # methods
FIRST_PATIENCE = 15
DIRECTIONS = 8  # in which derivatives are taken together
# for functions that only machine code calls: without a way in from Python, which would have to be
# compiled as well
INNER = AS_SHIPPED

_FIELDS = [
    ("t", "f8"),  # time reached
    ("begun", "f8"),  # and time at which the last accepted step has begun
    ("h", "f8"),  # step proposed by error control
    ("step", "f8"),  # step being tried
    ("last", "f8"),  # last accepted step
    ("low", "f8"),  # while an event is located: a step without it
    ("high", "f8"),  # and one with it; 0 when none is being located
    ("log_error_before", "f8"),  # of the last accepted step, for PI control
    ("rate", "f8"),  # estimate of the largest eigenvalue's magnitude (1/s)
    ("jacobian_at", "f8"),  # time for which the Jacobian matrix is known
    ("judged_at", "f8"),  # time at which the methods were last compared
    ("judged_after", "i8"),  # and the steps tried until then
    ("left", "f8"),  # the last time at which functions of t alone are what they are now
    ("right", "f8"),  # and the first
    ("cross", "f8"),  # width of the step that is to lead across a condition next, 0 if none is
    ("across", "i8"),  # whether the step being tried is such a one
    ("misses", "i8"),  # such steps in a row that have not led across
    ("left_zero", "i8"),  # whether the step before led away from a condition that was exactly 0
    ("right_high", "i8"),  # whether the error of the step `high` is small
    ("low_error", "f8"),  # that of the step `low`
    ("low_before", "f8"),  # the step without it that was tried before `low`
    ("at_once", "f8"),  # a step that ends right behind where it begins: a memory turns there
    ("turned", "i8"),  # whether a memory has turned, and none has been carried since
    ("whole", "f8"),  # the step in which the condition that is being located was found
    ("fell_at", "f8"),  # time of the last reset
    ("since", "f8"),  # time of the first of the resets without progress of time
    ("crowd", "i8"),  # resets in a row without progress of time
    ("culprit", "i8"),  # the guard that has fallen last, or has ended the run
    ("resumes", "i8"),  # whether a sample has been taken at the last time, see `Work.resume`
    ("noted", "i8"),  # what has happened: entries of the log
    ("untried", "i8"),  # of the first lane: steps that a window has left, for want of room
    ("turns", "i8"),  # steps that ended where a memory turns or jumps, and nothing else happens
    ("jump", "i8"),  # which of their break points comes next
    ("nearly", "i8"),  # whether the attempt ends nearly where that is, by the last two attempts
    ("traces", "i8"),  # whether what is being located is a condition
    ("returns", "i8"),  # whether that was found in a step that ends behind a break point
    ("rests", "i8"),  # whether no state has moved by more than its tolerance in the last step
    ("segment", "i8"),  # interval of the time grid in which t lies
    ("tick", "i8"),  # what happens next to sampled blocks
    ("status", "i8"),
    ("accepted", "i8"),
    ("rejected", "i8"),
    ("events", "i8"),  # steps that ended with an event or a turn
    ("tries", "i8"),  # attempts at the event being located
    ("seeks", "i8"),  # whether that is where a memory jumps that no switching function tells of
    ("same_side", "i8"),  # of these in a row with the event inside
    ("short", "i8"),  # turns of memories in a row right after another
    ("quiet", "i8"),  # steps in which memory events are not looked for
    ("noisy", "i8"),  # whether the last step has met a kink of a function that is rounding
    ("kinks", "i8"),  # how many more such steps there have been than others
    ("dull", "i8"),  # steps in which kinks are not located
    ("longer", "i8"),  # how often that has been so: each time for longer
    ("slow", "i8"),  # steps in a row whose size stability limits
    ("patience", "i8"),  # such steps that are borne before the stiff method is tried
    ("pace", "f8"),  # how far this method gets with the work of an explicit step (s), see `turns`
    ("other_pace", "f8"),  # and the other one did
    ("from_t", "f8"),  # time from which that is measured
    ("from_accepted", "i8"),  # steps accepted until then
    ("from_tried", "i8"),  # steps tried until this method's turn
    ("span", "i8"),  # steps of its turn
    ("stay", "i8"),  # and of Taylor's method where it pays, before it is compared again
    ("wait", "i8"),  # explicit steps before Taylor's method is tried again, if it does not pay
    ("stiff", "i8"),  # 0 explicit, otherwise 1 + steps of the stiff method
    ("leaving", "f8"),  # time from which short steps lead away from where something is equal
    ("ends", "i8"),  # the step being tried ends at a break point of the inputs or at the end
]
LANE = np.dtype((np.record, _FIELDS))


def new_lanes(times: np.ndarray, count: int) -> np.ndarray:
    """Return `count` members at the first time."""
    lanes = np.zeros(count, LANE)
    lanes["t"] = times[0]
    lanes["jacobian_at"] = np.nan
    lanes["status"] = RUNNING
    lanes["left"], lanes["right"] = np.inf, -np.inf
    lanes["rests"] = 1
    lanes["fell_at"] = lanes["leaving"] = np.nan
    lanes["culprit"] = -1
    lanes["patience"] = FIRST_PATIENCE
    return lanes


@numba.njit(**INNER)
def opposite(a, b):
    """Whether one number is below 0 and the other above; their product may be 0 by rounding."""
    return a < 0.0 < b or b < 0.0 < a


@numba.njit(**INNER)
def is_stiff(lane):
    """Whether the step being tried is one of the stiff method."""
    # One that leads across a condition is explicit: it is as short as can be, and begins with the
    # right-hand side of the near side, while stages that look behind would hold it back.
    return lane.stiff != 0 and lane.across == 0
