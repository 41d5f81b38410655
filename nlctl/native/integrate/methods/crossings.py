"""Where a polynomial over a step is 0, or on another side."""

from __future__ import annotations

import numba

from ..state import INNER, opposite
from .dips import first_dip, lacking, value_and_slope

FOLLOWED = 0.01  # what the last two terms of a polynomial that is looked at may be of all
_WITHIN = 0.95  # of where they are that small
PLACES_LOOKED_AT = 16  # parts of a step
_TURNS = 5  # attempts at where a polynomial is least


@numba.njit(**INNER)
def followed_part(highest, h, terms, row, small, j):
    """Return in which part of h a polynomial is followed: its last two terms add little."""
    # Where all of them are `small` they may be rounding, which is not small beside itself.
    total, power, last = abs(terms[0, row, j]) + small, 1.0, 0.0
    for k in range(1, highest + 1):
        power *= h
        part = abs(power * terms[k, row, j])
        total += part
        if k >= highest - 1:
            last += part
    if not last > FOLLOWED * total:  # NaN is found elsewhere
        return 1.0
    return _WITHIN * (FOLLOWED * total / last) ** (1.0 / (highest - 1.0))


@numba.njit(**INNER)
def is_at(highest, h, terms, row, value, small, j):
    """Whether a polynomial is at h what the right-hand side says: its last terms may both be 0."""
    extent, foreseen = abs(terms[highest, row, j]), terms[highest, row, j]
    for k in range(highest - 1, -1, -1):
        extent = extent * h + abs(terms[k, row, j])
        foreseen = foreseen * h + terms[k, row, j]
    return not abs(value - foreseen) > FOLLOWED * (extent + small)


@numba.njit(**INNER)
def _turning(p, h, terms, row, ends, slopes, j):
    """Return about where a polynomial's slope is 0, between two places where its signs differ."""
    (low, high), (first, last), least = ends, slopes, 0.0
    for _ in range(_TURNS):
        least = low + first / (first - last) * (high - low)
        slope = value_and_slope(p, least * h, terms, row, j)[1]
        if opposite(slope, first):
            high, last = least, slope
        else:
            low, first = least, slope
    return least


@numba.njit(**INNER)
def first_crossing(p, h, terms, row, side, until, shifted, j):
    """Return where a polynomial is on another side first, 1 for nowhere, and where farthest."""
    first, farthest, most, steep = 1.0, 1.0, 0.0, 0.0
    side = 1.0 if side > 0.0 else -1.0
    extent = abs(terms[p, row, j])
    for k in range(p - 1, 0, -1):
        extent = extent * h + abs(terms[k, row, j])
    if extent * h < abs(terms[0, row, j]) or extent == 0.0:  # it is 0 throughout
        return first, farthest
    fell, part = False, 0.0
    for n in range(PLACES_LOOKED_AT + 1):
        before, part = part, n / PLACES_LOOKED_AT
        if before >= until:
            break
        value, slope = value_and_slope(p, part * h, terms, row, j)
        if fell and slope * side > 0.0:  # in between it is least where the slope is 0, about
            least = _turning(p, h, terms, row, (before, part), (steep, slope), j)
            under = value_and_slope(p, least * h, terms, row, j)[0] * side
            lacks = lacking(p, least * h, extent * h, terms, row, j)
            if under < lacks and least < until:
                first, farthest, most = min(first, least), least, max(most, -under)
        fell, steep = slope * side < 0.0, slope
        if value * side < 0.0 and part < until:
            first = min(first, part)
            if -value * side > most:
                farthest, most = part, -value * side
    if first == 1.0:  # seen nowhere: there may be a dip between two of these places
        first = farthest = first_dip(p, h, terms, row, side, until, extent * h, shifted, j)
    return first, farthest


@numba.njit(**INNER)
def side_left_to(p, terms, row, j):
    """Return a number with the sign of a polynomial right behind the start of a step."""
    for k in range(p + 1):
        if terms[k, row, j] != 0.0:
            return terms[k, row, j]
    return 0.0


@numba.njit(**INNER)
def falls_at_once(task, w, i, j):
    """Whether a guard begins at 0 and falls from there: no polynomial says how far behind it is."""
    # `crossing` looks right behind the start then, as with other methods.
    row, p = w.x.shape[0] + i, task.taylor.highest - 1
    begins = i >= task.rows.guarded and w.events.g_start[i, j] == 0.0
    return begins and side_left_to(p, w.taylor.terms, row, j) < 0.0


@numba.njit(**INNER)
def part_behind_root(p, h, terms, row, ends, rest, j):
    """Return right behind which part of a step h a polynomial is 0, by its values at both ends."""
    low, high = 0.0, 1.0
    (f_low, f_high), far = ends, ends[1]  # it may begin at 0
    for n in range(60):
        part = f_low / (f_low - f_high)
        middle = low + (high - low) * (0.5 if n % 3 == 2 else min(max(part, 0.01), 0.99))
        f = value_and_slope(p, middle * h, terms, row, j)[0]
        if opposite(f, far):
            low, f_low = middle, f
        else:
            high, f_high = middle, f
        if high - low < 0.1 * rest * high:
            break
    return high
