"""Transport delays in a run: what delayed signals were, step by step, and when breaks arrive.

A diagram with delays is integrated by the method of steps: a step ends when what a delay is given
at its beginning leaves it, so that what leaves a delay is known before the step.  That is kept as
one polynomial of degree 5 for each step, through the signal at Chebyshev points of the dense
output; how large its last coefficient is belongs to the error of the step.  These points are
inside of the step: at its end a signal may have jumped already.

Where the derivative of order `level` of a signal jumps, a step ends when that arrives: behind the
delay the same derivative jumps, and one behind an integrator the next one.  What is smoother than
the integrator notices is forgotten.  Between breaks a polynomial of one side alone is read.

Arrays have the member ("lane") as their last index, as everywhere here.
"""

from __future__ import annotations

from fractions import Fraction

import numba
import numpy as np

from ..machine.address import call_out
from .control import LEAST_PART, rejected
from .delayed import DEGREE, arrival, next_arrival, past_value, piece_at, sent
from .evaluate import inputs_at, on_this_side
from .methods import explicit
from .state import INNER, RUNNING

SMOOTH = 6  # level that a method of order 5 takes for smooth
# rounded, and what follows from them is exact: last bits of cosines and inverses differ by machine
_NODES = np.round(np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1)), 12)
POINTS = 0.5 - 0.5 * _NODES


def _powers_at(nodes: list[Fraction]) -> np.ndarray:
    """Return what makes of values at nodes z the coefficients of 1, z, z^2, ... that take them."""
    columns = []
    for node in nodes:
        column = [Fraction(1)]
        for other in (z for z in nodes if z != node):
            shifted = zip([0, *column], [*column, 0], strict=True)
            column = [(low - other * high) / (node - other) for low, high in shifted]
        columns.append(column)
    return np.ascontiguousarray(np.array(columns, dtype=float).T)


POWERS = _powers_at([Fraction(float(z)) for z in 2 * POINTS - 1])  # z = 2 theta - 1
IN_CHEBYSHEV = 2.0 ** (1 - DEGREE)  # of a power of z in the Chebyshev polynomial of the same degree
JUMP = 1e-10  # of the time: a step so short that its signals still bend in has a jump inside
ROUNDING = 1e-15  # of the time: two breaks so close are one
CONNECTED = 10.0  # times the tolerance: what polynomials may miss of a signal that has not jumped
PAST_PIECES = 4  # pieces of the past that a step reads at most


@numba.njit(**INNER)
def next_break(task, w, lane, j, stop):
    """Return where a step must end for the delays of a lane, at `stop` at the latest."""
    lines = task.lines
    first = min(stop, next_arrival(task, w, j))
    for i in range(lines.delays.shape[0]):
        first = min(first, arrival(task, i, j, lane.t), _read(task, w, lane, i, j))
        for k in range(lines.kinks.shape[1] if lines.varied[i] else 0):
            if lines.kinks[i, k] > lane.t:
                first = min(first, lines.kinks[i, k])
                break
    return stop if stop - first <= ROUNDING * abs(stop) else first


@numba.njit(**INNER)
def _read(task, w, lane, i, j):
    """Return when a step that begins now has read enough of the past of a line."""
    # Pieces are short where a signal moves: a longer step would go over a pulse that was kept. A
    # step that was given is taken as it is.
    past = w.past
    now = piece_at(past.t, j, past.first[i, j], past.kept[j] - 1, sent(task, i, j, lane.t))
    ahead = now + PAST_PIECES
    if task.fixed > 0.0 or ahead >= past.kept[j]:
        return np.inf
    return arrival(task, i, j, past.t[ahead, j])


@numba.njit(**INNER)
def is_full(task, lanes, w):
    """Whether there is no place for another step in a lane that is running."""
    for j in range(lanes.size if task.lines.delays.shape[0] else 0):
        if lanes[j].status == RUNNING and w.past.kept[j] == w.past.t.shape[0]:
            return True
    return False


@numba.njit(**INNER)
def look_within(task, lanes, w):
    """Look at the signals within the step just tried; and at what polynomials miss of them."""
    past = w.past
    for s in range(DEGREE + 1):
        for j in range(lanes.size):
            w.t[j] = lanes[j].t + POINTS[s] * lanes[j].step
            past.missed[j], past.missed_at_end[j] = 0.0, 0.0
            explicit.interpolate(POINTS[s], lanes[j].step, w.x, w.k, task.pair.B, j, w.x_stage)
        _see_signals(task, lanes, w, w.x_stage, past.seen[s])
    for j in range(lanes.size):
        w.t[j] = lanes[j].t
    _see_signals(task, lanes, w, w.x, past.seen[DEGREE + 1])
    for j in range(lanes.size):
        w.t[j] = lanes[j].t + lanes[j].step
    _see_signals(task, lanes, w, w.x_new, past.seen[DEGREE + 2])
    for j in range(lanes.size):
        _fit(task, w, j)


