"""Whole models, as they are found in notebooks and course work."""

import numpy as np

from engineers.entry import engineered


@engineered(4, 1, M=1.0, m=0.2, l=0.5, g=9.81)
def cart_and_pole(t, x, u, params):
    M, m, l, g = (params.get(k, 1.0) for k in ["M", "m", "l", "g"])
    s, c = np.sin(x[2]), np.cos(x[2])
    D = np.array([[M + m, m * l * c], [c, l]])
    rhs = np.array([u[0] + m * l * x[3] ** 2 * s, g * s])
    acc = np.linalg.inv(D).dot(rhs)
    return np.array([x[1], acc[0], x[3], acc[1]])


@engineered(12, 4, m=0.5)
def quadrotor(t, x, u, params):
    pos, vel, ang, rate = np.split(x, 4)
    phi, theta, psi = ang
    cphi, sphi, cth, sth = np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta)
    rz = np.array([[np.cos(psi), -np.sin(psi), 0], [np.sin(psi), np.cos(psi), 0], [0, 0, 1]])
    ry = np.array([[cth, 0, sth], [0, 1, 0], [-sth, 0, cth]])
    rx = np.array([[1, 0, 0], [0, cphi, -sphi], [0, sphi, cphi]])
    thrust = rz @ ry @ rx @ np.array([0.0, 0.0, u.sum()])
    acc = np.array([0, 0, -9.81]) + thrust / params["m"]
    w = np.array([[1, 0, -sth], [0, cphi, cth * sphi], [0, -sphi, cth * cphi]])
    inertia = np.diag([0.01, 0.01, 0.02])
    torque = np.array([u[1] - u[3], u[2] - u[0], u[0] - u[1] + u[2] - u[3]]) * 0.1
    drate = np.linalg.solve(inertia, torque - np.cross(rate, inertia @ rate))
    return np.concatenate([vel, acc, np.linalg.solve(w + 0.01 * np.eye(3), rate), drate])


@engineered(3)
def vehicle_with_tyres(t, x, u, params):
    vx, m, iz, a, b = 15.0, 1200.0, 1800.0, 1.2, 1.4
    alpha = np.array([u[0] - (x[0] + a * x[1]) / vx, -(x[0] - b * x[1]) / vx])
    B, C, D, E = 10.0, 1.9, 5000.0, 0.97
    fy = D * np.sin(C * np.arctan(B * alpha - E * (B * alpha - np.arctan(B * alpha))))
    return np.array([fy.sum() / m - vx * x[1], np.dot([a, -b], fy) / iz, x[1]])


@engineered(4)
def reactor(t, x, u, params):
    ca, cb, temp, jacket = x
    k = np.array([1.287, 1.287, 0.9043]) * np.exp(-np.array([9.7583, 9.7583, 8.56]) / (1 + temp**2))
    dca = u[0] * (5.1 - ca) - k[0] * ca - k[2] * ca**2
    dcb = -u[0] * cb + k[0] * ca - k[1] * cb
    heat = np.array([4.2, -11.0, -41.85]) @ (k * np.array([ca, cb, ca**2]))
    return [dca, dcb, -heat * 0.1 + jacket - temp, temp - jacket]


@engineered(15, 0)
def reaction_and_diffusion(t, x, u, params):
    c = x.reshape(3, 5)
    lap = np.zeros_like(c)
    lap[:, 1:-1] = c[:, 2:] - 2 * c[:, 1:-1] + c[:, :-2]
    lap[:, 0], lap[:, -1] = c[:, 1] - c[:, 0], c[:, -2] - c[:, -1]
    rate = 0.5 * c[0] * c[1]
    return (0.1 * lap + np.vstack([-rate, -rate, rate])).ravel()


@engineered(8)
def neural_network(t, x, u, params):
    w1, w2 = np.linspace(-1, 1, 48).reshape(6, 8), np.linspace(1, -1, 48).reshape(8, 6)
    hidden = np.tanh(w1 @ x + 0.1)
    return w2 @ hidden - x + u[0]


@engineered(6, 0)
def three_bodies(t, x, u, params):
    p = x.reshape(3, 2)
    acc = np.zeros((3, 2))
    for i in range(3):
        for j in range(3):
            if i != j:
                d = p[j] - p[i]
                acc[i] += d / (np.linalg.norm(d) ** 2 + 0.1) ** 1.5
    return acc.flatten()


@engineered(4, 1)
def observer_and_controller(t, x, u, params):
    A, B = np.array([[0, 1], [-1, -0.2]]), np.array([[0], [1]])
    K, L = np.array([[3.0, 2.0]]), np.array([[2.0], [1.0]])
    xp, xe = x[:2].reshape(2, 1), x[2:].reshape(2, 1)
    v = np.clip(-K @ xe + u[0], -1, 1)
    dxp = A @ xp + B @ v
    dxe = A @ xe + B @ v + L @ (xp[0] - xe[0]).reshape(1, 1)
    return np.vstack((dxp, dxe)).flatten()
