"""Whether a polynomial dips below 0 between places where it is above: decided by its coefficients.

Around the middle of an interval a polynomial is another one, whose terms bound it, and its slope,
in the whole interval.  Where it is above 0, or rises or falls throughout, it has no dip.  Anything
else is halved, until its turning point is known.
"""

from __future__ import annotations

import numba

from ..state import INNER

_HALVINGS = 24  # of a step
_MOST = 4000  # intervals of a step
_ROUNDED = 1e-12  # of how far a polynomial may get from its start: it is not known any better
_CLEARLY = 4e-16  # the same, of one value


@numba.njit(**INNER)
def value_and_slope(highest, h, terms, row, j):
    """Return a polynomial and its derivative at h."""
    value, slope = terms[highest, row, j], 0.0
    for k in range(highest - 1, -1, -1):
        slope = slope * h + value
        value = value * h + terms[k, row, j]
    return value, slope


@numba.njit(**INNER)
def lacking(p, at, extent, terms, row, j):
    """Return what a polynomial may be wrong by: its last two terms, 0 if that is rounding."""
    lacks = at ** (p - 1.0) * (abs(terms[p - 1, row, j]) + abs(at * terms[p, row, j]))
    return lacks if lacks > _ROUNDED * extent else 0.0


@numba.njit(**INNER)
def first_dip(p, h, terms, row, side, until, extent, shifted, j):
    """Return the part of a step h at which a polynomial first turns on another side, 1 for none."""
    n, level = 0, 0
    for _ in range(_MOST):
        half = 0.5 * until * 0.5**level
        middle = (2 * n + 1) * half
        _shift(p, middle * h, terms, row, shifted, j)
        bound, steep = _bounds(p, half * h, shifted)
        value = side * shifted[0]
        lacks = lacking(p, (middle + half) * h, extent, terms, row, j)
        is_clear = value - bound > lacks or abs(shifted[1]) > steep
        if not is_clear and level == _HALVINGS:
            if value < (lacks if lacks > 0.0 else -_CLEARLY * extent):
                return middle
            is_clear = True
        if not is_clear:
            n, level = 2 * n, level + 1
            continue
        n += 1
        while level > 0 and n % 2 == 0:
            n, level = n // 2, level - 1
        if level == 0:
            break
    return 1.0


@numba.njit(**INNER)
def _shift(p, at, terms, row, shifted, j):
    """Fill `shifted` with the coefficients around a place."""
    for k in range(p + 1):
        shifted[k] = terms[k, row, j]
    for k in range(p):
        for i in range(p - 1, k - 1, -1):
            shifted[i] += at * shifted[i + 1]


@numba.njit(**INNER)
def _bounds(p, half, shifted):
    """Return how far a polynomial gets from its middle, and how much its slope may change."""
    bound, steep, power = abs(shifted[1]) * half, 0.0, half
    for k in range(2, p + 1):
        term = abs(shifted[k]) * power
        steep += k * term
        bound += term * half
        power *= half
    return bound, steep
