"""The loops of the paper's two examples, fused by hand into one function each.

What a user writes who leaves the block diagram behind: an independent transcription of Lv et al.
(2017) for numba, without blocks, names or parameters.  SciPy, numbalsoda and the reference
solutions take it.  The state is x_1..x_n, W_hat, delta_hat, zeta and, in Example 2 with the
relaxed backlash, the memory.
"""

import numba
import numpy as np

jit = numba.njit(error_model="numpy", inline="always")


@jit
def _law(x, dx, n, r, Y_d, centres, beta, sigma_1, gamma, sigma_2, tau):
    """Controller (23)-(25): fill the derivatives after the plant's, return u."""
    nodes = centres.shape[0]
    network = 0.0
    for i in range(nodes):
        squared = 0.0
        for j in range(n):
            squared += (x[j] - centres[i, j]) ** 2
        psi = np.exp(-0.25 * squared)
        network += x[n + i] * psi
        dx[n + i] = 0.5 * (r * psi - sigma_1 * x[n + i])
    delta_hat, zeta = x[n + nodes], x[n + nodes + 1]
    robust = np.tanh(r / tau)
    eta = beta * r + network + delta_hat * robust + Y_d
    dx[n + nodes] = gamma * (r * robust - sigma_2 * delta_hat)
    dx[n + nodes + 1] = r * eta
    return np.exp(zeta * zeta) * np.cos(0.5 * np.pi * zeta) * eta


@jit
def _dead_zone(u):
    if u >= 0.5:
        return (1.0 + 0.3 * np.sin(u)) * (u - 0.5)
    if u <= -0.3:
        return (0.8 + 0.2 * np.cos(u)) * (u + 0.3)
    return 0.0


@numba.njit(error_model="numpy")
def example_1(t, x, dx, centres):
    """Example 1: forced oscillator behind a dead zone."""
    x1, x2 = x[0], x[1]
    s, c, s2, c2 = np.sin(t), np.cos(t), np.sin(0.5 * t), np.cos(0.5 * t)
    e1, e2 = x1 - 0.5 * (s + s2), x2 - (0.5 * c + 0.25 * c2)
    r, Y_d = 1.5 * e1 + e2, 0.5 * s + 0.125 * s2 + 1.5 * e2
    v = _dead_zone(_law(x, dx, 2, r, Y_d, centres, 2.5, 0.5, 1.5, 0.5, 0.2))
    damping, forcing = 0.2 + 0.2 * np.cos(5 * x1), (5 + 0.1 * c) * np.cos((0.5 + 0.1 * s) * t)
    h = (1 + 0.1 * np.cos(x1)) * (1 + 0.2 * np.cos(v)) * v
    dx[0] = x2
    dx[1] = 0.2 * x1 - damping * x2 - x1**3 + forcing + h + 0.1 * (x1**2 + x2**2) * s


@jit
def _command_2(t, x, dx, centres):
    """Controller of Example 2."""
    s, c, s2, c2 = np.sin(t), np.cos(t), np.sin(0.5 * t), np.cos(0.5 * t)
    e1, e2 = x[0] - 0.5 * (s + s2), x[1] - (0.5 * c + 0.25 * c2)
    e3 = x[2] + 0.5 * s + 0.125 * s2
    r, Y_d = e1 + 2 * e2 + e3, 0.5 * c + 0.0625 * c2 + e2 + 2 * e3
    return _law(x, dx, 3, r, Y_d, centres, 5.0, 0.3, 1.2, 0.3, 0.5)


@jit
def _plant_2(t, x, v, dx):
    x1, x2, x3 = x[0], x[1], x[2]
    dx[0], dx[1] = x2, x3
    h = (2 + np.cos(x1)) * (1 + 0.2 * np.sin(v) ** 2) * v
    dx[2] = -6 * x1 - 3 * x2 - 1.6 * x3 + x1**2 + h + np.sin(0.1 * t)


@numba.njit(error_model="numpy")
def example_2(t, x, dx, centres):
    """Example 2: Genesio system, the memory of its backlash relaxed at 1000 1/s."""
    u = _command_2(t, x, dx, centres)
    memory = x[x.size - 1]
    v = min(max(memory, 1.2 * (u - 0.5)), 1.2 * (u + 0.6))
    _plant_2(t, x, v, dx)
    dx[x.size - 1] = 1e3 * (v - memory)


@numba.njit(error_model="numpy")
def example_2_play(t, x, dx, centres, side, held):
    """Example 2 on one branch of the play: right side (1), left side (-1), or held (0); return u.

    `x` ends with zeta: an output that moves with u needs no memory.
    """
    u = _command_2(t, x, dx, centres)
    v = held if side == 0 else 1.2 * (u - 0.5) if side > 0 else 1.2 * (u + 0.6)
    _plant_2(t, x, v, dx)
    return u


def in_place(example):
    """Return the fused right-hand side ``f(t, x, dx, centres)`` of Example 1 or 2."""
    return example_1 if example == 1 else example_2