@numba.njit(**INNER)
def _see_signals(task, lanes, w, x, seen):
    """Fill what arrives at the lines at the times w.t, on this side of switches of t."""
    if task.timed.jumps.shape[1]:
        on_this_side(lanes, w)
    inputs_at(task, lanes, w)
    call_out(task.lines.signals[0], w.t, x, w.u, task.p, seen)


@numba.njit(**INNER)
def _fit(task, w, j):
    """Make a lane's polynomials, and compare them with what they do not go through."""
    past = w.past
    own = task.outputs
    for i in range(task.lines.delays.shape[0]):
        largest, begin, end, sign = 0.0, 0.0, 0.0, 1.0
        for n in range(DEGREE + 1):
            total = 0.0
            for s in range(DEGREE + 1):
                total += POWERS[n, s] * past.seen[s, own + i, j]
            past.tried[i, n, j] = total
            begin, end, sign = begin + sign * total, end + total, -sign
            size = abs(past.seen[n, own + i, j])
            largest = size if size > largest else largest
        tolerance = task.atol + task.rtol * largest
        last = IN_CHEBYSHEV * abs(past.tried[i, DEGREE, j]) / tolerance
        missed = max(last, abs(begin - past.seen[DEGREE + 1, own + i, j]) / tolerance)
        if missed > past.missed[j] or last != last:  # what is NaN stays so
            past.missed[j] = missed + 0.0 * last
        missed = abs(end - past.seen[DEGREE + 2, own + i, j]) / tolerance
        if missed > past.missed_at_end[j] or missed != missed:
            past.missed_at_end[j] = missed


@numba.njit(**INNER)
def unresolved(task, lane, w, j, event):
    """Whether polynomials miss too much of a step in which nothing else is wrong."""
    # A jump that no switching function tells of is driven into a very short step, and accepted.
    # Right behind an event the signal at the end says nothing of the step; and nothing is asked of
    # a step across a condition: its polynomials have both sides in them, see `keep`.
    past = w.past
    if event and lane.across:
        past.missed[j] = -1.0
        return False
    if not event and not past.missed_at_end[j] <= past.missed[j]:
        past.missed[j] = past.missed_at_end[j]
    short = lane.step <= JUMP * max(abs(lane.t), task.lines.delays[0, j])
    if short and past.missed[j] > 1.0:
        past.missed[j] = -1.0
        return False
    if rejected(lane, past.missed[j], task, LEAST_PART):
        return True
    w.error[j] = max(w.error[j], past.missed[j])
    return False


@numba.njit(**INNER)
def keep(task, lanes, w, done, passed):
    """Keep the signals of the accepted steps, and let arrive what arrives at their ends."""
    # ``passed`` becomes where derivatives are to be evaluated anew: at a jump that arrives, and at
    # events if there are memories. Return whether a jump arrives in any lane. A step across a jump
    # is not a piece of the past: the next one begins where it has begun.
    jumped = False
    for j in range(lanes.size):
        w.past.bends[j] = 0
        if not done[j]:
            continue
        if not w.past.missed[j] < 0.0 and lanes[j].t > w.past.until[j]:
            _append(task, lanes[j], w, j)
        _show(task, lanes[j], w, j, False)
        broke = 0 if passed[j] or w.past.missed[j] < 0.0 else SMOOTH
        if lanes[j].t == task.times[lanes[j].segment] and _has_kink(task, lanes[j].segment):
            broke = min(broke, 1)
        if is_due(task, lanes[j], j) or lanes[j].t >= lanes[j].left:  # a clock, or a switch of t
            broke = 0
        for i in range(task.lines.delays.shape[0]):
            w.past.fresh[i, j] = broke
        _bend(task, lanes[j], w, j)
        arrives = _arrive(task, lanes[j], w, j)
        jumps = arrives == 0
        jumped |= jumps
        w.past.bends[j] = arrives == 1 and task.rows.memory.size > 0
        passed[j] = jumps or (passed[j] and task.rows.memory.size > 0)
        _show(task, lanes[j], w, j, True)
    return jumped


@numba.njit(**INNER)
def is_due(task, lane, j):
    """Whether something happens to sampled blocks at the time that a lane has come to."""
    ticks = task.clocks.ticks
    return lane.tick < ticks.shape[1] and ticks[j, lane.tick] <= lane.t


