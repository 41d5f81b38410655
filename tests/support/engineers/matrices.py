"""Linear algebra of small matrices."""

import numpy as np
import numpy.linalg as la
from numpy.linalg import norm
from scipy import linalg

from engineers.entry import engineered

M = np.array([[2.0, 0.3, 0.0], [0.3, 1.5, 0.1], [0.0, 0.1, 1.0]])


@engineered(4, 2, m1=1.0, m2=0.8, l1=1.0, l2=0.7)
def two_link_arm(t, x, u, params):
    m1, m2, l1, l2 = (params[k] for k in ("m1", "m2", "l1", "l2"))
    q, dq = x[:2], x[2:]
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    mass = np.array(
        [
            [m1 * l1**2 + m2 * (l1**2 + 2 * l1 * l2 * c2 + l2**2), m2 * (l1 * l2 * c2 + l2**2)],
            [m2 * (l1 * l2 * c2 + l2**2), m2 * l2**2],
        ]
    )
    h = -m2 * l1 * l2 * s2
    coriolis = np.array([h * (2 * dq[0] * dq[1] + dq[1] ** 2), -h * dq[0] ** 2])
    g = 9.81 * np.array(
        [(m1 + m2) * l1 * np.cos(q[0]) + m2 * l2 * np.cos(q.sum()), m2 * l2 * np.cos(q.sum())]
    )
    ddq = np.linalg.solve(mass, u - coriolis - g)
    return np.concatenate([dq, ddq])


@engineered(3)
def mass_matrix_solve(t, x, u, params):
    return np.linalg.solve(M, u[0] - x)


@engineered(6, 3)
def mass_matrix_inverse(t, x, u, params):
    q, v = x[:3], x[3:]
    return np.hstack((v, la.inv(M + np.diag(q**2)) @ (u - v)))


@engineered(3)
def direction(t, x, u, params):
    return -x / (np.linalg.norm(x) + 1e-3) + u[0]


@engineered(3)
def norms(t, x, u, params):
    return -x * (norm(x, 1) + norm(x, np.inf)) + norm(x, 2)


@engineered(4)
def frobenius(t, x, u, params):
    return -x / (1 + la.norm(x.reshape(2, 2), "fro"))


@engineered(4)
def determinants(t, x, u, params):
    return -x + 0.1 * np.linalg.det(x.reshape(2, 2))


@engineered(3)
def determinant_of_three(t, x, u, params):
    return -x * np.linalg.det(M + np.diag(x))


@engineered(6, 3)
def rigid_body(t, x, u, params):
    inertia = np.diag([1.0, 2.0, 3.0])
    w, h = x[:3], x[3:]
    dw = np.linalg.inv(inertia) @ (u - np.cross(w, inertia @ w))
    return np.concatenate((dw, np.cross(h, w)))


@engineered(4)
def matrix_of_outer_products(t, x, u, params):
    p = np.outer(x, x) + np.eye(4)
    return -p @ x * 0.01 + u[0]


@engineered(4)
def kronecker(t, x, u, params):
    return np.kron(np.eye(2), np.array([[0.0, 1.0], [-1.0, -0.2]])) @ x + u[0]


@engineered(4)
def kronecker_of_states(t, x, u, params):
    return np.kron(x[:2], x[2:]) * -0.1


@engineered(3, 3)
def quadratic_form_by_einsum(t, x, u, params):
    v = np.einsum("i,ij,j", x, M, x)
    return -v * x + u


@engineered(4)
def matrix_product_by_einsum(t, x, u, params):
    p = x.reshape(2, 2)
    return np.einsum("ij,kj->ik", p, p).ravel() * -0.1 + u[0]


@engineered(3)
def skew(t, x, u, params):
    s = np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])
    return s @ s @ x * 0.1 + u[0]


@engineered(9, 3)
def rotation_matrix(t, x, u, params):
    def hat(w):
        return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])

    r = x.reshape((3, 3))
    return (r @ hat(u)).reshape(9)


@engineered(5, 1)
def riccati_on_line(t, x, u, params):
    a, b = np.array([[0.0, 1.0], [-1.0, -0.5]]), np.array([[0.0], [1.0]])
    p = np.array([[x[2], x[3]], [x[3], x[4]]])
    dp = a.T @ p + p @ a - p @ b @ b.T @ p + np.eye(2)
    dx = (a - b @ b.T @ p) @ x[:2] + (b * u[0]).ravel()
    return np.r_[dx, dp[0, 0], dp[0, 1], dp[1, 1]]


@engineered(6, 1)
def kalman_bucy(t, x, u, params):
    a, c = np.array([[0.0, 1.0], [-2.0, -0.3]]), np.array([[1.0, 0.0]])
    est, p = x[:2], x[2:].reshape(2, 2)
    k = p @ c.T @ np.linalg.inv(np.array([[0.1]]))
    dest = a @ est + k @ (u - c @ est)
    dp = a @ p + p @ a.T + 0.1 * np.eye(2) - k @ c @ p
    return np.concatenate([dest, dp.flatten()])


@engineered(3)
def traces(t, x, u, params):
    return -x * np.trace(np.outer(x, x) + M) * 0.1


@engineered(3)
def dots(t, x, u, params):
    return -x * np.dot(x, M @ x) + np.vdot(x, x) * 0.01 + np.inner(x, [1.0, 2.0, 3.0])


@engineered(4)
def multi_dot(t, x, u, params):
    a = np.arange(16.0).reshape(4, 4) / 16
    return -np.linalg.multi_dot([a.T, a, x]) + u[0]


@engineered(4)
def matrix_power(t, x, u, params):
    a = np.array([[0.0, 1.0], [-1.0, 0.0]])
    return np.r_[np.linalg.matrix_power(a, 3) @ x[:2], -x[2:]]


@engineered(3)
def tensordots(t, x, u, params):
    return np.tensordot(M, x, axes=1) * -1 + np.tensordot(x, x, 1)


@engineered(3, 2)
def least_squares(t, x, u, params):
    a = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    allocated = np.linalg.pinv(a) @ u
    return allocated - x


@engineered(3)
def cholesky_of_a_mass_matrix(t, x, u, params):
    c = np.linalg.cholesky(M + np.diag(x**2))
    return -np.linalg.solve(c, x)


@engineered(3)
def scipy_solve(t, x, u, params):
    return linalg.solve(M + 0.1 * np.outer(x, x), -x) + u[0]


@engineered(4)
def solve_for_a_matrix(t, x, u, params):
    m = np.array([[2.0 + x[0] ** 2, 0.1], [0.1, 1.0]])
    return -np.linalg.solve(m, x.reshape(2, 2)).ravel()


@engineered(6, 0)
def gravity_of_bodies(t, x, u, params):
    r, v = x[:3], x[3:]
    return np.r_[v, -r / np.linalg.norm(r + 0.1) ** 3]


@engineered(8, 0)
def pairwise_distances(t, x, u, params):
    p = x.reshape(4, 2)
    d = p[:, None, :] - p[None, :, :]
    far = np.sqrt((d**2).sum(axis=-1) + 0.1)
    return -(d / far[..., None]).sum(axis=1).ravel()


@engineered(4)
def eigenvalues(t, x, u, params):
    s = np.array([[x[0], x[1]], [x[1], x[2]]])
    return -x * 0.1 + np.linalg.eigvalsh(s)[-1]
