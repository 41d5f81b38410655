"""All solutions from a box over a time, enclosed step by step: a tube."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from numba import types

from ...host.checkout import file_of_nlctl
from ..enclosures.writer import LANES
from ..machine.export import AS_SHIPPED
from ..machine.machine_code import Wanted
from ..machine.shipped import Shipped
from .intervals import (
    add_image,
    add_product,
    down,
    interval_product,
    power_of_time,
    up,
    write_into,
)
from .series import SeriesCode
from .sets import box_of_set, next_errors, next_polynomials, renewed, slopes_within
from .steps import add_up, coefficients, fill_lanes, flow_derivatives, rest_of_step


class MonomialTable(NamedTuple):
    """The monomials of degree 1 to some degree."""

    degrees: np.ndarray  # shape (monomials,); the first ones are the variables themselves
    even: np.ndarray  # shape (monomials,); whether it is never negative
    # shape (pairs, 3); numbers of two monomials and of their product, as far as that is one
    products: np.ndarray
    has: np.ndarray  # shape (monomials, variables); whether a variable is in it


@functools.lru_cache(maxsize=16)
def monomials(variables: int, degree: int) -> MonomialTable:
    """Return all monomials of so many variables."""
    powers = [
        tuple(chosen.count(v) for v in range(variables))
        for total in range(1, degree + 1)
        for chosen in itertools.combinations_with_replacement(range(variables), total)
    ]
    numbers = {power: i for i, power in enumerate(powers)}
    sums = (
        (i, j, numbers.get(tuple(a + b for a, b in zip(p, q, strict=True))))
        for (p, i), (q, j) in itertools.product(numbers.items(), repeat=2)
        if sum(p) + sum(q) <= degree
    )
    return MonomialTable(
        degrees=np.array([sum(p) for p in powers], dtype=np.int64),
        even=np.array([all(a % 2 == 0 for a in p) for p in powers]),
        products=np.array([*sums], dtype=np.int64).reshape(-1, 3),
        has=np.array(powers) > 0,
    )


REACHED, LEAVES, MUST_LEAVE, STUCK = range(4)
FIRST_ORDER, SET_DEGREE, TOLERANCE = 6, 4, 1e-8
_BEYOND = 1.0 + 1e-9  # a last step leads so far, relative to it
_HALVINGS = 12  # of a step in which no solution is found
_NEW = 0.5  # of the polynomials, beyond which errors become numbers of their own
_MOST = 100_000  # steps


@dataclass(frozen=True, kw_only=True)
class Tube:
    """What encloses all solutions from a box."""

    # `REACHED` the end; `LEAVES`: not known to stay within the limits; `MUST_LEAVE`: all are
    # outside of them at one time; `STUCK`: no step is found
    status: int
    time: float  # up to which it is known
    # shape (cells, n); over each of as many parts of the time
    low: np.ndarray
    high: np.ndarray
    end: np.ndarray  # shape (n, 2); at the end
    # shape (n,); how much each side of the box has to do with what is not linear in it
    weight: np.ndarray
    steps: int


def tube_from(
    code: SeriesCode, box: np.ndarray, duration: float, limits: np.ndarray, *, cells: int
) -> Tube:
    """Enclose all solutions from a box of shape (n, 2) over a time; see `Tube`."""
    n, box = code.order, np.array(box, dtype=float)
    table = monomials(n, SET_DEGREE)
    low, high = np.full((cells, n), np.inf), np.full((cells, n), -np.inf)
    end, weight = np.empty((n, 2)), np.zeros(n)
    status, time, steps = TUBES.functions["integrated"](
        code.addresses, code.places, code.folds, table, box, float(duration),
        np.array(limits, dtype=float), FIRST_ORDER, TOLERANCE, LANES, low, high, end, weight,
    )  # fmt: skip
    return Tube(status=status, time=time, low=low, high=high, end=end, weight=weight, steps=steps)


def integrated(
    code, places, folds, table, box, duration, limits, order, tol, lanes, low, high, end, weight
):
    """Fill a tube, and return its status, the time that it has come to, and its steps."""
    n, pairs = box.shape[0], box.shape[0] * (box.shape[0] + 1) // 2
    rows, kept_rows, read_rows, groups = places[0], places[1], places[6], -(-(n + pairs) // lanes)
    k = np.zeros((groups, order + 2, rows, 2, lanes))
    ky, at_end = np.zeros_like(k), np.zeros((groups, 4 * n, 2, lanes))
    boxes, rest, pad = np.zeros_like(at_end), np.zeros_like(at_end), np.zeros_like(at_end)
    read, first = np.zeros((read_rows, 2, lanes)), np.zeros((rows + kept_rows, 2, lanes))
    c, P, B, r = first_set(box, table.degrees.size)
    middle, over, begin = np.empty(n), np.empty((n, 2)), np.empty((n, 2))
    early, late, h, steps, status, first_numbers = 0.0, 0.0, duration, 0, REACHED, True
    box_of_set(c, P, table.even, B, r, end)
    while early < duration:
        for i in range(n):
            middle[i] = 0.5 * c[i, 0] + 0.5 * c[i, 1]
        fill_lanes(end, middle, boxes)
        h = step_found(
            code, places, folds, order, tol, 2.0 * h, duration - early, k, ky, boxes, rest, pad,
            read, first,
        )  # fmt: skip
        if h == 0.0 or steps == _MOST:
            status = STUCK
            break
        span(k[0], ky[0], order, h, boxes[0], over)
        here = np.array([h, h])
        for g in range(groups):
            add_up(k[g], order, here, rest[g], at_end[g])
        carry_on(at_end, table, end, middle, c, P, B, r)
        if first_numbers:
            matter(P, table, box, weight)
        first_numbers = not renewed(c, P, table.even, B, r, _NEW) and first_numbers
        write_into(begin, end)
        box_of_set(c, P, table.even, B, r, end)
        range_over_step(ky[0], h, begin, end, over)
        write_limits(over, early / duration, up(late + h) / duration, low, high)
        steps, early, late = steps + 1, down(early + h), up(late + h)
        if early >= duration:
            back_to(end, ky[0, 1], up(late - duration))
        status = judged(over, end, limits)
        if status != REACHED:
            break
    return status, early, steps


@numba.njit(**AS_SHIPPED)
def step_found(code, places, folds, order, tol, most, left, k, ky, boxes, rest, pad, read, first):
    """Return the size of a step for which there is a rest, at most `most`; 0 for none."""
    groups, n, lanes = boxes.shape[0], boxes.shape[1] // 4, boxes.shape[3]
    for g in range(groups):
        coefficients(code, places, folds, boxes[g], order, k[g], read, first)
    point = n * (n + 1) // 2
    h = min(most, step_size(k[point // lanes], order, point % lanes, n, tol), left * _BEYOND)
    for _ in range(_HALVINGS):
        if h > 0.0 and rest_of_step(
            code, places, folds, order, h, k, ky, boxes, rest, pad, read, first
        ):
            return h
        h *= 0.6
    return 0.0


@numba.njit(**AS_SHIPPED)
def first_set(box, count):
    """Return the set {c + P(s) + B r} that is a box, of so many monomials."""
    n = box.shape[0]
    c, r = np.zeros((n, 2)), np.zeros((n, 2))
    P, B = np.zeros((n, count)), np.zeros((n, n, 2))
    for i in range(n):
        c[i, 0] = c[i, 1] = 0.5 * box[i, 0] + 0.5 * box[i, 1]
        B[i, i, 0] = B[i, i, 1] = 1.0
        if box[i, 0] < box[i, 1]:
            P[i, i] = max(up(box[i, 1] - c[i, 0]), up(c[i, 0] - box[i, 0]))
    return c, P, B, r


@numba.njit(**AS_SHIPPED)
def carry_on(lanes, table, box, middle, c, P, B, r):
    """Carry a set on by a step, in place."""
    n = middle.size
    at, J, H = np.empty((n, 2)), np.empty((n, n, 2)), np.empty((n, n, n, 2))
    K, error, point = np.empty_like(J), np.empty((n, 2)), np.empty(n)
    flow_derivatives(lanes, at, J, H)
    slopes_within(J, H, box, middle, K)
    for i in range(n):
        point[i] = 0.5 * at[i, 0] + 0.5 * at[i, 1]
        error[i, 0], error[i, 1] = down(at[i, 0] - point[i]), up(at[i, 1] - point[i])
        c[i, 0], c[i, 1] = down(c[i, 0] - middle[i]), up(c[i, 1] - middle[i])
    add_image(K, c, error)
    next_polynomials(J, H, P, table, error)
    next_errors(K, error, point, c, B, r)


@numba.njit(**AS_SHIPPED)
def step_size(k, order, lane, n, tol):
    """Return the step at which the last coefficients of the middle count for a tolerance."""
    scale, last, before = 0.0, 0.0, 0.0
    for i in range(n):
        scale = max(scale, abs(k[0, i, 0, lane]))
        last = max(last, max(-k[order, i, 0, lane], k[order, i, 1, lane]))
        before = max(before, max(-k[order - 1, i, 0, lane], k[order - 1, i, 1, lane]))
    allowed = tol * max(scale, 1e-3)
    one = (allowed / last) ** (1.0 / order) if last > 0.0 else math.inf
    other = (allowed / before) ** (1.0 / (order - 1)) if before > 0.0 else math.inf
    return min(one, other)


@numba.njit(**AS_SHIPPED)
def span(k, ky, order, h, boxes, over):
    """Write where the states are during a step: in the first lane, which has the whole set."""
    power = np.empty(2)
    power_of_time(h, order + 1, power)
    add_up(k, order, np.array([0.0, h]), np.zeros_like(boxes), boxes)
    for i in range(over.shape[0]):
        low, high = interval_product(
            ky[order + 1, i, 0, 0], ky[order + 1, i, 1, 0], power[0], power[1]
        )
        over[i, 0] = down(boxes[i, 0, 0] + low)
        over[i, 1] = up(boxes[i, 1, 0] + high)


@numba.njit(**AS_SHIPPED)
def range_over_step(ky, h, begin, end, over):
    """Narrow where the states are during a step, by where they are before and after it."""
    # A solution is off its chord by h^2 x'' / 8 at most, and x'' is two times its second
    # coefficient.
    square = up(0.25 * up(h * h))
    for i in range(over.shape[0]):
        below, above = up(square * max(ky[2, i, 1, 0], 0.0)), up(square * max(-ky[2, i, 0, 0], 0.0))
        over[i, 0] = max(over[i, 0], down(min(begin[i, 0], end[i, 0]) - below))
        over[i, 1] = min(over[i, 1], up(max(begin[i, 1], end[i, 1]) + above))


@numba.njit(**AS_SHIPPED)
def write_limits(over, begin, end, low, high):
    """Enter a box into the parts of the time that a step has to do with."""
    cells = low.shape[0]
    first = max(0, math.floor(begin * cells - 1e-9))
    last = min(cells - 1, math.floor(end * cells + 1e-9))
    for cell in range(first, last + 1):
        for i in range(over.shape[0]):
            low[cell, i] = min(low[cell, i], over[i, 0])
            high[cell, i] = max(high[cell, i], over[i, 1])


@numba.njit(**AS_SHIPPED)
def judged(over, end, limits):
    """Say what is known of the limits, from a step and from where it ends."""
    status = REACHED
    for i in range(limits.shape[0]):
        if not (limits[i, 0] <= over[i, 0] and over[i, 1] <= limits[i, 1]):
            status = LEAVES
        if not (-math.inf < end[i, 0] and end[i, 1] < math.inf):
            return STUCK
    for i in range(limits.shape[0]):
        if end[i, 0] > limits[i, 1] or end[i, 1] < limits[i, 0]:
            return MUST_LEAVE
    return status


@numba.njit(**AS_SHIPPED)
def back_to(end, rates, beyond):
    """Take back what the last step may have gone beyond the end."""
    for i in range(end.shape[0]):
        add_product(end[i], -beyond, 0.0, rates[i, 0, 0], rates[i, 1, 0])


@numba.njit(**AS_SHIPPED)
def matter(P, table, box, weight):
    """Write how much each side of the first box has to do with what is not linear in it."""
    for j in range(weight.size):
        weight[j] = 0.0
        for a in range(P.shape[1]):
            if table.has[a, j] and box[j, 0] < box[j, 1]:
                part = 1.0 if table.degrees[a] > 1 else 1e-6  # of a linear motion that alone
                weight[j] += part * np.abs(P[:, a]).sum()


_REAL, _COUNT = types.float64, types.int64
_ROW, _TABLE = _REAL[::1], _REAL[:, ::1]
_MONOMIALS = types.NamedTuple(
    (_COUNT[::1], types.boolean[::1], _COUNT[:, ::1], types.boolean[:, ::1]), MonomialTable
)
TUBES = Shipped(
    path=file_of_nlctl("native/tubes/tubes.bitcode"),
    wanted=(
        Wanted(
            function=integrated,
            signature=types.Tuple((_COUNT, _REAL, _COUNT))(
                types.UniTuple(types.intp, 2), types.UniTuple(_COUNT, 7), _COUNT[:, ::1],
                _MONOMIALS, _TABLE, _REAL, _TABLE, _COUNT, _REAL, _COUNT, _TABLE, _TABLE, _TABLE,
                _ROW,
            ),
            options=AS_SHIPPED,
        ),
    ),
)  # fmt: skip
