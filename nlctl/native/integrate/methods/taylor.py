"""One step of Taylor's method for batched members: the polynomial is a step and its dense output.

The routine of a diagram fills its coefficients where the step begins, see `nlctl.native.taylor`.
The right-hand side itself judges the polynomial: at the end of a step its slope must be what the
right-hand side is there.  That defect sees whatever the coefficients do not know of, such as a kink
that was passed over.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ...machine.address import (
    call_expansion,
    call_growth,
    call_judge,
    call_rhs,
    call_step,
    call_values,
)
from ..control import LEAST_PART, SMALLEST
from ..evaluate import hold_memories, input_rates, inputs_at
from ..events.crossing import BEFORE_CONDITION
from ..events.location import SMALL_KINK, behind_event, is_kink, triggered
from ..memory import Places1, Places2, Reals1, Reals2, Reals3, with_table, zeros
from ..state import INNER, METHOD, RUNNING, STIFF, opposite
from .carried import (
    fill_slopes,
    foreseen_turn,
    memory_row,
    part_of_rates,
    turns_inside,
    turns_until,
)
from .crossings import (
    PLACES_LOOKED_AT,
    falls_at_once,
    first_crossing,
    followed_part,
    is_at,
    part_behind_root,
    side_left_to,
)
from .dips import value_and_slope

SLOPES = 2  # slopes at both ends of a step
_AIM = 0.25  # of the tolerance: what the error of a step is to be
_BRIEF = 0.01  # part of a step: a nearer break point is located by trying
_PLACES = 4  # at 0.9, 0.99, ... of a step that ends at an event
_BEFORE = 3.0  # times as far before an event as a step may end behind it
_LEAST = 1e-4  # part of a step that is tried next before what polynomials foresee
_SHORTEST = 1e-12  # of the times: a step in which nothing is compared
_LONGER, _LEFT = 16.0, 1e6  # times as long; and times the shortest, after which a place is left
_EXPANSION, _GROWTH, _STEP, _JUDGE, _VALUES = 0, 1, 2, 3, 4  # functions of task.taylor.functions


class TaylorMethod(NamedTuple):
    """A diagram's Taylor coefficients, of runs by this method."""

    highest: int  # order, 0 for other methods
    functions: Places1
    sides: Places2  # rows of comparisons, see `taylor.routine.Series`
    c: Reals2  # what the functions read besides their arguments
    compared: int  # whether a run may change to another method
    cost: float  # of a step, in explicit ones
    table: Places2


class TaylorArrays(NamedTuple):
    """The coefficients of the steps being tried."""

    terms: Reals3  # (orders, rows, lanes), see `taylor.routine.Series`
    expanded: Places1  # 1 where they are those of the step being tried
    u_rate: Reals2  # (inputs, lanes)
    largest: Reals2  # of coefficients, or of what a step lacks, over the tolerance
    shifted: Reals1  # one polynomial around another place, see `dips`
    table: Places2


OTHER_METHOD = with_table(
    TaylorMethod, highest=0, functions=np.zeros(0, dtype=np.int64),
    sides=np.zeros((0, 3), dtype=np.int64), c=np.zeros((1, 1)), compared=0, cost=0.0,
)  # fmt: skip


def new_terms(orders: int, rows: int, inputs: int, lanes: int) -> TaylorArrays:
    """Return the arrays for so many orders and rows of coefficients."""
    return with_table(
        TaylorArrays, terms=zeros((orders, rows, lanes)), expanded=np.zeros(lanes, dtype=np.int64),
        u_rate=np.zeros((inputs, lanes)), largest=np.zeros((4, lanes)), shifted=np.zeros(orders),
    )  # fmt: skip


@numba.njit(**INNER)
def expand(task, lanes, w):
    """Fill the coefficients of lanes that have gone on, and propose the steps that these allow."""
    # A step that is tried again with another length has its coefficients already.
    taylor = w.taylor
    stale, series = False, task.taylor.functions
    for j in range(lanes.size):
        w.t[j] = max(lanes[j].t, lanes[j].right)
        stale |= lanes[j].status == RUNNING and taylor.expanded[j] == 0
    if not stale:
        return
    if w.u.shape[0]:
        inputs_at(task, lanes, w)
        for j in range(lanes.size):
            input_rates(task, lanes[j].segment, 0, taylor.u_rate, j)
    call_expansion(series[_EXPANSION], w.t, w.x, w.u, taylor.u_rate, task.taylor.c, taylor.terms)
    call_growth(series[_GROWTH], w.x, task.taylor.c, taylor.terms, taylor.largest)
    for j in range(lanes.size):
        lane = lanes[j]
        if taylor.expanded[j] == 0:
            fill_slopes(task, w, j)
        if taylor.expanded[j] == 0 and lane.status == RUNNING and _lacks_terms(task, w, j):
            lane.status = METHOD if task.alone else STIFF
        if taylor.expanded[j] == 0 and task.fixed == 0.0:
            h = _length(task.taylor.highest, taylor.largest, j)
            if h > 0.0:
                lanes[j].h = _followed(task, w, h, j)
            if _begins_at_jump(task, taylor.terms, j):
                lanes[j].h = _leaving(task, lanes[j])
        taylor.expanded[j] = 1


