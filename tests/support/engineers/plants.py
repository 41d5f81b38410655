"""Plants and laws as engineers write them."""

import numpy as np
import scipy.linalg as sl
import scipy.special as sp

from engineers.entry import engineered

M3 = np.array([[2.0, 0.3, 0], [0.3, 1.5, 0.2], [0, 0.2, 1.0]])


@engineered(4)
def reshaped_views(t, x, u, params):
    q, v = x.reshape(2, 2)
    d = np.empty_like(x)
    d[:2] = v
    d[2:] = -q - 0.1 * v
    d[-1] += u[0]
    return d


@engineered(4)
def hstack_split(t, x, u, params):
    q, v = np.split(x, 2)
    return np.hstack((v, -np.sin(q) - 0.1 * v + u))


@engineered(4)
def matrix_layout(t, x, u, params):
    P = x.reshape(2, 2).T
    return (-(P @ P.T) - P + u[0] * np.eye(2)).ravel(order="F")


@engineered(3)
def riccati_like(t, x, u, params):
    P = np.array([[x[0], x[1]], [x[1], x[2]]])
    A = np.array([[0, 1.0], [-1, -0.5]])
    D = A @ P + P @ A.T - P @ P + np.eye(2) * (1 + u[0])
    return D[np.triu_indices(2)]


@engineered(4)
def quaternion_rate(t, x, u, params):
    w = np.array([u[0], 0.1, -0.2])
    W = np.array(
        [
            [0, -w[0], -w[1], -w[2]],
            [w[0], 0, w[2], -w[1]],
            [w[1], -w[2], 0, w[0]],
            [w[2], w[1], -w[0], 0],
        ]
    )
    return 0.5 * W @ x


@engineered(6)
def two_body(t, x, u, params):
    r, v = x[:3], x[3:]
    return np.concatenate([v, -r / (1 + np.linalg.norm(r) ** 3) + np.array([0, 0, u[0]])])


@engineered(4)
def double_pendulum(t, x, u, params):
    a, b, w, z = x
    d = a - b
    M = np.array([[2, np.cos(d)], [np.cos(d), 1]])
    F = np.array(
        [-z * z * np.sin(d) - 2 * 9.81 * np.sin(a) + u[0], w * w * np.sin(d) - 9.81 * np.sin(b)]
    )
    return np.r_[w, z, np.linalg.solve(M, F)]


@engineered(4)
def cart_pole(t, x, u, params):
    _, th, v, w = x
    s, c = np.sin(th), np.cos(th)
    a = (u[0] + w**2 * s - 9.81 * s * c) / (1.1 - c**2)
    return np.array([v, w, a, (9.81 * s - a * c)])


@engineered(3)
def lorenz_named(t, x, u, params):
    s, r, b = (params.get(k, d) for k, d in (("s", 10.0), ("r", 28.0), ("b", 8 / 3)))
    return [s * (x[1] - x[0]), x[0] * (r - x[2]) - x[1] + u[0], x[0] * x[1] - b * x[2]]


@engineered(2)
def deadband_numpy(t, x, u, params):
    return [x[1], -np.sign(x[0]) * np.maximum(np.abs(x[0]) - 0.2, 0) - x[1] + u[0]]


@engineered(2)
def nan_guard(t, x, u, params):
    return np.nan_to_num([x[1], -x[0] / x[1] if x[1] != 0 else 0.0], nan=0.0) + u[0]


@engineered(2)
def ndim_zero(t, x, u, params):
    return np.array([x[1], (-np.float64(2) * x[0]).item() + np.squeeze(u)])


@engineered(3)
def select_by_index(t, x, u, params):
    return -x * np.array([1.0, 2.0, 3.0])[np.arange(3)] + np.eye(3)[0] * u[0]


@engineered(2)
def smooth_abs(t, x, u, params):
    return [
        x[1],
        -np.sqrt(x[0] ** 2 + 1e-3) - np.log1p(np.exp(x[1])) - np.expm1(0.1 * x[0]) + np.cbrt(u[0]),
    ]


@engineered(3)
def window_max(t, x, u, params):
    return -np.array([max(x[max(0, i - 1) : i + 2]) for i in range(3)]) + u[0]


@engineered(2)
def integer_states(t, x, u, params):
    n = int(x[0])
    return [x[1], -float(n) - 0.1 * (n % 3) - x[1] + u[0]]


@engineered(2)
def sp_more(t, x, u, params):
    losses = sp.huber(1.0, x[1]) - sp.ndtr(x[0]) + sp.pseudo_huber(0.5, x[1])
    powers = sp.cbrt(x[0]) + sp.exp10(-(x[1] ** 2)) + sp.log1p(x[1] ** 2)
    return [x[1], -sp.erfc(x[0]) - powers + losses + u[0]]


@engineered(3)
def triangles(t, x, u, params):
    lower = np.tril(M3)
    both = sl.solve_triangular(lower, x, lower=True) + sl.solve_triangular(lower.T, x)
    return -both + sl.solve_triangular(M3, x, unit_diagonal=True, trans="T") * 0.1 + u[0]


@engineered(3)
def lambda_defaults(t, x, u, params):
    fs = [lambda v, k=k: -k * v for k in (1.0, 2.0, 3.0)]
    return [g(v) + u[0] for g, v in zip(fs, x)]


@engineered(3)
def sorted_reverse(t, x, u, params):
    return [-v for v in sorted(x, reverse=True)]


@engineered(4)
def einsum_blocks(t, x, u, params):
    X = x.reshape(2, 2)
    return -np.einsum("ik,jk->ij", X, X).ravel() * 0.1 - x + u[0]


@engineered(2)
def where_two_outputs(t, x, u, params):
    sat = np.clip(-5 * x[0], -1, 1)
    aw = np.where(np.abs(5 * x[0]) > 1, 0.0, 1.0)
    return [x[1], sat - aw * x[1] + u[0]]
