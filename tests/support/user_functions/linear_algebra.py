"""Matrices: products, solutions, norms, factorisations, as attributes and as parameters."""

import numpy as np
import scipy.linalg

from ._entry import entry, pieces


def stable(n, seed=0):
    """Return a random well-conditioned matrix."""
    m = np.random.default_rng(seed).normal(size=(n, n)) / np.sqrt(n)
    return m - 3 * np.eye(n)


@entry(discrete=True)
def state_space_by_hand(n):
    A, B = stable(n), np.ones((n, 2))

    def update(t, x, u, params):
        return A @ x + B @ u

    def output(t, x, u, params):
        return A[:1] @ x + u[1]

    return pieces(update, output, states=n)


@entry
def matrices_as_parameters(n):
    def update(t, x, u, params):
        A, B = params["A"], params["B"]
        return A.dot(x) + np.dot(B, u)

    return pieces(update, states=n, A=stable(n), B=np.arange(2.0 * n).reshape(n, 2))


@entry
def quadratic_form(n):
    A = stable(n)

    def output(t, x, u, params):
        return x @ A @ x + x.T @ x

    def update(t, x, u, params):
        return -x * (x @ A @ x) / (1 + x.dot(x))

    return pieces(update, output, states=n)


@entry
def transposed_attribute(n):
    class Model:
        B = np.arange(1.0, 2 * n + 1).reshape(n, 2)

        def update(self, t, x, u, params):
            return self.B @ (self.B.T @ x - u) / n

    return pieces(Model().update, states=n)


@entry
def columns_all_the_way(n):
    """State as a column, as those do who come from MATLAB."""
    A, B = stable(n), np.ones((n, 2))

    def update(t, x, u, params):
        x = x.reshape(-1, 1)
        u = np.array([u]).T
        return A @ x + B @ u

    return pieces(update, states=n)


@entry
def np_matrix_style_products(n):
    A = stable(n)

    def update(t, x, u, params):
        y = np.matmul(A, x[:, np.newaxis])
        return y[:, 0] * np.inner(x, x) / (1 + np.vdot(x, x)) + np.tensordot(A, x, axes=1)

    return pieces(update, states=n)


@entry
def outer_product(n):
    def update(t, x, u, params):
        P = np.outer(x, x) + np.eye(n)
        return P @ x / n - P[0] + np.outer(u, x)[1]

    return pieces(update, states=n)


@entry
def einsum(n):
    A = stable(n)

    def update(t, x, u, params):
        q = np.einsum("i,ij,j->", x, A, x)
        return np.einsum("ij,j->i", A, x) + q * 0.1 + np.einsum("i,i", u, u)

    return pieces(update, states=n)


@entry
def norms(n):
    def update(t, x, u, params):
        r = np.linalg.norm(x) + np.linalg.norm(u, 1) + np.linalg.norm(x, np.inf)
        return -x / (1 + r) + np.linalg.norm(np.outer(u, u)) + np.linalg.norm(x[:2], ord=2)

    return pieces(update, states=n)


@entry
def solve_constant_matrix(n):
    M = stable(n)

    def update(t, x, u, params):
        return np.linalg.solve(M, x - u[0])

    return pieces(update, states=n)


@entry
def solve_state_dependent(n):
    """A mass matrix that depends on the angle, as in robotics."""

    def update(t, x, u, params):
        c = np.cos(x[0] - x[1])
        M = np.array([[params["m"] + 2, c], [c, 2.0]])
        a = np.linalg.solve(M, u - np.array([np.sin(x[0]), x[1]]))
        dx = np.zeros(n)
        dx[:2] = a
        dx[2:] = a[1] * x[2:]
        return dx

    return pieces(update, states=n, m=1.0)


@entry
def inverses(n):
    M = stable(n, 1)

    def update(t, x, u, params):
        J = np.array([[2 + np.sin(x[0]), 0.3], [u[0] * 0.0 + 0.1, 1.5]])
        v = np.linalg.inv(J) @ u
        return np.linalg.inv(M) @ x + v[0] - np.linalg.pinv(np.ones((2, 1)))[0] @ v

    return pieces(update, states=n)


@entry
def determinant_and_trace(n):
    def update(t, x, u, params):
        J = np.array([[u[0], 1.0], [0.5, x[0]]])
        return -x + np.linalg.det(J) + np.trace(J) + J.diagonal().sum()

    return pieces(update, states=n)


@entry
def cross_product_and_rotation(n):
    def update(t, x, u, params):
        w = np.array([u[0], u[1], x[0]])
        c, s = np.cos(x[1]), np.sin(x[1])
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return -x + (R @ np.cross(w, [0.1, 0.2, 0.3]))[0]

    return pieces(update, states=n)


@entry
def eigenvalues_of_a_constant(n):
    M = stable(n)

    def update(t, x, u, params):
        return -x * np.abs(np.linalg.eigvals(M)).max() + u[0]

    return pieces(update, states=n)