@numba.njit(**INNER)
def _append(task, lane, w, j):
    """Keep what the signals of a lane were since the polynomials that are kept end."""
    past = w.past
    k = past.kept[j]
    past.t[k, j], past.h[k, j] = past.until[j], lane.t - past.until[j]
    for i in range(task.lines.delays.shape[0]):
        for n in range(DEGREE + 1):
            past.powers[k, i, n, j] = past.tried[i, n, j]
        if k > 0:
            _connect(task, past, k, i, j)
        past.level[k, i, j] = past.fresh[i, j]
        if past.fresh[i, j] < SMOOTH and past.next[i, j] < 0:
            past.next[i, j] = k
    past.kept[j], past.until[j] = k + 1, lane.t


@numba.njit(**INNER)
def _connect(task, past, k, i, j):
    """Let a polynomial begin where the one before it ends, unless the signal has jumped there."""
    # What both miss is within the tolerance; but a memory that is carried would reverse at the
    # smallest step back. Where anything has happened the signal may have jumped, or bent, or not.
    end, begin, rise, rise_before, sign = 0.0, 0.0, 0.0, 0.0, 1.0
    for n in range(DEGREE + 1):
        end += past.powers[k - 1, i, n, j]
        rise_before += n * past.powers[k - 1, i, n, j]
        begin += sign * past.powers[k, i, n, j]
        rise -= n * sign * past.powers[k, i, n, j]
        sign = -sign
    tolerance = CONNECTED * (task.atol + task.rtol * max(abs(end), abs(begin)))
    if not abs(end - begin) <= tolerance:
        return
    past.powers[k, i, 0, j] += 0.5 * (end - begin)
    past.powers[k, i, 1, j] -= 0.5 * (end - begin)
    longest = max(past.h[k, j], past.h[k - 1, j])
    bend = longest * abs(rise / past.h[k, j] - rise_before / past.h[k - 1, j])
    level = 2 if bend <= DEGREE * DEGREE * tolerance else 1
    past.fresh[i, j] = max(past.fresh[i, j], level)


@numba.njit(**INNER)
def _has_kink(task, m):
    """Whether an input has a break point at the time m of the grid."""
    if m == 0 or m >= task.times.size - 1:
        return False
    before, after = task.times[m] - task.times[m - 1], task.times[m + 1] - task.times[m]
    for i in range(task.inputs.shape[0]):
        rise = task.inputs[i, m] - task.inputs[i, m - 1]
        next_rise = task.inputs[i, m + 1] - task.inputs[i, m]
        if rise * after != next_rise * before:
            return True
    return False


@numba.njit(**INNER)
def _bend(task, lane, w, j):
    """Note what leaves a line with a kink because its delay has one now."""
    lines = task.lines
    for i in range(lines.delays.shape[0]):
        for k in range(lines.kinks.shape[1] if lines.varied[i] else 0):
            if lines.kinks[i, k] == lane.t:
                for other in range(lines.delays.shape[0]):
                    behind = 1 if lines.direct[other, i] else 2
                    w.past.fresh[other, j] = min(w.past.fresh[other, j], behind)


@numba.njit(**INNER)
def _arrive(task, lane, w, j):
    """Go behind the breaks that arrive now; return which derivative jumps, SMOOTH if none does."""
    past, lowest = w.past, SMOOTH
    for i in range(task.lines.delays.shape[0]):
        while past.next[i, j] >= 0:
            k = past.next[i, j]
            if arrival(task, i, j, past.t[k, j]) > lane.t + ROUNDING * abs(lane.t):
                break
            level = past.level[k, i, j]
            lowest = min(lowest, level)
            for other in range(task.lines.delays.shape[0]):
                behind = level if task.lines.direct[other, i] else level + 1
                past.fresh[other, j] = min(past.fresh[other, j], behind)
            past.first[i, j], past.next[i, j] = k, -1
            for later in range(k + 1, past.kept[j]):
                if past.level[later, i, j] < SMOOTH:
                    past.next[i, j] = later
                    break
    return lowest


@numba.njit(**INNER)
def _show(task, lane, w, j, ends):
    """Fill what leaves the delays at the output samples that were passed, or at the last one."""
    m = w.past.shown_to[j] + 1
    while m < task.times.size and (task.times[m] < lane.t or (ends and task.times[m] == lane.t)):
        for i in range(task.lines.delays.shape[0]):
            w.past.shown[m, i, j] = past_value(task, w, i, j, task.times[m])
        w.past.shown_to[j] = m
        m += 1