@numba.njit(**INNER)
def _lacks_terms(task, w, j):
    """Whether coefficients are not finite where states and rates are, as of sqrt(t) at 0."""
    taylor, lacks, total = w.taylor, False, 0.0
    for i in range(taylor.largest.shape[0]):
        total += taylor.largest[i, j]
    if np.isfinite(total):
        return False
    for i in range(w.x.shape[0]):
        if not np.isfinite(taylor.terms[0, i, j] + taylor.terms[1, i, j]):
            return False
        for k in range(2, task.taylor.highest + 1):
            lacks |= not np.isfinite(taylor.terms[k, i, j])
    return lacks


@numba.njit(**INNER)
def _followed(task, w, h, j):
    """Return up to which step, of h at most, the polynomials are followed that are looked at."""
    if h <= _shortest(task):
        return h
    part, p, terms = part_of_rates(task, w, h, j), task.taylor.highest - 1, w.taylor.terms
    for i in range(task.rows.switching):
        row = w.x.shape[0] + i
        part = min(part, followed_part(p, h, terms, row, _unseen(task, i), j))
    for i in range(task.taylor.sides.shape[0]):
        part = min(part, followed_part(p, h, terms, task.taylor.sides[i, 0], 0.0, j))
    return max(part * h, _shortest(task))


@numba.njit(**INNER)
def _unseen(task, i):
    """Return within what of 0 a switching function may be without an event, see `first_root`."""
    return SMALL_KINK * task.atol if i < task.rows.declared else 0.0


@numba.njit(**INNER)
def _begins_at_jump(task, terms, j):
    """Whether something compared is equal where the step begins, and is not right behind."""
    # The right-hand side may have another value there than on the side on which the solution goes
    # on, and with it the first coefficients: steps that leave the place are tried first. What a
    # memory takes part in is equal where it has just turned, and nothing jumps there.
    for i in range(task.taylor.sides.shape[0]):
        side = task.taylor.sides[i, 1]
        if task.taylor.sides[i, 2]:
            continue
        if terms[0, side, j] == 0.0 and terms[task.taylor.highest - 1, side, j] != 0.0:
            return True
    return False


@numba.njit(**INNER)
def _leaving(task, lane):
    """Return a step that leaves a place where something compared is equal."""
    # Longer each time: it may be equal, to rounding, at the end of a short one as well; and in the
    # end as long as any other.
    shortest, gone = _shortest(task), lane.t - lane.leaving
    if not 0.0 <= gone <= _LEFT * shortest:
        lane.leaving, gone = lane.t, 0.0
    longer = max(_LONGER * gone, shortest)
    return lane.h if longer > _LEFT * shortest else min(lane.h, longer)


@numba.njit(**INNER)
def _shortest(task):
    """Return the step up to which nothing is compared."""
    return _SHORTEST * max(abs(task.times[0]), abs(task.times[task.times.size - 1]))


@numba.njit(**INNER)
def _length(highest, largest, j):
    """Return the step whose error is likely to be `_AIM`, by how the last terms grow."""
    a, b, c, d = largest[0, j], largest[1, j], largest[2, j], largest[3, j]
    ratio = 0.0
    for each in (a / b, np.sqrt(a / c), np.sqrt(b / d)):
        if ratio < each < np.inf:  # where a term vanishes the others say it
            ratio = each
    return (_AIM / max(a * ratio, b * ratio * ratio)) ** (1.0 / (highest + 1.0))


