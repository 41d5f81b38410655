"""Functions with handlers, messages of errors, branches in loops, and objects in rows."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from numpy.polynomial import Chebyshev, Legendre
from scipy.interpolate import RectBivariateSpline, interpn

from engineers.entry import engineered

VALVE = pd.DataFrame(
    {"lift": [0, 0.2, 0.4, 0.6, 0.8, 1.0], "cv": [0.0, 0.05, 0.15, 0.32, 0.6, 1.0]}
)
ALPHA = np.deg2rad(np.array([-10.0, -5, 0, 5, 10, 15, 20]))
MACH = np.array([0.2, 0.6, 0.9])
CL = np.array(
    [
        [-0.8, -0.9, -1.0],
        [-0.3, -0.35, -0.4],
        [0.2, 0.22, 0.25],
        [0.7, 0.75, 0.8],
        [1.2, 1.25, 1.3],
        [1.4, 1.3, 1.2],
        [1.2, 1.0, 0.9],
    ]
)
CD = RectBivariateSpline(ALPHA, MACH, 0.02 + 0.05 * CL**2, kx=1, ky=1)
GX, GY = np.linspace(0, 4, 5), np.linspace(0, 2, 3)
GZ = np.arange(15.0).reshape(5, 3) ** 1.5
cheb = Chebyshev([0.1, 0.5, -0.2, 0.05], domain=[-2, 2])
leg = Legendre([0, 1, 0.3])


@engineered(2)
def valve_by_pandas_table(t, x, u, params):
    cv = np.interp(x[1], VALVE["lift"], VALVE["cv"])
    return [u[0] - cv * np.sqrt(max(x[0], 0)), 0.5 * (0.4 - x[1])]


@engineered(2)
def monod(t, x, u, params):
    X, S = x
    assert len(x) == 2, f"expected two states, got {len(x)}"
    try:
        mu = 0.5 * S / (0.1 + S)
    except ZeroDivisionError:
        mu = 0.0
    D = u[0] if u[0] > 0 else 0.0
    return [(mu - D) * X, D * (5 - S) - mu * X / 0.4]


@engineered(2)
def schedule_dict(t, x, u, params):
    sp = {0: 1.0, 1: 2.0, 2: 0.5}.get(int(t), 0.0)
    return [sp - x[0], u[0] - x[1]]


@engineered(3)
def vectorized_by_a_decorator(t, x, u, params):
    @np.vectorize
    def dz(v):
        if v > 0.5:
            return v - 0.5
        elif v < -0.5:
            return v + 0.5
        return 0.0

    return u[0] - dz(x)


@engineered(3)
def pinv_of_state(t, x, u, params):
    J = np.array([[np.cos(x[0]), np.sin(x[1]), 1.0]])
    return np.linalg.pinv(J) @ np.array([u[0]]) - x


@engineered(2)
def while_dynamic(t, x, u, params):
    th = x[0]
    while th > math.pi:
        th -= 2 * math.pi
    while th < -math.pi:
        th += 2 * math.pi
    return [x[1], -th - x[1] + u[0]]


@engineered(2)
def guard_raise(t, x, u, params):
    if np.isnan(x).any():
        raise ValueError(f"state is NaN at t={t:.3f}")
    if np.any(np.abs(x) > 1e6):
        raise RuntimeError("diverged: x = {}".format(x))  # noqa: UP032
    return [x[1], u[0] - x[0]]


@engineered(3)
def where_indices(t, x, u, params):
    idx = np.where(x > 0)[0]
    return u[0] - x - 0.1 * len(idx)


@engineered(2)
def drag_of_a_surface(t, x, u, params):
    V, alpha = x
    rho = 1.2
    return [
        u[0] - 0.5 * rho * V * abs(V) * CD.ev(alpha, V / 340.0),
        -alpha + 0.1 * CD(alpha, 0.5)[0, 0],
    ]


@dataclass
class Thruster:
    pos: npt.NDArray
    dir: npt.NDArray
    tau: float = 0.1

    def wrench(self, f: float) -> npt.NDArray:
        F = f * self.dir
        return np.hstack([F, np.cross(self.pos, F)])


THR = [
    Thruster(np.array([0.5, 0.2, 0]), np.array([1.0, 0, 0])),
    Thruster(np.array([0.5, -0.2, 0]), np.array([1.0, 0, 0])),
    Thruster(np.array([0, 0, 0.1]), np.array([0, 0, 1.0])),
]


@engineered(9, 3)
def rov_allocation(t, x, u, params):
    nu, f = x[:6], x[6:]
    tau = sum((th.wrench(fi) for th, fi in zip(THR, f)), start=np.zeros(6))
    M = np.diag([10, 12, 12, 1, 1.5, 1.5])
    D = np.diag([3.0] * 3 + [0.5] * 3)
    return np.concatenate(
        [np.linalg.solve(M, tau - D @ nu), (u - f) / np.array([th.tau for th in THR])]
    )


@engineered(2)
def interpn_lookup(t, x, u, params):
    z = interpn((GX, GY), GZ, np.array([x[0], x[1]]), bounds_error=False, fill_value=None)
    return [u[0] - 0.1 * z[0], -x[1]]


@engineered(2)
def chebyshev_drag(t, x, u, params):
    return [x[1], -cheb(x[1]) - leg(x[0]) + u[0]]


@engineered(4)
def kinetics_stoichiometry(t, x, u, params):
    S = np.array([[-1, 0, 1], [1, -1, 0], [0, 1, -1], [0, 1, 0]])
    k = np.array([1.0, 0.5, 0.1])
    r = k * np.array([x[0], x[1] ** 2, x[2]])
    return S.dot(r) + np.eye(4)[0] * u[0]


@engineered(6, 2)
def redundant_arm_pinv(t, x, u, params):
    q = x[:3]
    c = np.cumsum(q)
    l = np.array([0.5, 0.4, 0.3])
    J = np.vstack([-np.cumsum((l * np.sin(c))[::-1])[::-1], np.cumsum((l * np.cos(c))[::-1])[::-1]])
    dq = np.linalg.pinv(J) @ u + (np.eye(3) - np.linalg.pinv(J) @ J) @ (-0.1 * q)
    return np.r_[dq, dq - x[3:]]


@engineered(2)
def eig_stability_margin(t, x, u, params):
    A = np.array([[0, 1], [-1 - x[0] ** 2, -0.5]])
    margin = -max(np.linalg.eigvals(A).real)
    return [x[1], -x[0] - margin * x[1] + u[0]]


@engineered(2)
def time_table_steps(t, x, u, params):
    sched = [(0, 20.0), (6, 21.5), (22, 18.0)]
    hour = (t * 10) % 24
    sp = [v for h, v in sched if h <= hour][-1]
    return [0.1 * (sp - x[0]) + u[0], x[0] - x[1]]


@engineered(10)
def zones_with_valves(t, x, u, params):
    dx = np.zeros(10)
    for i in range(10):
        if x[i] > 1.0:
            q = 1.0
        elif x[i] < -1.0:
            q = -1.0
        else:
            q = x[i]
        dx[i] = u[0] - q
    return dx


@engineered(12)
def written_in_branches(t, x, u, params):
    dx = -0.1 * x
    for i in range(12):
        if x[i] > 0.5 and not x[i] > 2:
            dx[i] -= 1.0
        elif -2 < x[i] < -0.5 or x[i] == 7.0:
            dx[i] = 1.0 + u[0]
    return dx


@engineered(9)
def tank_row(t, x, u, params):
    flows = []
    for i in range(8):
        d = x[i] - x[i + 1]
        flows.append(math.sqrt(d) if d > 0 else -math.sqrt(-d))
    dx = [u[0] - flows[0]] + [flows[i - 1] - flows[i] for i in range(1, 8)] + [flows[-1]]
    return dx


@engineered(8)
def counted_above(t, x, u, params):
    n = 0
    for v in x:
        if v > 0:
            n += 1
    k = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2][n]
    return u[0] - k * x


@engineered(16)
def friction_of_many(t, x, u, params):
    def f(v):
        if abs(v) < 0.1:
            return 10 * v
        return np.sign(v)

    return np.array([u[0] - f(v) for v in x])


def choked_flow(p_in, p_out, area):
    if p_out <= 0:
        return 0.0
    ratio = p_in / p_out
    if ratio >= 1.9:
        return 0.7 * area * p_in
    if ratio >= 1.0:
        if p_in == 0:
            p_in = 1e-9
        head = p_in - p_out
        head *= 2.0
        return area * np.sqrt(head)
    low, high = p_in, p_out
    return -area * np.sqrt(2.0 * (high - low))


@engineered(8)
def valve_flows_of_many(t, x, u, params):
    return [choked_flow(p, 1.0 + 0.1 * u[0], 0.3) - p for p in x]


def between_walls(x, v, force):
    low = (x <= 0 and force < 0) or x < -1
    high = (x >= 1 and force > 0) or x > 2
    if low or high:
        return 0.0
    rate = force - v
    return rate if abs(rate) > 0.1 else 0.0


@engineered(9)
def pistons_between_walls(t, x, u, params):
    return [between_walls(p, x[8], u[0]) for p in x]


@engineered(3, 3)
def euler_rates_with_a_message(t, x, u, params):
    phi, theta = float(x[0]), float(x[1])
    cos, sin = math.cos(theta), math.sin(theta)
    try:
        rates = np.array(
            [
                [1, math.sin(phi) * sin / cos, math.cos(phi) * sin / cos],
                [0, math.cos(phi), -math.sin(phi)],
                [0, math.sin(phi) / cos, math.cos(phi) / cos],
            ]
        )
    except ZeroDivisionError:
        print("there are no Euler angles at a pitch of 90 degrees")
    return rates @ u - x
