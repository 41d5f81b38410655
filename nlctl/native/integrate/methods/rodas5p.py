"""One step of the stiff method Rodas5P.

G. Steinebach, BIT Numerical Mathematics 63:27 (2023): a Rosenbrock method of order 5(4) with 8
stages, L-stable and stiffly accurate, with a dense output of order 4.  In transformed variables,

    (I / (h gamma) - J) U_i = f(t + c_i h, x + sum_j A_ij U_j) + sum_j (C_ij / h) U_j + h d_i f_t

the new state is the last stage's state plus U_8, and U_8 estimates the error.
"""

from __future__ import annotations

import numba
import numpy as np

from ..state import INNER

STAGES, ORDER = 8, 5
GAMMA = 0.21193756319429014
NODES = np.array([0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716])
NODES = np.concatenate([NODES, [0.4288403609558664, 1.0, 1.0, 1.0]])
INSIDE = (float(NODES[2]), float(NODES[1]), float(NODES[3]))  # where event functions are kept
KEPT = np.array([3, 1, 0, 2, 3, 3, 3, 3])  # which of these a stage belongs to, 3 for none
D = np.array([0.21193756319429014, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734])
D = np.concatenate([D, [2.325825639765069, 0.0, 0.0, 0.0]])
A = np.zeros((8, 8))
A[1, :1] = 3.0
A[2, :2] = 2.849394379747939, 0.45842242204463923
A[3, :3] = -6.954028509809101, 2.489845061869568, -10.358996098473584
A[4, :4] = 2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641
A[5, :5] = (
    *(-7.502846399306121, 2.561846144803919, -11.627539656261098),
    *(-0.18268767659942256, 0.030198172008377946),
)
A[6, :6] = *A[5, :5], 1.0
A[7, :7] = *A[6, :6], 1.0
C = np.zeros((8, 8))
C[1, :1] = -14.155112264123755
C[2, :2] = -17.97296035885952, -2.859693295451294
C[3, :3] = 147.12150275711716, -1.41221402718213, 71.68940251302358
C[4, :4] = 165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306
C[5, :5] = (
    *(24.854864614690072, -3.0009227002832186, 47.4931110020768),
    *(5.5814197821558125, -0.6610691825249471),
)
C[6, :6] = (
    *(30.91273214028599, -3.1208243349937974, 77.79954646070892),
    *(34.28646028294783, -19.097331116725623, -28.087943162872662),
)
C[7, :7] = (
    *(37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047),
    *(-40.06618937091002, -54.66780262877968, -9.48861652309627),
)
H = np.zeros((3, 8))  # dense output
H[0] = (
    *(25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204),
    *(0.524948541321073, 1.1241088310450404, 0.4272876194431874, -0.17202221070155493),
)
H[1] = (
    *(-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796),
    *(20.176138334709044, 15.98066361424651, -6.789040303419874, -6.710236069923372),
)
H[2] = (
    *(11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643),
    *(-52.072871366152654, -59.78993625266729, -0.15582684282751913, 4.883087185713722),
)


@numba.njit(**INNER)
def stage(s, x, U, result):
    """Fill `result` with the state of stage `s`."""
    for i in range(x.size):
        result[i] = x[i]
    for j in range(s):
        weight = A[s, j]
        for i in range(x.size):
            result[i] += weight * U[j, i]


@numba.njit(**INNER)
def right_side(s, h, dx, f_t, U):
    """Fill U[s] with the right side of its linear equations, dx the derivative at stage `s`."""
    for i in range(dx.size):
        U[s, i] = dx[i] + h * D[s] * f_t[i]
    for j in range(s):
        weight = C[s, j] / h
        for i in range(dx.size):
            U[s, i] += weight * U[j, i]


@numba.njit(**INNER)
def tolerance(i, x, x_new, rtol, atol):
    """Return what the error of a state may be in a step."""
    return atol + rtol * max(abs(x[i, 0]), abs(x_new[i, 0]))


@numba.njit(**INNER)
def error_norm(x, x_new, U, rtol, atol):
    """Return the largest error over the tolerance; not finite if a state is not."""
    largest, spoilt = 0.0, 0.0
    for i in range(x.shape[0]):
        part = abs(U[7, i] / tolerance(i, x, x_new, rtol, atol))
        largest = part if part > largest else largest
        spoilt += 0.0 * (part + x_new[i, 0])  # NaN or infinity: no maximum keeps it
    return largest + spoilt


@numba.njit(**INNER)
def interpolate(theta, x, x_new, U, result):
    """Fill `result` with the solution at the fraction theta of a step."""
    for i in range(x.shape[0]):
        polynomial = 0.0
        for m in (2, 1, 0):
            coefficient = 0.0
            for s in range(STAGES):
                coefficient += H[m, s] * U[s, i]
            polynomial = polynomial * theta + coefficient
        rest = 1.0 - theta
        result[i, 0] = rest * x[i, 0] + theta * (x_new[i, 0] + rest * polynomial)


@numba.njit(**INNER)
def end_slope(h, x, x_new, U, result):
    """Fill `result` with the slope of the interpolant at the end of a step."""
    for i in range(x.size):
        rest = 0.0
        for s in range(STAGES):
            rest += (H[0, s] + H[1, s] + H[2, s]) * U[s, i]
        result[i] = (x_new[i] - x[i] - rest) / h
