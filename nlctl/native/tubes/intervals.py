"""Arithmetic of intervals for loops of machine code: floats, rounded outwards.

A result is moved by two units in the last place and the least float, which is more than any
rounding of it.  What is not a number, or overflows, makes both ends not a number.
"""

from __future__ import annotations

import numba

from ..machine.export import AS_SHIPPED

_PART, _TINY = 2.0**-51, 2.0**-1070


@numba.njit(**AS_SHIPPED)
def down(v):
    """Return a lower bound of what was rounded to v."""
    return v - (abs(v) * _PART + _TINY)


@numba.njit(**AS_SHIPPED)
def up(v):
    """Return an upper bound of what was rounded to v."""
    return v + (abs(v) * _PART + _TINY)


@numba.njit(**AS_SHIPPED)
def interval_product(a, b, c, d):
    """Return the ends of [a, b] [c, d]."""
    p, q, r, s = a * c, a * d, b * c, b * d
    below, under = p if p < q else q, r if r < s else s  # as processors have it: no calls
    above, over = p if p > q else q, r if r > s else s
    low, high = below if below < under else under, above if above > over else over
    known = 0.0 * (abs(p) + abs(q) + abs(r) + abs(s))
    return down(low) + known, up(high) + known


@numba.njit(**AS_SHIPPED)
def add_product(s, a, b, c, d):
    """Add [a, b] [c, d] to the interval s, of shape (2,)."""
    low, high = interval_product(a, b, c, d)
    s[0], s[1] = down(s[0] + low), up(s[1] + high)


@numba.njit(**AS_SHIPPED)
def write_into(a, b):
    """Write one array into another: a[:] = b takes five times as long to compile."""
    for i in range(b.size):
        a.flat[i] = b.flat[i]


@numba.njit(**AS_SHIPPED)
def power_of_time(h, k, s):
    """Write [0, h]^k for k > 0 to s, and return bounds of h^k."""
    low = high = h
    for _ in range(k - 1):
        low, high = down(low * h), up(high * h)
    s[0], s[1] = 0.0, high
    return low, high


@numba.njit(**AS_SHIPPED)
def matrix_product(x, y, z):
    """Write the product of matrices of intervals, each of shape (n, m, 2), to z."""
    for i in range(x.shape[0]):
        for j in range(y.shape[1]):
            z[i, j, 0] = z[i, j, 1] = 0.0
            for k in range(y.shape[0]):
                add_product(z[i, j], x[i, k, 0], x[i, k, 1], y[k, j, 0], y[k, j, 1])


@numba.njit(**AS_SHIPPED)
def add_image(x, y, z):
    """Add the product of a matrix (n, m, 2) and a vector (m, 2) to z."""
    for i in range(x.shape[0]):
        for k in range(y.shape[0]):
            add_product(z[i], x[i, k, 0], x[i, k, 1], y[k, 0], y[k, 1])
