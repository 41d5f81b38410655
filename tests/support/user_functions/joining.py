"""Arrays put together and taken apart: columns, rows, blocks, axes."""

import itertools

import numpy as np

from ._entry import entry, pieces


@entry
def hstack_of_vectors(n):
    def update(t, x, u, params):
        return np.hstack((u[0], x[:-1])) - np.hstack([x[1:], [u[1]]])

    return pieces(update, states=n)


@entry
def hstack_of_columns(n):
    def update(t, x, u, params):
        a = x.reshape(-1, 1)
        m = np.hstack([a, 2 * a])
        return m @ u + m[-1, 0]

    return pieces(update, states=n)


@entry
def vstack_of_rows(n):
    def update(t, x, u, params):
        m = np.vstack((x, x[::-1], np.ones(n)))
        return m[0] * m[1] + m[2] * u[0] + m.shape[0]

    return pieces(update, states=n)


@entry
def vstack_of_columns(n):
    def update(t, x, u, params):
        col = x[:, None]
        return np.vstack((col[1:], [[u[0]]]))

    return pieces(update, states=n)


@entry
def column_stack(n):
    def update(t, x, u, params):
        m = np.column_stack([x, np.sin(x)])
        return m @ u + m[:, 1]

    return pieces(update, states=n)


@entry
def block_matrix(n):
    def update(t, x, u, params):
        m = np.block([[np.zeros((1, 1)), x[None, 1:]], [-x[1:, None], np.eye(n - 1)]])
        return m @ x * u[0]

    return pieces(update, states=n)


@entry
def concatenate_along_axes(n):
    def update(t, x, u, params):
        a, b = x[None, :], u[0] * x[None, :]
        rows = np.concatenate([a, b], axis=0)
        long = np.concatenate([a, b], axis=1)
        flat = np.concatenate([a, b], axis=None)
        return rows[1] - long[0, :n] + flat[n:] * 2

    return pieces(update, states=n)


@entry
def concatenate_tuple(n):
    def update(t, x, u, params):
        return np.concatenate((x[1:], [-x[0] + u[0]]))

    return pieces(update, states=n)


@entry
def append_and_insert(n):
    def update(t, x, u, params):
        longer = np.insert(x, 1, u[0])
        return np.append(np.delete(longer, 0)[:-1], u[1])

    return pieces(update, states=n)


@entry
def stack_and_split(n):
    def update(t, x, u, params):
        m = np.stack([x, -x], axis=1)
        left, right = np.split(m, 2, axis=1)
        a, b = np.array_split(x, 2)
        return (left - 2 * right).ravel() + a[0] * b[-1]

    return pieces(update, states=n)


@entry
def r_and_c(n):
    def update(t, x, u, params):
        m = np.c_[x, x**2]
        return np.r_[x[1:], u[0]] + m[:, 1]

    return pieces(update, states=n)


@entry
def tile_and_repeat(n):
    def update(t, x, u, params):
        return np.tile(u, n)[:n] - np.repeat(u[0], n) + np.repeat(u, n)[-n:] * x

    return pieces(update, states=n)


@entry
def roll_and_flip(n):
    def update(t, x, u, params):
        return np.roll(x, 1) - 2 * x + np.roll(x, -1) + np.flip(x) * u[0]

    return pieces(update, states=n)


@entry
def pad(n):
    def update(t, x, u, params):
        p = np.pad(x, 1)
        q = np.pad(x, (1, 1), mode="edge")
        return p[2:] - 2 * p[1:-1] + p[:-2] + q[2:]

    return pieces(update, states=n)


@entry
def squeeze_and_atleast(n):
    def update(t, x, u, params):
        col = np.atleast_2d(x).T
        y = np.squeeze(col)
        return y * np.atleast_1d(u[0]) + np.atleast_1d(u)[1]

    return pieces(update, states=n)


@entry
def expand_and_broadcast(n):
    def update(t, x, u, params):
        m = np.broadcast_to(x, (3, n)) * np.expand_dims(np.arange(3.0), 1)
        return m.sum(axis=0) - np.expand_dims(u, 0)[0, 1]

    return pieces(update, states=n)


@entry
def meshgrid_of_states(n):
    def update(t, x, u, params):
        a, b = np.meshgrid(x, x)
        return (a - b).sum(axis=0) * params["k"]

    return pieces(update, states=n, k=0.3)


@entry
def chained_lists(n):
    def update(t, x, u, params):
        return list(itertools.chain(x[1:], [u[0]]))

    return pieces(update, states=n)


@entry
def two_halves(n):
    """Positions and velocities side by side, an odd number as well."""
    m = n // 2

    def update(t, x, u, params):
        q, v, rest = x[:m], x[m : 2 * m], x[2 * m :]
        a = -params["k"] * q - 0.1 * v
        a[0] += u[0]
        return np.concatenate([v, a, -rest])

    return pieces(update, states=n, k=4.0)


@entry
def matrix_state(n):
    """A matrix of states, reshaped there and back, column by column."""
    rows = {2: 1, 9: 3, 40: 5}[n]

    def update(t, x, u, params):
        m = x.reshape((rows, -1))
        f = x.reshape((rows, -1), order="F")
        d = m - f
        d[0, -1] = u[0]
        return d.flatten(order="F")

    return pieces(update, states=n)


@entry
def resized_views(n):
    def update(t, x, u, params):
        e = np.eye(n)[0] * u[0]
        return np.diag(np.diag(x)) + np.tril(np.ones((n, n))) @ x + e + np.triu(np.outer(x, x))[0]

    return pieces(update, states=n)


@entry
def matrix_power_of_blocks(n):
    def update(t, x, u, params):
        m = np.kron(np.eye(2), np.array([[0, 1], [-1, u[0]]]))
        return x + (m @ np.ones(4))[1] * m.trace()

    return pieces(update, states=n)
