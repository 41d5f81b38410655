"""Boxes divided in machine code: a claim proved or refuted, a supremum enclosed.

Boxes are taken from a stack, or a heap, as many together as there are lanes.  What comes out
depends on no thread and on no other search.
"""

from __future__ import annotations

import math

import numba
from numba import types

from ...host.checkout import file_of_nlctl
from ..machine.address import call_enclosure
from ..machine.export import AS_SHIPPED
from ..machine.machine_code import Wanted
from ..machine.shipped import Shipped

ALL_PROVED, REFUTED, LEFT, FULL = range(4)
FINEST = 1e-6  # of a tolerance: where the bound is near 0, nothing finer is tried


@numba.njit(**AS_SHIPPED)
def best_side(x, o, lane, weight, whole):
    """Return the side that matters most and can be divided; -1 for none."""
    best, side, n, known = -1.0, -1, whole.size, True
    for i in range(n):
        known = known and math.isfinite(o[weight + i, lane])
    for i in range(n):
        low, high = x[2 * i, lane], x[2 * i + 1, lane]
        middle, width = 0.5 * low + 0.5 * high, high - low
        if math.isfinite(width) and low < middle < high:
            value = o[weight + i, lane] if known else width / whole[i] if whole[i] > 0.0 else 0.0
            if value > best:
                best, side = value, i
    return side


def prove_below(judge, places, x, o, stack, whole, bound, most, counts, point):
    """Prove or refute that the least of some functions is at most a bound on boxes."""
    # Shapes: `x, o` (rows, lanes), `stack` (boxes, 2 sides), `whole` (sides,), `point` (sides +
    # 1,).
    n, lanes, centre, weight = whole.size, x.shape[1], places[0], places[1]
    top = counts[0]
    while top > 0 and counts[1] < most:
        if top + lanes > stack.shape[0]:
            counts[0] = top
            return FULL
        taken = min(lanes, top)
        for lane in range(lanes):
            j = top - 1 - min(lane, taken - 1)
            for i in range(2 * n):
                x[i, lane] = stack[j, i]
        call_enclosure(judge, x, o)
        top -= taken
        counts[1] += taken
        for lane in range(taken):
            if o[0, lane] <= bound:
                continue
            if o[1, lane] > bound:
                for i in range(n):
                    point[i] = o[centre + i, lane]
                point[n] = o[1, lane]
                counts[0] = top
                return REFUTED
            side = best_side(x, o, lane, weight, whole)
            if side < 0:
                if counts[2] == 0:
                    for i in range(n):
                        point[i] = 0.5 * x[2 * i, lane] + 0.5 * x[2 * i + 1, lane]
                counts[2] += 1
                continue
            middle = 0.5 * x[2 * side, lane] + 0.5 * x[2 * side + 1, lane]
            for half in range(2):
                for i in range(2 * n):
                    stack[top, i] = x[i, lane]
                stack[top, 2 * side + 1 - half] = middle
                top += 1
    counts[0] = top
    return LEFT if top > 0 or counts[2] > 0 else ALL_PROVED


def supremum(judge, places, x, o, nodes, index, keys, whole, limits, counts, bounds):
    """Enclose the supremum of the least of some functions on a box."""
    # Shapes: `nodes` (boxes, 2 sides), `index` (3, boxes), `keys` (boxes,).
    while True:
        judge_waiting(judge, places, x, o, nodes, index, keys, whole, counts, bounds)
        if counts[2] + x.shape[1] > nodes.shape[0]:
            return FULL
        divide_first(nodes, index, keys, x.shape[1], limits, counts, bounds)
        if counts[0] == 0:
            break
    for k in range(counts[1]):
        bounds[0] = max(bounds[0], keys[k])
        counts[4] += keys[k] == math.inf
    return ALL_PROVED


