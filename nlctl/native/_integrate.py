"""Adaptive explicit Runge-Kutta integration of a compiled right-hand side.

Tsitouras' pair of orders 5(4) (Ch. Tsitouras, Computers & Mathematics with Applications 62, 2011,
770-775): the last stage of a step is the first of the next, and a polynomial of order 4 gives the
solution between the ends of a step.  Steps end where the inputs have a corner.

The integrator takes the right-hand side as a function argument of one fixed type, so that it is
compiled once and not once per diagram.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from enum import IntEnum

import numba
import numpy as np

VECTOR = numba.float64[::1]
OUT = numba.types.FunctionType(numba.void(numba.float64, VECTOR, VECTOR, VECTOR, VECTOR))
RHS = numba.types.FunctionType(numba.void(numba.float64, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR))

C = np.array([0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0])
A = np.zeros((7, 7))
A[1, :1] = 0.161
A[2, :2] = -0.008480655492356989, 0.335480655492357
A[3, :3] = 2.8971530571054935, -6.359448489975075, 4.3622954328695815
A[4, :4] = 5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525
A[5, :5] = (
    *(5.86145544294642, -12.92096931784711, 8.159367898576159),
    *(-0.071584973281401, -0.028269050394068383),
)
A[6, :6] = (
    *(0.09646076681806523, 0.01, 0.4798896504144996),
    *(1.379008574103742, -3.290069515436081, 2.324710524099774),
)
# difference of the solutions of order 5 and 4
E = np.array(
    [
        *(-0.00178001105222577714, -0.0008164344596567469, 0.007880878010261995),
        *(-0.1447110071732629, 0.5823571654525552, -0.45808210592918697, 0.015151515151515152),
    ]
)
# b_i(theta) = theta (B[i,0] + B[i,1] theta + B[i,2] theta^2 + B[i,3] theta^3)
B = np.zeros((7, 4))
B[0] = 1.0, -2.763706197274826, 2.9132554618219126, -1.0530884977290216
B[1] = 0.0, 0.13169999999999998, -0.2234, 0.1017
B[2] = 0.0, 3.9302962368947516, -5.941033872131505, 2.490627285651253
B[3] = 0.0, -12.411077166933676, 30.33818863028232, -16.548102889244902
B[4] = 0.0, 37.50931341651104, -88.1789048947664, 47.37952196281928
B[5] = 0.0, -27.896526289197286, 65.09189467479366, -34.87065786149661
B[6] = 0.0, 1.5, -4.0, 2.5


class Status(IntEnum):
    """How a run ended."""

    OK = 0
    DIVERGED = 1
    STEP_LIMIT = 2
    STEP_TOO_SMALL = 3


OK, DIVERGED, STEP_LIMIT, STEP_TOO_SMALL = map(int, Status)  # what compiled code returns


@numba.njit(cache=True, error_model="numpy")
def _input_at(t, segment, times, inputs, u):
    """Fill `u` with the inputs at time t, linear within a segment of the time grid."""
    t0, t1 = times[segment], times[segment + 1]
    share = (t - t0) / (t1 - t0)
    for i in range(u.size):
        u[i] = inputs[i, segment] * (1.0 - share) + inputs[i, segment + 1] * share


@numba.njit(cache=True, error_model="numpy")
def _error_norm(h, x, x_new, k, rtol, atol):
    """Root mean square of the estimated error over its tolerance; not finite if a state is not."""
    total = 0.0
    for i in range(x.size):
        error = 0.0
        for s in range(7):
            error += E[s] * k[s, i]
        scale = atol + rtol * max(abs(x[i]), abs(x_new[i]))
        total += (h * error / scale) ** 2 + 0.0 * x_new[i]
    return np.sqrt(total / max(x.size, 1))


@numba.njit(cache=True, error_model="numpy")
def _interpolate(theta, h, x, k, result):
    """Fill `result` with the solution at the fraction theta of a step."""
    for i in range(x.size):
        slope = 0.0
        for s in range(7):
            weight = B[s, 3]
            for j in (2, 1, 0):
                weight = weight * theta + B[s, j]
            slope += weight * k[s, i]
        result[i] = x[i] + h * theta * slope


@numba.njit(cache=True, error_model="numpy")
def _first_step(rhs, t, x, u, p, g, k, rtol, atol, span):
    """Return a first step after Hairer, Norsett, Wanner, Solving ODEs I, II.4; k[0] is f(t, x)."""
    d0 = d1 = d2 = 0.0
    for i in range(x.size):
        scale = atol + rtol * abs(x[i])
        d0 += (x[i] / scale) ** 2
        d1 += (k[0, i] / scale) ** 2
    d0, d1 = np.sqrt(d0 / max(x.size, 1)), np.sqrt(d1 / max(x.size, 1))
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    h0 = min(h0, span)
    rhs(t + h0, x + h0 * k[0], u, p, k[1], g)
    for i in range(x.size):
        d2 += ((k[1, i] - k[0, i]) / (atol + rtol * abs(x[i]))) ** 2
    d2 = np.sqrt(d2 / max(x.size, 1)) / h0
    largest = max(d1, d2)
    h1 = max(1e-6, h0 * 1e-3) if largest <= 1e-15 else (0.01 / largest) ** 0.2
    return min(100 * h0, h1, span)


@numba.njit(cache=True, error_model="numpy")
def _stages(rhs, t, h, x, segment, times, inputs, u, p, g, k, x_new):
    """Evaluate stages 2 to 7 of a step; `x_new` becomes the solution at its end."""
    for s in range(1, 7):
        for i in range(x.size):
            slope = 0.0
            for j in range(s):
                slope += A[s, j] * k[j, i]
            x_new[i] = x[i] + h * slope
        if u.size:
            _input_at(t + C[s] * h, segment, times, inputs, u)
        rhs(t + C[s] * h, x_new, u, p, k[s], g)


def tsit5(rhs, times, inputs, x0, p, g, rtol, atol, max_steps, states):
    """Integrate from times[0] to times[-1] and fill ``states[m]`` with the state at times[m].

    Returns
    -------
    status : int
        See `Status`.
    t : float
        Time reached.
    accepted, rejected : int
        Numbers of steps.
    """
    n, last = x0.size, times.size - 1
    x, x_new, k = x0.copy(), np.empty(n), np.empty((7, n))
    u = inputs[:, 0].copy()
    t, segment, accepted, rejected, error_before = times[0], 0, 0, 0, 1.0
    states[0] = x
    rhs(t, x, u, p, k[0], g)
    h = _first_step(rhs, t, x, u, p, g, k, rtol, atol, times[last] - t)
    while segment < last:
        # with inputs a step ends at the next corner, without at the end of the run
        stop = times[segment + 1] if u.size else times[last]
        if accepted + rejected >= max_steps:
            return STEP_LIMIT, t, accepted, rejected
        if not abs(h) > 4e-16 * max(abs(t), 1e-300):
            return (
                (STEP_TOO_SMALL if np.all(np.isfinite(k[0])) else DIVERGED),
                t,
                accepted,
                rejected,
            )
        is_last = t + 1.01 * h >= stop
        step = stop - t if is_last else h
        _stages(rhs, t, step, x, segment, times, inputs, u, p, g, k, x_new)
        error = _error_norm(step, x, x_new, k, rtol, atol)
        if not error <= 1.0:  # NaN and infinity are rejected as well
            rejected += 1
            h = step * (max(0.2, 0.9 * error**-0.2) if np.isfinite(error) else 0.1)
            continue
        accepted += 1
        t_new = stop if is_last else t + step
        while segment < last and times[segment + 1] <= t_new:
            segment += 1
            _interpolate((times[segment] - t) / step, step, x, k, states[segment])
        if is_last:
            states[segment] = x_new  # exactly the solution, not its interpolant
        error = max(error, 1e-10)
        factor = 0.9 * error**-0.14 * error_before**0.08  # PI control
        h = step * min(10.0, max(0.2, factor)) if not (is_last and step < h) else h
        error_before = error
        t, x, x_new = t_new, x_new, x
        k[0] = k[6]
    return OK, t, accepted, rejected


@functools.cache
def integrator() -> Callable[..., tuple[int, float, int, int]]:
    """Return `tsit5` as machine code: made when first needed, from the cache in later sessions."""
    number, count, matrix = numba.float64, numba.int64, numba.float64[:, ::1]
    arguments = (RHS, VECTOR, matrix, VECTOR, VECTOR, VECTOR, number, number, count, matrix)
    signature = numba.types.Tuple((count, number, count, count))(*arguments)
    return numba.njit(signature, cache=True, nogil=True, error_model="numpy")(tsit5)