@numba.njit(**INNER)
def taylor_attempt(rhs, task, lanes, w):
    """Try a step in all lanes: fill w.x_new, the slope there, the event functions, the error."""
    series, dx = task.taylor.functions, w.k[w.k.shape[0] - 1]
    if task.rows.switching or task.rows.memory.size:
        _aim(task, lanes, w)
    for j in range(lanes.size):
        w.h[j], w.hh[j] = lanes[j].step, lanes[j].step
        w.t[j] = min(lanes[j].t + w.h[j], lanes[j].left)
    call_step(series[_STEP], w.h, task.taylor.c, w.taylor.terms, w.x_new, w.ahead.dx)
    if w.u.shape[0]:
        inputs_at(task, lanes, w)
    call_rhs(rhs, w.t, w.x_new, w.u, task.p, dx, w.events.g, w.memories.m)
    hold_memories(task, dx)
    call_judge(
        series[_JUDGE], w.h, w.x, w.x_new, w.ahead.dx, dx, task.taylor.c, w.taylor.terms,
        w.taylor.largest,
    )  # fmt: skip
    _look_inside(rhs, task, lanes, w)
    for j in range(lanes.size):
        w.error[j], w.rate[j], w.inside.resolved[j] = _error(task, w, j), 0.0, np.inf


@numba.njit(**INNER)
def _look_inside(rhs, task, lanes, w):
    """Look at what is on another side in steps, and at the defect in those that end at an event."""
    # There it is right before the event, and at places ever closer to it: the end lies behind, and
    # at an event a defect may vanish that is large before, of friction near rest for instance.
    inside = w.inside
    wanted = False
    for j in range(lanes.size):
        _compare(task, lanes[j], w, j)
        inside.wanted[j] = inside.looked[j] == 0.0 and _ends_at_event(task, lanes[j], w, j)
        if inside.wanted[j]:
            inside.looked[j], inside.foreseen[j] = 1.0 - _BEFORE * behind_event(task.rtol), 0.5
        wanted |= inside.looked[j] > 0.0
    away = 1.0
    for n in range(_PLACES + 1):
        if wanted:
            _look_across(rhs, task, lanes, w)
        wanted, away = False, 0.1 * away
        for j in range(lanes.size):
            if n < _PLACES and inside.wanted[j] and inside.looked[j] == 0.0:
                inside.looked[j], wanted = 1.0 - away, True


@numba.njit(**INNER)
def _aim(task, lanes, w):
    """Shorten steps to right behind the first event that polynomials of the lanes foresee."""
    # That is where `locate` would end after some attempts.
    for j in range(lanes.size):
        w.inside.part[j] = 1.0
    events_at(task, lanes, w, w.ahead.g)
    for j in range(lanes.size):
        lane, first = lanes[j], 1.0
        if lane.tries == 0:
            lane.at_once = 0.0
        for i in range(task.rows.switching if lane.tries == 0 and lane.across == 0 else 0):
            if _meets(task, w, i, w.ahead.g[i, j], j) and not falls_at_once(task, w, i, j):
                ends = w.events.g_start[i, j], w.ahead.g[i, j]
                root = part_behind_root(
                    task.taylor.highest - 1, lane.step, w.taylor.terms, w.x.shape[0] + i, ends,
                    _rest(task, i), j,
                )  # fmt: skip
                part = _behind(task, lane, i, root)
                if part > _BRIEF or i >= task.rows.declared:
                    first = min(first, part)
            elif i < task.rows.declared and opposite(w.events.g_start[i, j], w.ahead.g[i, j]):
                first = min(first, _farthest(task, w, i, lane.step, j))
        if lane.tries == 0 and lane.across == 0:
            first = min(first, foreseen_turn(task, lane, w, j))
        if 0.0 < first < 1.0:
            lane.step *= first
            lane.ends = 0


@numba.njit(**INNER)
def _farthest(task, w, i, h, j):
    """Return the part of a step h at which it is farthest behind the event that it begins with."""
    # It goes back through that event in the step, which is none of its own from so near to it; 1 if
    # it is behind nowhere.
    p, row, start = task.taylor.highest - 1, w.x.shape[0] + i, w.events.g_start[i, j]
    part, most = 1.0, abs(start) + SMALL_KINK * task.atol
    for n in range(1, PLACES_LOOKED_AT):
        f = value_and_slope(p, n / PLACES_LOOKED_AT * h, w.taylor.terms, row, j)[0]
        if abs(f) > most and not opposite(start, f):
            part, most = n / PLACES_LOOKED_AT, abs(f)
    return part


@numba.njit(**INNER)
def _meets(task, w, i, end, j):
    """Whether an event function has changed its sign in a step, or a guard has fallen."""
    if i >= task.rows.guarded:
        return w.guards.above[i - task.rows.guarded, j] != 0 and end < 0.0
    small = abs(w.events.g_start[i, j]) + abs(end) <= SMALL_KINK * task.atol
    if is_kink(task, i) and small:
        return False  # see `first_root`
    return triggered(w.events.g_start[i, j], end, w.events.behind[i, j] != 0.0)


