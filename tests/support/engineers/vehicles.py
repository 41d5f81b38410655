"""Robots, vehicles and aircraft: rotations, tables, gears, modes."""

import math
from collections import namedtuple
from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cache

import numpy as np
from numpy.linalg import norm, solve
from scipy.interpolate import (
    RegularGridInterpolator,
    interp1d,
)

from engineers.entry import engineered

G = 9.80665


def rot_x(a):
    c, s = np.cos(a), np.sin(a)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def rot_y(a):
    c, s = np.cos(a), np.sin(a)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def rot_z(a):
    c, s = np.cos(a), np.sin(a)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def skew(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


INERTIA = np.diag([0.0347563, 0.0458929, 0.0977])


@engineered(12, 4)
def quadrotor_euler(t, x, u, params):
    m = params.get("m", 0.8)
    pos, vel, eul, omega = np.split(x, 4)
    phi, theta, psi = eul
    Rb = rot_z(psi) @ rot_y(theta) @ rot_x(phi)
    T = np.array([0, 0, u[0]])
    acc = Rb @ T / m - np.array([0, 0, G])
    W = np.array(
        [
            [1, np.sin(phi) * np.tan(theta), np.cos(phi) * np.tan(theta)],
            [0, np.cos(phi), -np.sin(phi)],
            [0, np.sin(phi) / np.cos(theta), np.cos(phi) / np.cos(theta)],
        ]
    )
    eul_dot = W @ omega
    omega_dot = np.linalg.inv(INERTIA) @ (u[1:] - np.cross(omega, INERTIA @ omega))
    return np.concatenate((vel, acc, eul_dot, omega_dot))


@engineered(13, 6)
def rigid_body_quaternion(t, x, u, params):
    q = x[6:10] / np.linalg.norm(x[6:10])
    w, v = q[0], q[1:]
    C = (w**2 - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * skew(v)
    f, tau = u[:3], u[3:]
    omega = x[10:13]
    Omega = np.zeros((4, 4))
    Omega[0, 1:] = -omega
    Omega[1:, 0] = omega
    Omega[1:, 1:] = -skew(omega)
    dq = 0.5 * Omega @ x[6:10] + 0.1 * (1 - np.dot(x[6:10], x[6:10])) * x[6:10]
    J = params.get("J", INERTIA)
    domega = np.linalg.solve(J, tau - np.cross(omega, J.dot(omega)))
    return np.hstack([x[3:6], C @ f / 1.5 + [0.0, 0.0, -G], dq, domega])


class TwoLinkArm:
    """Planar two-link manipulator."""

    def __init__(self, m1=1.0, m2=1.0, l1=1.0, l2=0.8, friction=(0.1, 0.2)):
        self.m1, self.m2, self.l1, self.l2 = m1, m2, l1, l2
        self.friction = np.asarray(friction)

    @property
    def lc(self):
        return 0.5 * self.l1, 0.5 * self.l2

    def mass_matrix(self, q):
        lc1, lc2 = self.lc
        c2 = np.cos(q[1])
        h11 = self.m1 * lc1**2 + self.m2 * (self.l1**2 + lc2**2 + 2 * self.l1 * lc2 * c2) + 0.1
        h12 = self.m2 * (lc2**2 + self.l1 * lc2 * c2)
        h22 = self.m2 * lc2**2 + 0.05
        return np.array([[h11, h12], [h12, h22]])

    def coriolis(self, q, dq):
        h = -self.m2 * self.l1 * self.lc[1] * np.sin(q[1])
        return np.array([[h * dq[1], h * (dq[0] + dq[1])], [-h * dq[0], 0.0]])

    def gravity(self, q):
        lc1, lc2 = self.lc
        return G * np.array(
            [
                (self.m1 * lc1 + self.m2 * self.l1) * np.cos(q[0])
                + self.m2 * lc2 * np.cos(q.sum()),
                self.m2 * lc2 * np.cos(q.sum()),
            ]
        )

    def __call__(self, t, x, u, params):
        q, dq = x.reshape(2, 2)
        rhs = u - self.coriolis(q, dq) @ dq - self.gravity(q) - self.friction * dq
        ddq = np.linalg.solve(self.mass_matrix(q), rhs)
        return np.append(dq, ddq)


arm = TwoLinkArm()


@engineered(4, 2)
def arm_that_is_called(t, x, u, params):
    return arm(t, x, u, params)


DH = [(0.0, np.pi / 2, 0.3), (0.5, 0.0, 0.0), (0.4, 0.0, 0.0)]


def dh_transform(theta, a, alpha, d):
    ct_, st = np.cos(theta), np.sin(theta)
    ca, sa = np.cos(alpha), np.sin(alpha)
    return np.array(
        [
            [ct_, -st * ca, st * sa, a * ct_],
            [st, ct_ * ca, -ct_ * sa, a * st],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
    )


@engineered(3, 3)
def resolved_rate_control(t, q, u, params):
    """Joint velocities that follow a point, by a damped pseudo-inverse."""
    Ts = [np.eye(4)]
    for th, (a, al, d) in zip(q, DH):
        Ts.append(Ts[-1] @ dh_transform(th, a, al, d))
    p = Ts[-1][:3, 3]
    J = np.column_stack([np.cross(T[:3, 2], p - T[:3, 3]) for T in Ts[:-1]])
    lam = 0.05
    e = u - p
    return J.T @ np.linalg.solve(J @ J.T + lam**2 * np.eye(3), 2.0 * e)


@engineered(3, 2)
def planar_arm_pinv(t, q, u, params):
    L = np.array([0.4, 0.3, 0.2])
    angles = np.cumsum(q)
    p = np.array([L @ np.cos(angles), L @ np.sin(angles)])
    J = np.zeros((2, 3))
    for i in range(3):
        J[0, i] = -np.sum(L[i:] * np.sin(angles[i:]))
        J[1, i] = np.sum(L[i:] * np.cos(angles[i:]))
    qd = np.linalg.pinv(J) @ (u - p)
    null = (np.eye(3) - np.linalg.pinv(J) @ J) @ (-0.1 * q)
    return qd + null


engine_rpm = np.array([800, 1500, 2500, 3500, 4500, 5500, 6500.0])


engine_torque = np.array([120, 160, 195, 210, 205, 190, 150.0])


torque_map = interp1d(engine_rpm, engine_torque, bounds_error=False, fill_value=(120.0, 0.0))


GEARS = {1: 3.6, 2: 2.1, 3: 1.4, 4: 1.0, 5: 0.8}


SHIFT_UP = (8.0, 14.0, 20.0, 28.0)


def select_gear(v):
    for g, limit in enumerate(SHIFT_UP, start=1):
        if v < limit:
            return g
    return 5


@engineered(1, 2)
def longitudinal_with_gears(t, x, u, params):
    v = x[0]
    throttle, slope = np.clip(u[0], 0, 1), u[1]
    gear = select_gear(v)
    ratio = GEARS[gear] * 3.9
    rpm = max(v / 0.31 * ratio * 60 / (2 * np.pi), 800.0)
    F_drive = 0.92 * throttle * float(torque_map(rpm)) * ratio / 0.31
    F_res = 0.5 * 1.2 * 0.7 * v * abs(v) + 1400 * G * (0.012 * np.sign(v) + np.sin(slope))
    return [(F_drive - F_res) / 1400]


def magic_formula(alpha, Fz, B=10.0, C=1.9, D=1.0, E=0.97):
    """Pacejka."""
    Ba = B * alpha
    return Fz * D * np.sin(C * np.arctan(Ba - E * (Ba - np.arctan(Ba))))


@engineered(3, 2)
def bicycle_pacejka(t, x, u, params):
    vy, r, vx = x
    m, Iz, lf, lr = (
        params.get(k, d) for k, d in (("m", 1500.0), ("Iz", 2500.0), ("lf", 1.2), ("lr", 1.4))
    )
    delta, ax = u
    vx_safe = np.maximum(vx, 1.0)
    alpha_f = delta - np.arctan2(vy + lf * r, vx_safe)
    alpha_r = -np.arctan2(vy - lr * r, vx_safe)
    Fzf, Fzr = m * G * lr / (lf + lr), m * G * lf / (lf + lr)
    Fyf, Fyr = magic_formula(alpha_f, Fzf), magic_formula(alpha_r, Fzr, B=12)
    return np.array(
        [
            (Fyf * np.cos(delta) + Fyr) / m - vx * r,
            (lf * Fyf * np.cos(delta) - lr * Fyr) / Iz,
            ax + vy * r - Fyf * np.sin(delta) / m,
        ]
    )


class Mode(Enum):
    IDLE = 0
    CRUISE = 1
    BRAKE = 2


def decide(v, v_ref):
    err = v_ref - v
    if abs(err) < 0.5:
        return Mode.IDLE
    return Mode.CRUISE if err > 0 else Mode.BRAKE


@engineered(2, 1)
def cruise_state_machine(t, x, u, params):
    v, z = x
    mode = decide(v, u[0])
    match mode:
        case Mode.IDLE:
            force = 0.0
        case Mode.CRUISE:
            force = 2.0 * (u[0] - v) + z
        case Mode.BRAKE:
            force = -3.0
        case _:
            raise RuntimeError(f"unknown mode {mode!r}")
    return [force - 0.1 * v, u[0] - v if mode is Mode.CRUISE else 0.0]


@dataclass(frozen=True)
class Atmosphere:
    h_base: tuple = (0.0, 11000.0, 20000.0, 32000.0)
    T_base: tuple = (288.15, 216.65, 216.65, 228.65)
    lapse: tuple = (-0.0065, 0.0, 0.001, 0.0028)
    p_base: tuple = (101325.0, 22632.1, 5474.89, 868.02)
    R: float = 287.053

    def at(self, h):
        h = min(max(h, 0.0), 40000.0)
        i = 0
        while i < 3 and h >= self.h_base[i + 1]:
            i += 1
        dh = h - self.h_base[i]
        T = self.T_base[i] + self.lapse[i] * dh
        if self.lapse[i] != 0:
            p = self.p_base[i] * (T / self.T_base[i]) ** (-G / (self.lapse[i] * self.R))
        else:
            p = self.p_base[i] * math.exp(-G * dh / (self.R * T))
        return T, p, p / (self.R * T)


ATM = Atmosphere()


@engineered(4, 2)
def rocket_through_atmosphere(t, x, u, params):
    h, v, gamma, m = x
    T, p, rho = ATM.at(h)
    a = np.sqrt(1.4 * 287.053 * T)
    mach = v / a
    Cd = np.interp(mach, [0, 0.8, 1.0, 1.2, 2.0, 5.0], [0.2, 0.22, 0.4, 0.45, 0.35, 0.25])
    drag = 0.5 * rho * v**2 * Cd * 0.2
    thrust = max(u[0], 0.0) * (1e4 - 0.05 * p)
    return np.array(
        [
            v * np.sin(gamma),
            (thrust - drag) / m - G * np.sin(gamma),
            -G / v * np.cos(gamma) + u[1],
            -max(u[0], 0) * 3.0,
        ]
    )


ALPHA = np.deg2rad(np.arange(-10, 50, 5.0))


ELEV = np.deg2rad([-25.0, -12.5, 0.0, 12.5, 25.0])


CM = np.add.outer(-0.8 * ALPHA, -1.1 * ELEV) + 0.3 * np.multiply.outer(ALPHA**2, ELEV)


cm_table = RegularGridInterpolator((ALPHA, ELEV), CM, bounds_error=False, fill_value=None)


@engineered(2, 1)
def short_period_with_grid(t, x, u, params):
    alpha, q = x
    delta = np.clip(u[0], -0.4, 0.4)
    cm = cm_table([[alpha, delta]])[0]
    return np.array([q - 1.2 * np.sin(alpha), 8.0 * cm - 0.9 * q])


Vec = namedtuple("Vec", "x y z")


Sat = namedtuple("Sat", ["r", "v"])


@engineered(6, 3)
def orbit_j2(t, x, u, params):
    mu, Re, J2 = 398600.4418, 6378.137, 1.08263e-3
    sat = Sat(Vec(*x[:3]), Vec(*x[3:]))
    r = math.sqrt(sum(c * c for c in sat.r))
    k = 1.5 * J2 * mu * Re**2 / r**5
    z2 = (sat.r.z / r) ** 2
    acc = Vec(
        -mu * sat.r.x / r**3 + k * sat.r.x * (5 * z2 - 1),
        -mu * sat.r.y / r**3 + k * sat.r.y * (5 * z2 - 1),
        -mu * sat.r.z / r**3 + k * sat.r.z * (5 * z2 - 3),
    )
    return list(sat.v) + [a + b for a, b in zip(acc, u)]


@engineered(6, 2)
def restricted_three_body_with_lru(t, x, u, params):
    @cache
    def primaries(mu):
        return np.array([-mu, 0, 0]), np.array([1 - mu, 0, 0])

    mu = 0.01215
    p1, p2 = primaries(mu)
    r, v = x[:3], x[3:]
    d1, d2 = r - p1, r - p2
    g = -(1 - mu) * d1 / norm(d1) ** 3 - mu * d2 / norm(d2) ** 3
    a = g + np.array([2 * v[1] + r[0], -2 * v[0] + r[1], 0.0])
    a[:2] += u
    return np.concatenate([v, a])


class Leg(IntEnum):
    FL = 0
    FR = 1
    RL = 2
    RR = 3


@engineered(4, 4)
def legs_by_intenum(t, x, u, params):
    k = np.full(4, 50.0)
    k[Leg.RL], k[Leg.RR] = 40.0, 40.0
    stance = {leg: x[leg] < 0 for leg in Leg}
    dx = np.empty_like(x)
    for leg, on in stance.items():
        dx[leg] = -k[leg] * x[leg] + u[leg] if on else u[leg] - 1.0
    return dx


@engineered(4, 1, mc=1.0, mp=0.1, l=0.5)
def cartpole_energy_swingup(t, x, u, params):
    mc, mp, l = params["mc"], params["mp"], params["l"]
    th, thd = x[1], x[3]
    E = 0.5 * mp * l**2 * thd**2 - mp * G * l * np.cos(th)
    wrapped = (th + np.pi) % (2 * np.pi) - np.pi
    near = abs(wrapped - np.pi) < 0.3 or abs(wrapped + np.pi) < 0.3
    if near:
        f = -np.array([-1.0, 30.0, -2.0, 6.0]) @ x
    else:
        f = 5.0 * (mp * G * l - E) * thd * np.cos(th)
    f = np.clip(f + u[0], -20, 20)
    M = np.array([[mc + mp, mp * l * np.cos(th)], [mp * l * np.cos(th), mp * l**2]])
    tau = np.array([f + mp * l * thd**2 * np.sin(th), -mp * G * l * np.sin(th)])
    acc = solve(M, tau)
    return np.r_[x[2:], acc]