@entry
def eigenvalues_of_the_state(n):
    def update(t, x, u, params):
        w = np.linalg.eigvalsh(np.array([[x[0], u[0]], [u[0], x[1]]]))
        return -x + w[0] - 2 * w[1]

    return pieces(update, states=n)


@entry
def cholesky_and_qr(n):
    def update(t, x, u, params):
        L = np.linalg.cholesky(np.eye(n) + np.outer(x, x))
        return L @ np.ones(n) * params["k"]

    return pieces(update, states=n, k=0.4)


@entry
def expm_of_a_constant(n):
    F = scipy.linalg.expm(0.1 * stable(n))

    def update(t, x, u, params):
        return F @ x - scipy.linalg.expm(np.diag([0.1, 0.2]))[0, 0] * u[0]

    return pieces(update, states=n)


@entry
def expm_of_the_input(n):
    def update(t, x, u, params):
        s = np.tanh(u[0])
        return -x + scipy.linalg.expm(np.array([[0, s], [-s, 0]]))[0, 1]

    return pieces(update, states=n)


@entry
def lu_factors(n):
    factors = scipy.linalg.lu_factor(stable(n))

    def update(t, x, u, params):
        return scipy.linalg.lu_solve(factors, x) + u[0]

    return pieces(update, states=n)


@entry
def matrix_power_and_multi_dot(n):
    A = stable(n) / 3

    def update(t, x, u, params):
        return np.linalg.matrix_power(A, 2) @ x + np.linalg.multi_dot([A, A, x]) * u[0]

    return pieces(update, states=n)


@entry
def riccati_step(n):
    """Covariance of an extended Kalman filter kept in the states, where it fits."""
    m = {2: 1, 9: 2, 40: 5}[n]

    def update(t, x, u, params):
        z, P = x[:m], x[m : m + m * m].reshape(m, m)
        C = np.ones((1, m))
        K = P @ C.T / (C @ P @ C.T + params["r"])
        dz = -z + (K @ (u[:1] - C @ z)).ravel()
        dP = P + P.T - K @ C @ P
        return np.concatenate([dz, dP.ravel(), np.zeros(n - m - m * m)])

    return pieces(update, states=n, r=0.5)


@entry
def least_squares(n):
    def update(t, x, u, params):
        a, *_ = np.linalg.lstsq(np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]),
                                np.array([u[0], u[1], x[0]]), rcond=None)  # fmt: skip
        return -x + a[0] + a[1]

    return pieces(update, states=n)


@entry
def network_of_oscillators(n):
    """Kuramoto's model with an adjacency matrix."""
    A = (np.random.default_rng(2).random((n, n)) < 0.4).astype(int)

    def update(t, x, u, params):
        d = x[None, :] - x[:, None]
        return np.linspace(1, 2, n) + params["K"] / n * (A * np.sin(d)).sum(axis=1) + u[0]

    return pieces(update, states=n, K=2.0)


@entry
def laplacian_loop(n):
    L = np.diag(np.full(n, 2)) - np.eye(n, k=1) - np.eye(n, k=-1)

    def update(t, x, u, params):
        dx = np.zeros(n)
        for i in range(n):
            for j in range(n):
                if L[i, j] != 0:
                    dx[i] -= L[i, j] * x[j]
        dx[0] += u[0]
        return dx

    return pieces(update, states=n)


@entry
def matrix_of_states(n):
    """A covariance as a matrix, as in python-control's estimators."""
    m = int(np.sqrt(n))
    A = np.arange(m * m, dtype=float).reshape(m, m) / (m * m) - np.eye(m)

    def update(t, x, u, params):
        P = x[: m * m].reshape(m, m)
        dP = A @ P + P @ A.T + u[0] * np.eye(m) - P @ P
        rest = -x[m * m :]
        return np.hstack([dP.reshape(-1), rest])

    return pieces(update, states=n)


@entry
def assignment_through_another_shape(n):
    """P is a view of x, so that x changes with it."""
    m = int(np.sqrt(n))

    def update(t, x, u, params):
        y = 1.0 * x
        P = y[: m * m].reshape(m, m)
        P[0, 0] = u[0]
        return -y

    return pieces(update, states=n)


@entry
def flat_view_of_a_matrix_that_changes(n):
    m = int(np.sqrt(n))

    def update(t, x, u, params):
        P = np.outer(np.ones(m), np.ones(m)) * u[0]
        flat = P.reshape(-1)
        P[0, 0] = x[0]
        return np.hstack([-flat, -x[m * m :]])

    return pieces(update, states=n)


@entry
def flat_copy_of_a_matrix_that_changes(n):
    m = int(np.sqrt(n))

    def update(t, x, u, params):
        P = x[: m * m].reshape(m, m) * 1.0
        flat = P.flatten()
        P[0, 0] = u[0]
        return np.hstack([-flat + P.ravel(), -x[m * m :]])

    return pieces(update, states=n)
