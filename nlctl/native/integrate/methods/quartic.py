"""The polynomial through five values of an event function, and how far it can be trusted."""

from __future__ import annotations

import numba
import numpy as np

from ..state import INNER

_POINTS = 32
_SECTIONS, _GOLDEN = 60, 0.5 * (5.0**0.5 - 1.0)


@numba.njit(**INNER)
def quartic(f, at, n):
    """Fill `n` with Newton's coefficients of the polynomial through `f` at 0, `at` and 1."""
    # The nodes, see `following_nodes`, are taken in the order 0, at[0], at[1], 1, at[2]: the last
    # coefficient is what the third value inside says besides the other four.
    a, b, c = at[0], at[1], at[2]
    n[0] = f[0]
    n[1] = (f[1] - f[0]) / a
    second = (f[2] - f[1]) / (b - a)
    n[2] = (second - n[1]) / b
    n[3] = ((f[4] - f[2]) / (1.0 - b) - second) / (1.0 - a) - n[2]
    n[4] = 0.0
    n[4] = (f[3] - polynomial_at(n, at, c)) / (c * (c - a) * (c - b) * (c - 1.0))


@numba.njit(**INNER)
def polynomial_at(n, at, x):
    """Return the polynomial at x."""
    a, b = at[0], at[1]
    return n[0] + x * (n[1] + (x - a) * (n[2] + (x - b) * (n[3] + (x - 1.0) * n[4])))


@numba.njit(**INNER)
def slope_at(n, at, x):
    """Return its derivative at x."""
    v, d = n[4], 0.0
    for k in range(3):
        node = 1.0 if k == 0 else at[2 - k]
        v, d = n[3 - k] + (x - node) * v, v + (x - node) * d
    return v + x * d


@numba.njit(**INNER)
def doubt(n, at):
    """Return by how much the polynomial may be wrong."""
    # That is its last term, or a tenth of the one before: both do not vanish by chance.
    return max(at[4] * abs(n[4]), 0.1 * at[3] * abs(n[3]))


def following_nodes(parts):
    """Return parts of a step, followed by how large the last two terms become between them."""
    x = np.linspace(0.0, 1.0, 201)
    third = np.abs(x * (x - parts[0]) * (x - parts[1]))
    return (*parts, np.max(third), np.max(third * (1.0 - x)))


@numba.njit(**INNER)
def least_value(n, at, slope, inner=False):
    """Return the least value of a polynomial, or with `slope` of its derivative, and its place."""
    # On a grid of [0, 1] that is closer at both ends, where steps begin and end near minima; of the
    # parabola through the three values around the least one. `inner` ones are minima in between.
    least, where = np.inf, 0
    for k in range(_POINTS + 1):
        y = _either(n, at, _node(k), slope)
        if y < least and not (inner and _is_undercut(n, at, slope, k, y)):
            least, where = y, k
    if least == np.inf:
        return least, 0.0
    k = min(max(where, 1), _POINTS - 1)
    low, middle, high = _node(k - 1), _node(k), _node(k + 1)
    y = _either(n, at, middle, slope)
    below, above = _either(n, at, low, slope), _either(n, at, high, slope)
    tilt, bend = parabola(low, middle, high, below, y, above)
    if bend > 0.0 and low < middle - 0.5 * tilt / bend < high:
        return y - 0.25 * tilt * tilt / bend, middle - 0.5 * tilt / bend
    return least, _node(where)


@numba.njit(**INNER)
def deepest_value(n, at, enough):
    """Return the least value of a polynomial, and its place: closely where it may be below one."""
    # The polynomial (x - a)^4 / w^4 is as good as 0 over a part of the grid that may be tiny, and
    # no parabola through three values says so.
    least, where = np.inf, 0.0
    for k in range(_POINTS + 1):
        low, middle, high = _node(max(k - 1, 0)), _node(k), _node(min(k + 1, _POINTS))
        y = polynomial_at(n, at, middle)
        below, above = polynomial_at(n, at, low), polynomial_at(n, at, high)
        if y <= min(below, above) and 2.0 * y - max(below, above) < enough:
            middle = _by_sections(n, at, low, high)
            y = min(y, polynomial_at(n, at, middle))
        if y < least:
            least, where = y, middle
    return least, where


@numba.njit(**INNER)
def _by_sections(n, at, low, high):
    """Return where a polynomial is least between two places, by golden sections."""
    for _ in range(_SECTIONS):
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        if polynomial_at(n, at, left) < polynomial_at(n, at, right):
            high = right
        else:
            low = left
    return 0.5 * (low + high)


@numba.njit(**INNER)
def _is_undercut(n, at, slope, k, y):
    """Whether one of two neighbours has a lower value, or there is only one."""
    if k == 0 or k == _POINTS:
        return True
    below, above = _either(n, at, _node(k - 1), slope), _either(n, at, _node(k + 1), slope)
    return y > min(below, above)


@numba.njit(**INNER)
def parabola(low, middle, high, below, least, above):
    """Return the slope at the middle of three places, and the bend of the parabola through them."""
    # It is least + slope (x - middle) + bend (x - middle)^2.
    left, right = (least - below) / (middle - low), (above - least) / (high - middle)
    bend = (right - left) / (high - low)
    return left + bend * (middle - low), bend


@numba.njit(**INNER)
def _node(k):
    x = k / _POINTS
    return x * x * (3.0 - 2.0 * x)


@numba.njit(**INNER)
def _either(n, at, x, slope):
    return slope_at(n, at, x) if slope else polynomial_at(n, at, x)