@numba.njit(**AS_SHIPPED)
def judge_waiting(judge, places, x, o, nodes, index, keys, whole, counts, bounds):
    """Judge the boxes that wait, and put them into the heap."""
    n, lanes, waiting = whole.size, x.shape[1], counts[0]
    counts[0] = 0
    if waiting == 0:
        return
    for lane in range(lanes):
        j = index[2, min(lane, waiting - 1)]
        for i in range(2 * n):
            x[i, lane] = nodes[j, i]
    call_enclosure(judge, x, o)
    counts[3] += waiting
    for lane in range(waiting):
        value = o[1, lane]
        for i in range(n):
            if math.isnan(o[places[0] + i, lane]):
                value = o[2, lane]
        if math.isfinite(value) and value > bounds[1]:
            bounds[1] = value
        j = index[2, lane]
        index[0, j] = best_side(x, o, lane, places[1], whole)
        counts[1] = heap_enter(keys, index, counts[1], o[0, lane], j)


@numba.njit(**AS_SHIPPED)
def divide_first(nodes, index, keys, lanes, limits, counts, bounds):
    """Divide the boxes with the largest bounds: their halves wait."""
    tol, relative, most, hopeless = limits
    while counts[0] + 2 <= lanes and counts[1] > 0:
        end, j, stored, waiting = keys[0], index[1, 0], counts[2], counts[0]
        limit = most if end < math.inf else min(most, hopeless)
        close = min(tol, max(relative * abs(end), FINEST * tol))
        if end - bounds[1] <= close or counts[3] + waiting >= limit:
            break
        counts[1] = heap_leave(keys, index, counts[1])
        side = index[0, j]
        if side < 0:
            bounds[0] = max(bounds[0], end)
            counts[4] += end == math.inf
            continue
        middle = 0.5 * nodes[j, 2 * side] + 0.5 * nodes[j, 2 * side + 1]
        for i in range(nodes.shape[1]):
            nodes[stored, i] = nodes[j, i]
        nodes[j, 2 * side + 1] = middle
        nodes[stored, 2 * side] = middle
        index[2, waiting], index[2, waiting + 1] = j, stored
        counts[2] += 1
        counts[0] += 2


@numba.njit(**AS_SHIPPED)
def heap_enter(keys, index, size, key, what):
    """Put a box into the heap, the largest bound first, and return its size."""
    at = size
    while at > 0:
        up = (at - 1) // 2
        if keys[up] >= key:
            break
        keys[at], index[1, at] = keys[up], index[1, up]
        at = up
    keys[at], index[1, at] = key, what
    return size + 1


@numba.njit(**AS_SHIPPED)
def heap_leave(keys, index, size):
    """Take the first box out of the heap, and return its size."""
    size -= 1
    key, what, at = keys[size], index[1, size], 0
    while True:
        down = 2 * at + 1
        if down >= size:
            break
        if down + 1 < size and keys[down + 1] > keys[down]:
            down += 1
        if key >= keys[down]:
            break
        keys[at], index[1, at] = keys[down], index[1, down]
        at = down
    keys[at], index[1, at] = key, what
    return size


_REAL, _COUNT = types.float64, types.int64
_ROW, _TABLE, _COUNTS = _REAL[::1], _REAL[:, ::1], _COUNT[::1]
_CODE = (types.intp, types.UniTuple(_COUNT, 2), _TABLE, _TABLE)  # and the places and rows of boxes
_LIMITS = types.Tuple((_REAL, _REAL, _COUNT, _COUNT))
BOX_SEARCH = Shipped(
    path=file_of_nlctl("native/enclosures/search.bitcode"),
    wanted=(
        Wanted(
            function=prove_below,
            signature=_COUNT(*_CODE, _TABLE, _ROW, _REAL, _COUNT, _COUNTS, _ROW),
            options=AS_SHIPPED,
        ),
        Wanted(
            function=supremum,
            signature=_COUNT(*_CODE, _TABLE, _COUNT[:, ::1], _ROW, _ROW, _LIMITS, _COUNTS, _ROW),
            options=AS_SHIPPED,
        ),
    ),
)
