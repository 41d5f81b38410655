"""Whether a run of the method "auto" changes to Taylor's method, or back from it."""

from __future__ import annotations

import numba

from ..state import INNER

FIRST_TURN = 20  # steps after which it is judged whether this method pays
MEASURED = 50  # the last explicit steps before that


@numba.njit(**INNER)
def is_to_change(task, lane):
    """Whether a run of the method "auto" is to go on by Taylor's method, or not any more."""
    # Both are measured in turn, see `nlctl.native.taylor.turns`.
    if task.taylor.compared == 0:
        return False
    if lane.stiff:
        lane.from_t, lane.from_tried = lane.t, lane.accepted + lane.rejected
        return False
    tried = lane.accepted + lane.rejected - lane.from_tried
    if task.taylor.highest == 0 and lane.span - tried >= MEASURED:
        lane.from_t, lane.from_accepted = lane.t, lane.accepted
    if task.taylor.highest and tried % FIRST_TURN == 0:
        stays = 2 * (lane.accepted - lane.from_accepted) < FIRST_TURN  # at a place
        lane.from_accepted = lane.accepted
        if stays:
            return True
    if lane.tries > 0 or lane.cross > 0.0 or tried < lane.span:
        return False
    work = task.taylor.cost * tried if task.taylor.highest else min(tried, MEASURED)
    lane.pace = (lane.t - lane.from_t) / work
    if task.taylor.highest == 0:
        if 2 * (lane.accepted - lane.from_accepted) >= MEASURED:
            return lane.slow == 0
        lane.from_tried = lane.accepted + lane.rejected  # at a place that it does not leave
        return False
    if lane.span > FIRST_TURN or lane.pace < lane.other_pace:
        return True
    lane.span = lane.stay
    return False