@numba.njit(**INNER)
def _behind(task, lane, i, root):
    """Return the part of a step that ends right behind an event, by what can be told from none."""
    part = root * (1.0 + _rest(task, i))
    if i < task.rows.declared:
        return part
    return max(part, root + SMALLEST * abs(lane.t + root * lane.step) / lane.step)


@numba.njit(**INNER)
def _rest(task, i):
    """Return by which part of a step one may end behind an event: half of what is allowed."""
    if i < task.rows.declared:
        return 0.5 * behind_event(task.rtol)
    return max(0.5 * BEFORE_CONDITION * task.rtol, 1e-15)


@numba.njit(**INNER)
def events_at(task, lanes, w, g):
    """Fill `g` with the polynomials of the switching functions at w.inside.part of the steps."""
    for j in range(lanes.size):
        w.t[j] = w.inside.part[j] * lanes[j].step
    call_values(task.taylor.functions[_VALUES], w.t, task.taylor.c, w.taylor.terms, g)


@numba.njit(**INNER)
def _error(task, w, j):
    """Return the error of a lane's step over its tolerance; not finite if a state is not."""
    # What the polynomial lacks is e h^(p+1), and its defect (p + 1) e h^p. Where the last term does
    # not foresee a defect of that size, the solution is not smooth, and the defect counts in full.
    # In a step with an event the right-hand side has changed before the end: the last term counts.
    defect, term = w.taylor.largest[0, j], w.taylor.largest[1, j]
    if w.inside.looked[j] != 0.0:  # on another side inside: a shorter step is to be tried
        part = min(max(w.inside.foreseen[j], _LEAST, _shortest(task) / w.h[j]), 0.8)
        return (0.9 / part) ** task.pair.order + 0.0 * (defect + term)
    for i in range(task.rows.switching):
        if _meets(task, w, i, w.events.g[i, j], j):
            return term + 0.0 * defect
    share = defect / (task.taylor.highest + 1.0)
    return share if share <= term else defect + 0.0 * term


@numba.njit(**INNER)
def least_part(task, w, j):
    """Return how much of a step whose error is too large is tried next at least."""
    # The polynomials say how far it is to where something is on another side.
    return _LEAST if task.taylor.highest and w.inside.looked[j] != 0.0 else LEAST_PART


@numba.njit(**INNER)
def _compare(task, lane, w, j):
    """Look whether something compared is on another side inside of a lane's step."""
    # ``foreseen`` becomes the first part of the step at which it is, and ``looked`` where it is
    # farthest there, 0 if nothing is; below 0 if that is more than one comparison. Before an event,
    # if there is one: it is located by itself. What changes so fast that its polynomial says little
    # asks for a shorter step as well. Polynomials are looked at in some places, unless their terms
    # together are less than the first. A shorter step is not asked for without end: what begins so
    # near to a kink that rounding cannot tell may go through it.
    events, inside, taylor = w.events, w.inside, w.taylor
    inside.looked[j], inside.foreseen[j] = 0.0, 1.0
    if not taylor.largest[2, j] > 0.0:
        return
    if w.h[j] <= _shortest(task):
        return
    until, p = 1.0, task.taylor.highest - 1
    for i in range(task.rows.switching):
        before, now = events.g_start[i, j], events.g[i, j]
        if _meets(task, w, i, now, j):
            part = min(max(before / (before - now), 0.0), 1.0)
            until = min(until, lane.low / lane.step if lane.tries else part)
    until = turns_until(task, lane, w, until, j)
    again = turns_inside(task, w, until, j)
    if again < 1.0:
        inside.looked[j], inside.foreseen[j] = -1.0, again
    for i in range(task.rows.switching):
        first, farthest = _other_side(task, w, i, until, j)
        if first < until:  # a step that ends there has an event
            inside.looked[j], inside.foreseen[j] = -1.0, min(inside.foreseen[j], farthest)
    for i in range(task.taylor.sides.shape[0]):
        farthest, row = -1.0, task.taylor.sides[i, 0]
        first = followed_part(p, w.h[j], taylor.terms, row, 0.0, j)
        if first == 1.0:
            side = taylor.terms[p, task.taylor.sides[i, 1], j]
            first, farthest = first_crossing(
                p, w.h[j], taylor.terms, row, side, until, taylor.shifted, j
            )
        if first < until:
            inside.looked[j] = -1.0 if inside.looked[j] != 0.0 else farthest
            inside.foreseen[j] = min(inside.foreseen[j], first)


