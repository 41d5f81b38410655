"""One step of all solutions of x' = f(x) from a box, with their derivatives, enclosed.

With the coefficients c_k of a solution,

    x(h) = c_0 + c_1 h + ... + c_p h^p + h^(p+1) c_{p+1}(Y),

if Y holds c_0 + ... + c_p t^p + t^(p+1) c_{p+1}(Y) for all t in [0, h], which proves that there is
a solution, in Y (N. Nedialkov, K. Jackson, J. Pryce, Reliable Computing 7:449, 2001).
"""

from __future__ import annotations

import numba
import numpy as np

from ..machine.address import call_enclosure
from ..machine.export import AS_SHIPPED
from .intervals import down, interval_product, power_of_time, up, write_into

_TRIES = 2  # of what the rest may be, for one step size


@numba.njit(**AS_SHIPPED)
def coefficients(code, places, folds, box, orders, k, read, first):
    """Enclose the coefficients up to an order on a box in every lane."""
    # Shapes: `box` (4n, 2, lanes), `k` (orders + 1, rows, 2, lanes).
    rows, kept_rows, _, o, w, x, _ = places
    call_enclosure(code[0], box, first)
    write_into(k[0], first[:rows])
    write_into(read[o : o + kept_rows], first[rows:])
    write_into(read[x : x + box.shape[0]], box)
    for order in range(1, orders + 1):
        read[w].fill(order)
        read[w + 1, 0].fill(down(1.0 / order))
        read[w + 1, 1].fill(up(1.0 / order))
        read[w + 2].fill(1.0 if order == 1 else 0.0)
        write_into(read[:rows], k[order - 1])
        _sum_products(folds, order, k, read)
        call_enclosure(code[1], read, k[order])


@numba.njit(**AS_SHIPPED)
def _sum_products(folds, order, k, read):
    """Add up what an order needs of those before."""
    for f in range(folds.shape[0]):
        left, right, at = folds[f]
        least, most = read[at, 0], read[at, 1]
        least.fill(0.0)
        most.fill(0.0)
        for j in range(1, order):
            a, b = k[j, left, 0], k[j, left, 1]
            c, d = k[order - j, right, 0], k[order - j, right, 1]
            for lane in range(least.size):
                low, high = interval_product(a[lane], b[lane], c[lane], d[lane])
                least[lane], most[lane] = down(least[lane] + low), up(most[lane] + high)


