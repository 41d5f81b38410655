"""What steps may pass over: break points crossed and crossed back, memories that turned twice.

Error control sees the states only.  Where a switching function, or what drives a memory, is not a
state (a dead zone behind a source), a step may grow until both of its ends lie on one side of a
break point although it has been on the other in between.

Each event function is followed through a step by the polynomial through five of its values, three
of them at stages, which cost nothing.  Where that may be below 0 in between, by what it may be
wrong, the function itself is evaluated on the solution inside the step: its minimum is sought until
it is found to be below 0, and a step that ends there is tried instead; or above 0, or 0 to within
1e-12 of the range.  So only what lies between two of the five values unseen is lost; the next step
is never longer than what a polynomial of this degree follows to a tenth of the range.
"""

from __future__ import annotations

import numba
import numpy as np

from ..control import shorten
from ..methods.dense import events_at_parts
from ..methods.quartic import doubt, least_value, parabola, quartic, slope_at
from ..restart import AHEAD
from ..state import INNER, is_stiff
from .functions import is_of_relay
from .location import AGAIN, SHORT, STARTS_BEHIND, goes_over_kinks, is_kink

_CLEAR, _SUSPECT, _UNRESOLVED = 0, 1, 2  # what is known of an event function in a step
_HOPELESS = 0.6  # part of a step in which a smooth function can be followed, after one or two such
_SHORTER = 0.3  # part of a step to be tried where its event functions cannot be followed
_FAR = 20.0  # in ranges: what is so far from 0 may grow before it is followed
_FOLLOWED = 0.2  # of the range: what the polynomial may be wrong by at most
_FLAT = 8.0  # in doubts: a slope at an end that may as well have the other sign
_DENSE = 2  # the row of task.pair.inside that is no method's stages
_NARROW = 1e-6  # part of a step: a minimum is not below what is so near by more than its square
_TOUCHING = 0.01  # the same at a start on the break point, where a memory has turned
_TRIES = 24  # looks at one function in one step
_DOUBLE = 2.0  # growth of a step up to which the noise of stages does not count


@numba.njit(**INNER)
def look_between(rhs, task, lanes, w, found):
    """Have shorter steps tried where an accepted one has passed over something."""
    # ``found`` becomes AGAIN there, and w.inside.resolved the longest step to be tried next.
    inside, wanted, any_wanted = w.inside, w.inside.wanted, False
    shortest = 1e-7 * (task.times[-1] - task.times[0])
    for j in range(lanes.size):
        inside.resolved[j] = np.inf
        wanted[j] = (
            found[j] > AGAIN
            and not (lanes[j].across and lanes[j].step < SHORT * lanes[j].h)
            and lanes[j].step > shortest
            and _suspected(task, lanes[j], w, j)
        )
        any_wanted |= wanted[j]
    if not any_wanted:
        return
    for n in range(3):
        for j in range(lanes.size):
            inside.part[j] = task.pair.inside[_DENSE, n] if wanted[j] else 0.0
        events_at_parts(rhs, task, lanes, w, w.events.g_inside[n], w.memories.m_inside[n])
    seeking = False
    for j in range(lanes.size):
        inside.sought[j] = -1
        if wanted[j]:
            _go_on(task, lanes[j], w, found, False, 0, j)
        seeking |= inside.sought[j] >= 0
    while seeking:
        _evaluated(rhs, task, lanes, w)
        seeking = False
        for j in range(lanes.size):
            if inside.sought[j] >= 0:
                _narrow(task, lanes[j], w, found, j)
            seeking |= inside.sought[j] >= 0


@numba.njit(**INNER)
def _suspected(task, lane, w, j):
    """Whether the values at a method's stages leave anything to be looked at."""
    row = 1 if is_stiff(lane) else 0
    if task.pair.inside[row, 0] == 0.0:
        return True  # no such stages
    suspected = False
    for i in range(w.events.g.shape[0]):
        if not _is_far(w, i, j):
            # Nothing follows from stages of the stiff method, which are of a low order.
            suspected |= row == 1 or _known(task, lane, w, i, j, row)[0] != _CLEAR
    for i in range(w.memories.m.shape[0]):
        suspected |= _known_memory(task, lane, w, i, j, row)[0] != _CLEAR
    return suspected