@numba.njit(**INNER)
def _other_side(task, w, i, until, j):
    """Return where in a step a switching function is on another side first, and where farthest."""
    # 1 for nowhere; -1, and up to where its polynomial says what it is, if that is not all of it.
    p, row, part = task.taylor.highest - 1, w.x.shape[0] + i, _follows(task, w, i, until, j)
    if part < 1.0:
        return -1.0, part
    side = w.events.g_start[i, j]
    if opposite(side, w.events.g[i, j]):
        return 1.0, 1.0
    if side == 0.0:
        side = side_left_to(p, w.taylor.terms, row, j)
    if i >= task.rows.guarded and w.guards.above[i - task.rows.guarded, j] != 0:
        side = 1.0
    return first_crossing(p, w.h[j], w.taylor.terms, row, side, until, w.taylor.shifted, j)


@numba.njit(**INNER)
def _follows(task, w, i, until, j):
    """Return in which part of a step the polynomial of a switching function says what it is."""
    p, row, small = task.taylor.highest - 1, w.x.shape[0] + i, _unseen(task, i)
    part = followed_part(p, w.h[j], w.taylor.terms, row, small, j)
    if part < 1.0 or until < 1.0 or w.h[j] <= 1e6 * _shortest(task):
        return part  # something jumps before the end, or rounding has a say there
    return 1.0 if is_at(p, w.h[j], w.taylor.terms, row, w.events.g[i, j], small, j) else 0.5


@numba.njit(**INNER)
def _ends_at_event(task, lane, w, j):
    """Whether a step may end right behind an event, so that it is accepted."""
    for i in range(task.rows.declared):
        before, now = w.events.g_start[i, j], w.events.g[i, j]
        if triggered(before, now, w.events.behind[i, j] != 0.0):
            low = 0.0
            if lane.tries:
                low, before = lane.low / lane.step, w.events.g_low[i, j]
            root = low + (1.0 - low) * before / (before - now)
            if not 1.0 - root > 0.8 * _BEFORE * behind_event(task.rtol):
                return True
    return False


@numba.njit(**INNER)
def _look_across(rhs, task, lanes, w):
    """Forget what is on another side where the right-hand side is what it would be on this one."""
    # That is the case of a comparison whose result does not matter there, or not yet. Where a step
    # ends behind an event, look at the defect right before the event instead.
    inside = w.inside
    dx, p = w.x_stage, task.taylor.highest
    for j in range(lanes.size):
        if inside.looked[j] > 0.0:
            w.t[j] = min(lanes[j].t + inside.looked[j] * w.h[j], lanes[j].left)
            interpolate(inside.looked[j], w.h[j], p, w.taylor.terms, j, w.ahead.x)
        else:  # anything finite
            w.t[j] = lanes[j].t
            for i in range(w.x.shape[0]):
                w.ahead.x[i, j] = w.x[i, j]
    if w.u.shape[0]:
        inputs_at(task, lanes, w)
    call_rhs(rhs, w.t, w.ahead.x, w.u, task.p, dx, w.ahead.g, w.ahead.m)
    hold_memories(task, dx)
    for j in range(lanes.size):
        limit = p + 1.0 if inside.wanted[j] else 1.0
        if inside.looked[j] > 0.0 and _defect(task, w, dx, j) <= limit:
            inside.looked[j] = 0.0


@numba.njit(**INNER)
def _defect(task, w, dx, j):
    """Return a lane's defect times the step over the tolerance, with dx at what is looked at."""
    largest = 0.0
    for i in range(w.x.shape[0]):
        at = w.inside.looked[j] * w.h[j]
        slope = value_and_slope(task.taylor.highest, at, w.taylor.terms, i, j)[1]
        defect = abs(w.h[j] * (dx[i, j] - slope))
        part = defect / (task.atol + task.rtol * abs(w.ahead.x[i, j]))
        largest = part if part > largest or part != part else largest
    for i in range(task.rows.memory.size):
        becomes = w.ahead.m[i, j]
        foreseen = value_and_slope(
            task.taylor.highest - 1, w.inside.looked[j] * w.h[j], w.taylor.terms,
            memory_row(task, w, i), j,
        )[0]  # fmt: skip
        part = abs(becomes - foreseen) / (task.atol + task.rtol * abs(becomes))
        largest = part if part > largest or part != part else largest
    return largest


@numba.njit(**INNER)
def interpolate(theta, h, highest, terms, j, result):
    """Fill column `j` of `result` with the solution at the fraction theta of its step."""
    distance = theta * h
    for i in range(result.shape[0]):
        result[i, j] = terms[highest, i, j]
    for k in range(highest - 1, -1, -1):
        for i in range(result.shape[0]):
            result[i, j] = result[i, j] * distance + terms[k, i, j]