@numba.njit(**AS_SHIPPED)
def fill_lanes(box, middle, lanes):
    """Give each pair of directions a lane with the box, and each direction one with the middle."""
    # Shapes: `lanes` (groups, 4n, 2, lanes).
    n, lane, width = middle.size, 0, lanes.shape[3]
    pairs = n * (n + 1) // 2
    lanes.fill(0.0)
    for lane in range(lanes.shape[0] * width):
        g, at = lane // width, lane % width
        for i in range(n):
            lanes[g, i, 0, at] = box[i, 0] if lane < pairs else middle[i]
            lanes[g, i, 1, at] = box[i, 1] if lane < pairs else middle[i]
    lane = 0
    for i in range(n):
        for j in range(i + 1):
            for end in range(2):
                lanes[lane // width, n + i, end, lane % width] = 1.0
                lanes[lane // width, 2 * n + j, end, lane % width] = 1.0
            lane += 1
    for i in range(n):
        for end in range(2):
            lanes[(pairs + i) // width, n + i, end, (pairs + i) % width] = 1.0


@numba.njit(**AS_SHIPPED)
def flow_derivatives(lanes, at, J, H):
    """Read where the middle comes to, and both derivatives."""
    # Shapes: `at` (n, 2), `J` (n, n, 2), `H` (n, n, n, 2).
    n, width, lane = at.shape[0], lanes.shape[3], 0
    for i in range(n):
        for j in range(i + 1):
            for k in range(n):
                for end in range(2):
                    value = lanes[lane // width, 3 * n + k, end, lane % width]
                    H[k, i, j, end] = H[k, j, i, end] = value
            lane += 1
    for k in range(n):
        for end in range(2):
            at[k, end] = lanes[lane // width, k, end, lane % width]
    for i in range(n):
        for k in range(n):
            for end in range(2):
                J[k, i, end] = lanes[(lane + i) // width, n + k, end, (lane + i) % width]


@numba.njit(**AS_SHIPPED)
def add_up(k, orders, time, rest, sums):
    """Write the polynomial at a time, an interval of shape (2,), with a rest of one more order."""
    # Shapes: `k` (orders + 2, rows, 2, lanes), `rest, sums` (4n, 2, lanes).
    for i in range(sums.shape[0]):
        for lane in range(sums.shape[2]):
            low, high = rest[i, 0, lane], rest[i, 1, lane]
            for order in range(orders, -1, -1):
                low, high = interval_product(low, high, time[0], time[1])
                low = down(low + k[order, i, 0, lane])
                high = up(high + k[order, i, 1, lane])
            sums[i, 0, lane], sums[i, 1, lane] = low, high


@numba.njit(**AS_SHIPPED)
def rest_of_step(code, places, folds, order, h, k, ky, lanes, rest, pad, read, first):
    """Find the rest of a step of size h; return whether there is one."""
    # Shapes: `k, ky` (groups, order + 2, rows, 2, lanes), `lanes, rest` (groups, 4n, 2, lanes),
    # `pad` as these: how far around the polynomial solutions are looked for.
    span, power = np.array([0.0, h]), np.empty(2)
    power_of_time(h, order + 1, power)
    rows = lanes.shape[1]
    for g in range(lanes.shape[0]):
        pad[g].fill(0.0)
        for i in range(rows):
            for lane in range(lanes.shape[3]):
                size = max(-k[g, order, i, 0, lane], k[g, order, i, 1, lane]) * h**order
                around = max(size, 1e-15 * abs(k[g, 0, i, 1, lane]) + 1e-300)
                pad[g, i, 0, lane], pad[g, i, 1, lane] = -around, around
        is_held = False
        for _ in range(_TRIES):
            rest[g].fill(0.0)
            add_up(k[g], order, span, rest[g], lanes[g])
            _widen(lanes[g], pad[g])
            coefficients(code, places, folds, lanes[g], order + 1, ky[g], read, first)
            is_held = _held(ky[g, order + 1], power, pad[g])
            if is_held:
                is_held = _exist(ky[g, 0, rows : 2 * rows])
                break
        if not is_held:
            return False
        write_into(rest[g], ky[g, order + 1, :rows])
    return True


@numba.njit(**AS_SHIPPED)
def _exist(rates):
    """Whether the rates have values, and do not jump: higher coefficients may well have both."""
    holds = True
    for i in range(rates.shape[0]):
        for lane in range(rates.shape[2]):
            holds = holds and rates[i, 0, lane] <= rates[i, 1, lane]
    return holds


@numba.njit(**AS_SHIPPED)
def _widen(lanes, pad):
    for i in range(lanes.shape[0]):
        for lane in range(lanes.shape[2]):
            lanes[i, 0, lane] = down(lanes[i, 0, lane] + pad[i, 0, lane])
            lanes[i, 1, lane] = up(lanes[i, 1, lane] + pad[i, 1, lane])


@numba.njit(**AS_SHIPPED)
def _held(coefficient, power, pad):
    """Whether the rest lies where it was looked for; otherwise make that wider."""
    holds = True
    for i in range(pad.shape[0]):
        for lane in range(pad.shape[2]):
            low, high = interval_product(
                coefficient[i, 0, lane], coefficient[i, 1, lane], power[0], power[1]
            )
            if not (pad[i, 0, lane] <= low and high <= pad[i, 1, lane]):
                holds = False
                around = 2.0 * max(-low, high)
                pad[i, 0, lane], pad[i, 1, lane] = -around, around
    return holds