@numba.njit(**INNER)
def _known(task, lane, w, i, j, row):
    """Return what is known of a switching function, and where it may be least."""
    # Of `f`, which is above 0 at both ends of the step: sign times the function plus offset.
    inside, at = w.inside, task.pair.inside[row]
    values = inside.values
    if is_of_relay(task, i) or (is_kink(task, i) and goes_over_kinks(task, lane)):
        return _CLEAR, 0.0
    sign, offset = _side(w, i, j)
    values[0] = sign * w.events.g_start[i, j] + offset
    values[4] = sign * w.events.g[i, j] + offset
    for n in range(3):
        values[n + 1] = sign * w.events.g_inside[n, i, j] + offset
    quartic(values, at, inside.newton)
    inside.wrong[j] = doubt(inside.newton, at)
    extent = max(values[0], values[1], values[2], values[3], values[4]) - _least(values)
    if extent <= _still(task, w, j):
        return _CLEAR, 0.0
    longer = (0.1 * extent / max(inside.wrong[j], 1e-300)) ** (1 / 3)
    if task.rows.memory.size and row != _DENSE:
        longer = max(longer, _DOUBLE)  # stages may be less accurate than what follows from them
    if longer < _HOPELESS and is_kink(task, i):
        lane.noisy = 1
    inside.resolved[j] = min(inside.resolved[j], longer * lane.step)
    return _judged(task, w, at, extent, 0.0, False, j)


@numba.njit(**INNER)
def _known_memory(task, lane, w, i, j, row):
    """Return what is known of a memory, and where its rate, as `f` of `_known`, may be least."""
    memories, inside, at = w.memories, w.inside, task.pair.inside[row]
    if memories.rate_start[i, j] == 0.0:
        return _standing(task, w, i, j, row)
    if row != _DENSE:
        return _may_turn(lane, w, i, j), 0.0
    values, newton = inside.values, inside.newton
    sign, offset = _side_of_memory(lane, w, i, j)
    values[0], values[4] = sign * memories.m_start[i, j], sign * memories.m[i, j]
    for n in range(3):
        values[n + 1] = sign * memories.m_inside[n, i, j]
    quartic(values, at, newton)
    first = sign * lane.step * memories.slope_start[i, j]
    last = sign * lane.step * memories.slope[i, j]
    begin, finish = slope_at(newton, at, 0.0), slope_at(newton, at, 1.0)
    inside.wrong[j] = max(abs(begin - first), abs(finish - last))
    values[0], values[4] = first + offset, last + offset
    for n in range(3):
        values[n + 1] = slope_at(newton, at, at[n]) + offset
    extent = max(values[0], values[1], values[2], values[3], values[4])
    if extent <= _still(task, w, j):
        return _CLEAR, 0.0
    return _judged(task, w, at, extent, offset, True, j)


@numba.njit(**INNER)
def _judged(task, w, at, extent, offset, carried, j):
    """Return what five values of `f` say of a step in which it has that extent."""
    inside, touches = w.inside, w.inside.values[0] == 0.0
    inside.narrow[j] = _TOUCHING if touches else _NARROW
    inside.floor[j] = max(inside.narrow[j] ** 2 * extent, task.atol if touches else 0.0)
    wrong = inside.wrong[j]
    if wrong > _FOLLOWED * extent:
        return _UNRESOLVED, min(max(least_value(inside.newton, at, carried)[1], 0.02), 0.98)
    if _least(inside.values) > extent:
        return _CLEAR, 0.0
    lower, x = least_value(inside.newton, at, carried)
    if lower + offset <= 2.0 * wrong and _leads_away(w, at, x, carried, j):
        lower, x = least_value(inside.newton, at, carried, True)  # it may come back
    if lower + offset > 2.0 * wrong:
        return _CLEAR, 0.0
    return _SUSPECT, min(max(x, 0.02), 0.98)


@numba.njit(**INNER)
def _least(values):
    """Return the least of five values."""
    return min(values[0], values[1], values[2], values[3], values[4])


@numba.njit(**INNER)
def _still(task, w, j):
    """Return what a function changes by that stands still: rounding, of memories for instance."""
    largest = 0.0
    for i in range(w.memories.m.shape[0]):
        largest = max(largest, abs(w.memories.m[i, j]))
    return 0.01 * task.atol + 1e-14 * largest


@numba.njit(**INNER)
def _leads_away(w, at, x, carried, j):
    """Whether a function that is least at an end of the step has no minimum near there."""
    values, newton, steep = w.inside.values, w.inside.newton, _FLAT * w.inside.wrong[j]
    if x == 0.0:
        return values[1] > values[0] and _slope(newton, at, 0.0, carried) > steep
    return x == 1.0 and _slope(newton, at, 1.0, carried) < -steep


@numba.njit(**INNER)
def _is_far(w, i, j):
    """Whether 0 is far from all values of a switching function, or one is NaN."""
    events = w.events
    a, b, c, d, e = (
        *(events.g_start[i, j], events.g_inside[0, i, j], events.g_inside[1, i, j]),
        *(events.g_inside[2, i, j], events.g[i, j]),
    )
    least, most = min(a, b, c, d, e), max(a, b, c, d, e)
    near = _FAR * (most - least)
    return not (least <= near and most >= -near)


