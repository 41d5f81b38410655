"""Functions that are flat but for a narrow range of their argument: no step leads through it.

Neither error control nor what is known of conditions from a few values sees a pulse between two
places at which it is 0 to rounding.  What moves gently there is the argument, see
`nlctl.expressions.sharp`: the polynomial through five of its values says how far it leads.  Where
it moves by more than `LEADS` within the range in which the function is not flat, a shorter step is
tried, and where a polynomial does not follow it, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ....expressions.sharp import AREA, ITSELF, LEADS, RANGE, SHORTER, UNEXAMINED, WAVE
from ...machine.address import call_out
from ..control import shorten
from ..evaluate import inputs_at, on_this_side
from ..memory import Places1, Places2, Reals1, Reals2, Reals3
from ..methods.dense import solution_at
from ..methods.quartic import deepest_value, least_value, polynomial_at, quartic
from ..state import INNER, opposite
from .location import AGAIN

_AIM = 0.8  # of what a step may lead through: what a shorter step is to lead through
_WRONG = 4.0  # what a polynomial may be wrong by where it may lead into the range
_FAR = 3.0  # times that: it does not lead there
_WITHIN = 2.0  # times what it moves by from end to end: it gets no farther in between
_ROUNDING = 1e-9  # of a step
_LEAST = 0.005  # part of a step to be tried at least
_DENSE = 2  # the row of task.pair.inside that is no method's stages
_CHECKED = (0.11, 0.61)  # parts of a step at which a polynomial is checked
_POINTS, _HALVINGS = 32, 12
_TINY = 1e-300
_ROUNDED = 1e-15  # of an argument: what it is wrong by in any case
_SHORTEST = 1e-7  # part of a run: shorter steps are taken


class Sharp(NamedTuple):
    """By what sharp functions are measured."""

    functions: Places1  # the one that fills it, if there is any
    kinds: Places1  # see `SharpArgument.kind`
    table: Places2


class SharpArrays(NamedTuple):
    """That in the step being tried, at seven parts of it."""

    at: Reals3  # (parts, rows, lanes)
    part: Reals1  # of the step: where it is looked next, or how long one to try is to be
    last: Reals2  # at the end of the step before: (rows, lanes)
    pace: Reals2  # and how fast that has moved (1/s)
    bend: Reals2  # and by how much faster or slower than in the one before (1/s^2)
    until: Reals1  # the time at which it has ended (s)
    lasted: Reals1  # and how long it was (s)
    table: Places2


@numba.njit(**INNER)
def look_at_sharp(task, lanes, w, found):
    """Have shorter steps tried where an accepted one has led through a sharp function."""
    if task.sharp.kinds.size == 0 or task.fixed > 0.0:
        return
    sharp, wanted = w.sharp, w.inside.wanted
    shortest, any_wanted = _SHORTEST * (task.times[-1] - task.times[0]), False
    for j in range(lanes.size):
        lane = lanes[j]
        wanted[j] = found[j] > AGAIN and not lane.across and lane.step > shortest
        any_wanted |= wanted[j] != 0
        w.t[j] = lane.t + lane.step
    if not any_wanted:
        return
    _measured(task, lanes, w, w.x_new, 4)
    any_wanted = False
    for j in range(lanes.size):
        wanted[j] = wanted[j] and not _is_calm(task, lanes[j], w, j)
        any_wanted |= wanted[j] != 0
    if any_wanted:
        _look_within(task, lanes, w, found)
    for j in range(lanes.size):
        if found[j] > AGAIN:
            _keep(task, lanes[j], sharp, j)


@numba.njit(**INNER)
def _keep(task, lane, sharp, j):
    """Keep where arguments are at the end of a step, how fast they have moved, and how straight."""
    apart = 0.5 * (lane.step + sharp.lasted[j]) if _continues(lane, sharp, j) else 0.0
    for i in range(task.sharp.kinds.size):
        before, pace = sharp.pace[i, j], (sharp.at[4, i, j] - sharp.last[i, j]) / lane.step
        sharp.bend[i, j] = abs(pace - before) / apart if apart > 0.0 else np.inf
        sharp.pace[i, j], sharp.last[i, j] = pace, sharp.at[4, i, j]
    sharp.until[j], sharp.lasted[j] = lane.t + lane.step, lane.step


@numba.njit(**INNER)
def _continues(lane, sharp, j):
    """Whether a step begins where the one that is kept has ended, without a jump."""
    is_kept = sharp.lasted[j] > 0.0  # none before the first step
    return is_kept and abs(sharp.until[j] - lane.t) <= _ROUNDING * lane.step


@numba.njit(**INNER)
def _is_calm(task, lane, w, j):
    """Whether arguments hardly move: from end to end, nor at the pace of the step before."""
    # What is behind a jump, or a step that was not looked at, has no such pace.
    # Where one turns it has none either, and how it bends says what it does next.
    sharp, calm = w.sharp, _continues(lane, w.sharp, j)
    both = 0.5 * (sharp.lasted[j] + lane.step)
    for i in range(task.sharp.kinds.size):
        kind, before, end = task.sharp.kinds[i], sharp.last[i, j], sharp.at[4, i, j]
        moved = abs(end - before)
        most = max(moved, (abs(sharp.pace[i, j]) + both * sharp.bend[i, j]) * lane.step)
        if kind == ITSELF:
            is_far = max(before, end) + _WITHIN * most < -RANGE
            is_far |= min(before, end) - _WITHIN * most > RANGE
            calm &= most <= UNEXAMINED or is_far
        elif kind == WAVE:
            calm &= most <= UNEXAMINED
        else:
            nearest = min(abs(end), abs(before)) + (1.0 if kind == AREA else 0.0)
            calm &= max(kind, 1) * most <= UNEXAMINED * nearest
    return calm


@numba.njit(**INNER)
def forget(lanes, w, jumped):
    """Take nothing that arguments were before for what they are behind a jump."""
    for j in range(lanes.size):
        if jumped[j]:
            w.sharp.until[j] = np.nan


@numba.njit(**INNER)
def _look_within(task, lanes, w, found):
    """Look at arguments within steps, and have shorter ones tried where they lead too far."""
    nodes, part, wanted = task.pair.inside[_DENSE], w.sharp.part, w.inside.wanted
    for n in range(4):
        for j in range(lanes.size):
            part[j] = nodes[n - 1] if wanted[j] and n > 0 else 0.0
        _inside(task, lanes, w, n)
    any_wanted = False
    for j in range(lanes.size):
        wanted[j] = wanted[j] and _any_moves(task, w, j)
        any_wanted |= wanted[j] != 0
    if not any_wanted:
        return
    for n in range(2):
        for j in range(lanes.size):
            part[j] = _CHECKED[n] if wanted[j] else 0.0
        _inside(task, lanes, w, 5 + n)
    for j in range(lanes.size):
        if wanted[j]:
            part[j] = 1.0
            for i in range(task.sharp.kinds.size):
                part[j] = min(part[j], _followed(task, w, i, j))
            if part[j] < 1.0:
                shorten(lanes[j], max(part[j], _LEAST))
                found[j] = AGAIN


@numba.njit(**INNER)
def _inside(task, lanes, w, n):
    """Fill row `n` of ``w.sharp.at`` at the parts of steps."""
    for j in range(lanes.size):
        w.t[j] = lanes[j].t + w.sharp.part[j] * lanes[j].step
        solution_at(w.sharp.part[j], task, lanes[j], w, j, w.ahead.x)
    _measured(task, lanes, w, w.ahead.x, n)


@numba.njit(**INNER)
def _measured(task, lanes, w, x, n):
    """Fill row `n` of ``w.sharp.at`` at the times w.t."""
    if task.timed.jumps.shape[1]:
        on_this_side(lanes, w)
    if w.u.shape[0]:
        inputs_at(task, lanes, w)
    call_out(task.sharp.functions[0], w.t, x, w.u, task.p, w.sharp.at[n])


@numba.njit(**INNER)
def _any_moves(task, w, j):
    """Whether the values of an argument may be farther apart than a step may lead."""
    for i in range(task.sharp.kinds.size):
        least = most = w.sharp.at[0, i, j]
        for n in range(1, 5):
            least, most = min(least, w.sharp.at[n, i, j]), max(most, w.sharp.at[n, i, j])
        kind, apart = task.sharp.kinds[i], most - least
        if kind not in (ITSELF, WAVE):  # between two values it may be nearer to 0, and farther
            nearest = max(max(least, -most) - apart, 0.0)
            if nearest > max(kind, 1) * apart:
                continue
            farthest = max(most, -least) + apart
            apart = _measure(kind, farthest) - max(_measure(kind, nearest), -RANGE)
        if apart > _AIM * LEADS:
            return 1
    return 0


@numba.njit(**INNER)
def _measure(kind, value):
    """Return by what a function is measured whose argument has a value."""
    if kind in (ITSELF, WAVE):
        return value
    size = abs(value)
    if kind == AREA:
        area = 2.0 * np.log(size + np.sqrt(size * size + 1.0))
        return -area if value < 0.0 else area
    return kind * np.log(max(size, _TINY))


@numba.njit(**INNER)
def _followed(task, w, i, j):
    """Return the part of a step up to which an argument may be followed."""
    values, newton, at = w.inside.values, w.inside.newton, task.pair.inside[_DENSE]
    kind, wrong = task.sharp.kinds[i], 0.0
    for n in range(5):
        values[n] = w.sharp.at[n, i, j]
    quartic(values, at, newton)
    for n in range(2):
        missed = abs(polynomial_at(newton, at, _CHECKED[n]) - w.sharp.at[5 + n, i, j])
        wrong = missed if not missed <= wrong else wrong
    wrong += _ROUNDED * max(abs(values[0]), abs(values[4]))
    enough, closely = _edge(kind) + _FAR * wrong, False
    while True:
        least, lowest = _least(newton, at, enough, closely)
        _negate(newton)
        most, highest = _least(newton, at, enough, closely)
        _negate(newton)
        most = -most
        if not _is_flat(kind, least - _FAR * wrong, most + _FAR * wrong):
            if not _blurred(kind, max(least, -most, 0.0), wrong) <= _WRONG:
                return SHORTER
            if not _led(kind, newton, at, 1.0, lowest, highest) <= LEADS:
                break
        if closely:
            return 1.0
        closely = True
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _led(kind, newton, at, middle, lowest, highest) <= _AIM * LEADS:
            low = middle
        else:
            high = middle
    return low


@numba.njit(**INNER)
def _least(newton, at, enough, closely):
    """Return the least value of a polynomial, and where it is, first as far as a grid says."""
    return deepest_value(newton, at, enough) if closely else least_value(newton, at, False)


@numba.njit(**INNER)
def _negate(newton):
    for n in range(5):
        newton[n] = -newton[n]


@numba.njit(**INNER)
def _edge(kind):
    """Return how far from 0 an argument is from where on a function is flat."""
    if kind == ITSELF:
        return RANGE
    return np.sinh(0.5 * RANGE) if kind == AREA else np.exp(RANGE / max(kind, 1))


@numba.njit(**INNER)
def _blurred(kind, nearest, wrong):
    """Return by how much a measure may be wrong where its argument is nearest to 0."""
    if kind in (ITSELF, WAVE):
        return wrong
    return _measure(kind, nearest + wrong) - max(_measure(kind, nearest), -RANGE)


@numba.njit(**INNER)
def _is_flat(kind, least, most):
    """Whether a function is flat wherever its argument lies between two numbers."""
    if kind == WAVE:
        return False
    if kind in (ITSELF, AREA):
        return _measure(kind, least) > RANGE or _measure(kind, most) < -RANGE
    nearest = max(least, -most, 0.0)
    return _measure(kind, nearest) > RANGE or _measure(kind, max(most, -least)) < -RANGE


@numba.njit(**INNER)
def _led(kind, newton, at, until, lowest, highest):
    """Return how far a polynomial leads within the range, up to a part of a step."""
    reach = np.inf if kind == WAVE else RANGE
    least, most, before = reach, -reach, 0.0
    for n in range(_POINTS + 4):
        x = n / _POINTS
        if n > _POINTS:
            x = until if n == _POINTS + 1 else lowest if n == _POINTS + 2 else highest
        if x <= until:
            value = polynomial_at(newton, at, x)
            if kind > 0 and opposite(before, value):
                least = -RANGE  # it goes through 0
            measure = min(max(_measure(kind, value), -reach), reach)
            least, most, before = min(least, measure), max(most, measure), value
    return most - least
