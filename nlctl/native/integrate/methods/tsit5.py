"""One step of Tsitouras' explicit Runge-Kutta pair of orders 5(4), for members side by side.

Ch. Tsitouras, Computers & Mathematics with Applications 62 (2011) 770-775: the last stage of a
step is the first of the next, and a polynomial of order 4 gives the solution inside a step.

Arrays have the member ("lane") as their last index, so that one loop serves all of them: state
``x[i, lane]``, stages ``k[s, i, lane]``.  What a lane computes never depends on another lane.
"""

from __future__ import annotations

import numba
import numpy as np

from ..state import INNER

STAGES = 7
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

STABLE = 3.3  # h |lambda| on the negative real axis up to which a step is stable, a little less


@numba.njit(**INNER)
def combined(x, h, k, s, result):
    """Fill `result` with x + h (A[s, 0] k[0] + ... + A[s, s-1] k[s-1]).

    All are flat, over states and lanes, so that SIMD registers are full whatever the number of
    lanes; one loop per stage keeps every loop free of decisions.
    """
    a0, a1, a2, a3, a4, a5 = A[s, 0], A[s, 1], A[s, 2], A[s, 3], A[s, 4], A[s, 5]
    if s == 1:
        for j in range(x.size):
            result[j] = x[j] + h[j] * (a0 * k[0, j])
    elif s == 2:
        for j in range(x.size):
            result[j] = x[j] + h[j] * (a0 * k[0, j] + a1 * k[1, j])
    elif s == 3:
        for j in range(x.size):
            result[j] = x[j] + h[j] * (a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j])
    elif s == 4:
        for j in range(x.size):
            slope = a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j] + a3 * k[3, j]
            result[j] = x[j] + h[j] * slope
    elif s == 5:
        for j in range(x.size):
            slope = a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j] + a3 * k[3, j] + a4 * k[4, j]
            result[j] = x[j] + h[j] * slope
    else:
        for j in range(x.size):
            slope = a0 * k[0, j] + a1 * k[1, j] + a2 * k[2, j] + a3 * k[3, j] + a4 * k[4, j]
            result[j] = x[j] + h[j] * (slope + a5 * k[5, j])


@numba.njit(**INNER)
def difference(h, k, result):
    """Fill `result` with the difference of the solutions of order 5 and 4; all are flat."""
    e0, e1, e2, e3, e4, e5, e6 = E[0], E[1], E[2], E[3], E[4], E[5], E[6]
    for j in range(h.size):
        slope = e0 * k[0, j] + e1 * k[1, j] + e2 * k[2, j] + e3 * k[3, j]
        slope += e4 * k[4, j] + e5 * k[5, j] + e6 * k[6, j]
        result[j] = h[j] * slope


@numba.njit(**INNER)
def weighed(x, x_new, change, rtol, atol, result):
    """Fill `result` with the magnitudes of `change` over atol + rtol |x|; all are flat."""
    for j in range(x.size):
        largest = abs(x[j]) if abs(x[j]) > abs(x_new[j]) else abs(x_new[j])
        result[j] = abs(change[j]) / (atol + rtol * largest)


@numba.njit(**INNER)
def errors(parts, x_new, x_stage, k, error, rate):
    """Fill, lane by lane, the error over its tolerance, and the fastest rate seen (1/s).

    The error is the largest of the states' `parts`; it is not finite if a state is not.  (A mean
    would let the many weights of a network hide the few states that move.)  The rate
    |k6 - k5| / |x6 - x5| of the two stages at the end of the step estimates the largest eigenvalue
    (Hairer, Wanner, Solving ODEs II, IV.2).
    """
    n, lanes = x_new.shape
    for j in range(lanes):
        largest, spoilt, changes, steps = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            part = parts[i, j]
            largest = part if part > largest else largest
            spoilt += 0.0 * (part + x_new[i, j])  # NaN or infinity: no maximum keeps it
            step, change = x_new[i, j] - x_stage[i, j], k[6, i, j] - k[5, i, j]
            changes += change * change
            steps += step * step
        error[j] = largest + spoilt
        rate[j] = np.sqrt(changes / steps) if steps > 0.0 else 0.0


@numba.njit(**INNER)
def interpolate(theta, h, x, k, lane, result):
    """Fill column `lane` of `result` with the solution at the fraction theta of its step."""
    w0, w1, w2, w3 = _weight(theta, 0), _weight(theta, 1), _weight(theta, 2), _weight(theta, 3)
    w4, w5, w6 = _weight(theta, 4), _weight(theta, 5), _weight(theta, 6)
    for i in range(x.shape[0]):
        slope = w0 * k[0, i, lane] + w1 * k[1, i, lane] + w2 * k[2, i, lane]
        slope += w3 * k[3, i, lane]
        slope += w4 * k[4, i, lane]
        slope += w5 * k[5, i, lane]
        slope += w6 * k[6, i, lane]
        result[i, lane] = x[i, lane] + h * slope


@numba.njit(**INNER)
def _weight(theta, s):
    """Return the share of a stage's derivative in the solution at the fraction theta of a step."""
    return theta * (B[s, 0] + theta * (B[s, 1] + theta * (B[s, 2] + theta * B[s, 3])))