@numba.njit(**INNER)
def _may_turn(lane, w, i, j):
    """Whether a memory that is carried along may turn twice: _SUSPECT, by rates at both ends."""
    # At the stages it may be far less accurate than at the ends, where other states follow from it.
    memories = w.memories
    change = memories.m[i, j] - memories.m_start[i, j]
    first, last = lane.step * memories.slope_start[i, j], lane.step * memories.slope[i, j]
    wrong = abs(change - 0.5 * (first + last))
    noise = 1e-12 * abs(memories.m[i, j])
    if wrong > _FOLLOWED * (abs(change) + abs(first) + abs(last)) + noise:
        return _SUSPECT
    side = 1.0 if first > 0.0 else -1.0
    middle = side * (1.5 * change - 0.25 * (first + last))
    low = min(middle, side * last)
    return _SUSPECT if low < wrong and wrong > noise else _CLEAR


@numba.njit(**INNER)
def _slope(newton, at, x, carried):
    """Return how fast `f` changes at an end."""
    if not carried:
        return slope_at(newton, at, x)
    inner = x + (0.01 if x == 0.0 else -0.01)
    return (slope_at(newton, at, inner) - slope_at(newton, at, x)) / (inner - x)


@numba.njit(**INNER)
def _side(w, i, j):
    """Return sign and offset that make a switching function positive at both ends of a step."""
    # Where a step ends right behind its event, twice of that rest is the level; where it begins
    # right behind one and ends in front of it, twice of that rest.
    start, end = w.events.g_start[i, j], w.events.g[i, j]
    side = 1.0 if start > 0.0 or (start == 0.0 and w.events.g_inside[0, i, j] > 0.0) else -1.0
    if side * end >= 0.0:
        return side, 0.0
    if w.events.behind[i, j] != 0.0 and abs(start) <= STARTS_BEHIND * abs(end):
        return -side, 2.0 * abs(start)
    return side, -2.0 * side * end


@numba.njit(**INNER)
def _side_of_memory(lane, w, i, j):
    """Return the same for the rate of a memory that is carried along."""
    side = 1.0 if w.memories.rate_start[i, j] > 0.0 else -1.0
    end = lane.step * w.memories.slope[i, j]
    return side, (0.0 if side * end >= 0.0 else -2.0 * side * end)


@numba.njit(**INNER)
def _standing(task, w, i, j, row):
    """Whether a memory that stands still at both ends of a step has moved in between, and where."""
    memories, before = w.memories, w.x[task.rows.memory[i], j]
    if memories.rate[i, j] == 0.0 and memories.m[i, j] == before:
        for n in range(3):
            if abs(memories.m_inside[n, i, j] - before) > task.atol + task.rtol * abs(before):
                return _SUSPECT, task.pair.inside[row, n]
    return _CLEAR, 0.0


@numba.njit(**INNER)
def _go_on(task, lane, w, found, carried, first, j):
    """Go on to the next event function that is to be looked at, from `first` on."""
    # Memories, if it is one that is carried, otherwise switching functions and then memories.
    w.inside.sought[j] = -1
    for i in range(w.events.g.shape[0] if carried else first, w.events.g.shape[0]):
        if not _is_far(w, i, j):
            known, x = _known(task, lane, w, i, j, _DENSE)
            if _has_to_look(task, lane, w, found, known, x, True, j):
                w.inside.sought[j], w.inside.carried[j] = i, 0
                return
            if found[j] == AGAIN:
                return
    for i in range(first if carried else 0, 0 if lane.quiet > 0 else w.memories.m.shape[0]):
        known, x = _known_memory(task, lane, w, i, j, _DENSE)
        if known == _SUSPECT and w.memories.rate_start[i, j] == 0.0:
            shorten(lane, x)
            found[j] = AGAIN
            return
        growing = lane.step > _DOUBLE * lane.last  # otherwise the noise of a memory's rate counts
        if _has_to_look(task, lane, w, found, known, x, growing, j):
            w.inside.sought[j], w.inside.carried[j] = i, 1
            return
        if found[j] == AGAIN:
            return


@numba.njit(**INNER)
def _has_to_look(task, lane, w, found, known, x, growing, j):
    """Whether the minimum of a function is to be sought; `found` becomes AGAIN if unresolved."""
    if known == _UNRESOLVED and growing:
        if task.fixed == 0.0 and lane.tries == 0:
            shorten(lane, _SHORTER)
            found[j] = AGAIN
        else:
            known = _SUSPECT
    if known == _SUSPECT:
        _bracket(w, x, j)
        w.inside.attempts[j] = 0
    return known == _SUSPECT


@numba.njit(**INNER)
def _bracket(w, x, j):
    """Begin to look at x, between the nearest known values: one of them below its neighbours."""
    inside = w.inside
    k = min(int(4.0 * x), 3)
    inner = k + 1 if inside.values[k + 1] < inside.values[k] else k
    low, high = (k, k + 1) if inner == 0 or inner == 4 else (inner - 1, inner + 1)
    for n, place in enumerate((low, inner, high)):
        inside.bracket[n, j], inside.height[n, j] = 0.25 * place, inside.values[place]
    if inner == 0 or inner == 4:
        inside.bracket[1, j] = -1.0
    inside.part[j], inside.foreseen[j] = x, np.inf


@numba.njit(**INNER)
def _narrow(task, lane, w, found, j):
    """Take a value of the function that is sought into its bracket; say where to look next."""
    inside = w.inside
    x, y, i = inside.part[j], inside.looked[j], inside.sought[j]
    inside.attempts[j] += 1
    if y < -inside.floor[j]:
        shorten(lane, x)
        found[j], inside.sought[j] = AGAIN, -1
        return
    low, middle, high = inside.bracket[0, j], inside.bracket[1, j], inside.bracket[2, j]
    seen = abs(y - inside.foreseen[j]) < 0.3 * y
    if not y > -np.inf or inside.attempts[j] > _TRIES or high - low < inside.narrow[j]:
        _go_on(task, lane, w, found, inside.carried[j] != 0, i + 1, j)
        return
    if middle < 0.0 or y < inside.height[1, j]:
        end = 2 if middle > x else 0
        if middle >= 0.0:
            inside.bracket[end, j], inside.height[end, j] = middle, inside.height[1, j]
        inside.bracket[1, j], inside.height[1, j] = x, y
    else:
        end = 2 if x > middle else 0
        inside.bracket[end, j], inside.height[end, j] = x, y
    _aim(w, j)
    if seen and 0.5 * inside.height[1, j] < inside.foreseen[j] < np.inf:
        _go_on(task, lane, w, found, inside.carried[j] != 0, i + 1, j)


@numba.njit(**INNER)
def _aim(w, j):
    """Set where to look next: at the vertex of the parabola, or towards an end that is lower."""
    inside = w.inside
    low, middle, high = inside.bracket[0, j], inside.bracket[1, j], inside.bracket[2, j]
    below, least, above = inside.height[0, j], inside.height[1, j], inside.height[2, j]
    inside.foreseen[j] = np.inf
    if least > below or least > above:
        end = 0 if below < above else 2
        inside.part[j] = inside.bracket[end, j] + 0.3 * (middle - inside.bracket[end, j])
        inside.bracket[2 - end, j], inside.height[2 - end, j] = middle, least
        inside.bracket[1, j] = -1.0
        return
    slope, bend = parabola(low, middle, high, below, least, above)
    move = -0.5 * slope / bend if bend > 0.0 else 0.0
    rest = 1e-3 * (high - low)
    if abs(move) < rest:
        move = rest if high - middle > middle - low else -rest
    x = min(max(middle + move, low + rest), high - rest)
    inside.part[j] = x
    inside.foreseen[j] = least + (x - middle) * (slope + bend * (x - middle))


@numba.njit(**INNER)
def _evaluated(rhs, task, lanes, w):
    """Fill ``looked`` with the functions that are sought, each at its ``part`` of the step."""
    inside, any_carried = w.inside, False
    for j in range(lanes.size):
        if inside.sought[j] < 0:
            inside.part[j] = 0.0
        any_carried |= inside.sought[j] >= 0 and inside.carried[j] != 0
    g, m = w.events.g_inside[3], w.memories.m_inside[3]
    events_at_parts(rhs, task, lanes, w, g, m)
    if any_carried:
        for j in range(lanes.size):
            inside.part[j] += AHEAD
        events_at_parts(rhs, task, lanes, w, w.ahead.g, w.ahead.m)
        for j in range(lanes.size):
            inside.part[j] -= AHEAD
    for j in range(lanes.size):
        i = inside.sought[j]
        if i < 0:
            continue
        if inside.carried[j]:
            sign, offset = _side_of_memory(lanes[j], w, i, j)
            inside.looked[j] = sign * ((w.ahead.m[i, j] - m[i, j]) / AHEAD) + offset
        else:
            sign, offset = _side(w, i, j)
            inside.looked[j] = sign * g[i, j] + offset
