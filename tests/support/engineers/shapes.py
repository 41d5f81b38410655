"""Arrays that are cut, stacked, turned and padded."""

import numpy as np

from engineers.entry import engineered


@engineered(12, kappa=0.3)
def heat_by_diff(t, x, u, params):
    flux = -params["kappa"] * np.diff(x, prepend=u[0], append=0.0)
    return -np.diff(flux)


@engineered(12, 0, c=1.5)
def ring_by_roll(t, x, u, params):
    return -params["c"] * (x - np.roll(x, 1))


@engineered(20, 0, nu=0.05)
def burgers_by_roll(t, x, u, params):
    left, right = np.roll(x, 1), np.roll(x, -1)
    return -x * (right - left) / 2 + params["nu"] * (right - 2 * x + left)


@engineered(10)
def wall_by_pad(t, x, u, params):
    padded = np.pad(x, 1, mode="edge")
    return padded[2:] - 2 * padded[1:-1] + padded[:-2] + u[0]


@engineered(6)
def zero_padded(t, x, u, params):
    full = np.pad(x, (1, 1))
    return full[:-2] - 2 * x + full[2:]


@engineered(6, 3)
def split_in_half(t, x, u, params):
    q, v = np.split(x, 2)
    return np.concatenate([v, -q - 0.1 * v + u])


@engineered(6)
def array_split_in_three(t, x, u, params):
    a, b, c = np.array_split(x, 3)
    return np.hstack((b - a, c - b, u[0] - c))


@engineered(4, 2)
def stacked_rows(t, x, u, params):
    rows = np.stack([x[:2], x[2:]])
    return (rows @ u).tolist() + [x[0] - x[1], x[3]]


@engineered(4)
def vstacked(t, x, u, params):
    both = np.vstack((x[:2], x[2:]))
    return (both.T @ both).ravel() * -0.1 + u[0]


@engineered(4)
def columns(t, x, u, params):
    m = np.column_stack((x[:2], x[2:]))
    return np.concatenate((m[0], -m[1]))


@engineered(3, 2)
def row_by_r(t, x, u, params):
    return np.r_[x[1:], -x[0] + u[0] * u[1]]


@engineered(4)
def column_by_c(t, x, u, params):
    m = np.c_[x[:2], x[2:]]
    return (-m).flatten()


@engineered(4, 2)
def blocks_of_a_matrix(t, x, u, params):
    i2, z2 = np.eye(2), np.zeros((2, 2))
    k = np.array([[2.0, -1.0], [-1.0, 2.0]])
    a = np.block([[z2, i2], [-k, -0.1 * i2]])
    return a @ x + np.block([np.zeros(2), u])


@engineered(4, 2)
def blocks_with_states(t, x, u, params):
    r = np.array([[np.cos(x[0]), -np.sin(x[0])], [np.sin(x[0]), np.cos(x[0])]])
    big = np.block([[r, np.zeros((2, 2))], [np.zeros((2, 2)), np.eye(2)]])
    return big @ -x + np.r_[u, u]


@engineered(5)
def flipped(t, x, u, params):
    return x[::-1] - 2 * np.flip(x) + np.flipud(x) * u[0]


@engineered(4)
def tiled(t, x, u, params):
    return np.tile(x[:2], 2) - x + np.repeat(u[0], 4)


@engineered(6)
def repeated(t, x, u, params):
    return np.repeat(x[:3], 2) - x


@engineered(6)
def reshaped_to_a_matrix(t, x, u, params):
    m = x.reshape(2, 3)
    return (m * m.mean(axis=1, keepdims=True)).ravel() - x


@engineered(6)
def transposed(t, x, u, params):
    return -np.transpose(x.reshape(3, 2)).reshape(-1) + u[0]


@engineered(4)
def swapped_axes(t, x, u, params):
    return np.swapaxes(np.reshape(x, (2, 2)), 0, 1).flatten() - x


@engineered(4)
def taken_in_another_order(t, x, u, params):
    return np.take(x, [2, 3, 0, 1]) - x * u[0]


@engineered(4)
def picked_by_a_list(t, x, u, params):
    order = [1, 0, 3, 2]
    return x[order] - x


@engineered(4)
def written_by_a_list(t, x, u, params):
    dx = np.zeros(4)
    dx[[0, 2]] = x[[1, 3]]
    dx[[1, 3]] = -x[[0, 2]] + u[0]
    return dx


@engineered(9, 0)
def outer_products_of_axes(t, x, u, params):
    m = x.reshape(3, 3)
    return (m - m[:, np.newaxis, 0] + m[None, 0, :]).ravel() * -0.1


@engineered(5)
def empty_like_and_filled(t, x, u, params):
    dx = np.empty_like(x)
    dx[0] = u[0] - x[0]
    dx[1:] = x[:-1] - x[1:]
    return dx


@engineered(4)
def diagonal_gains(t, x, u, params):
    return np.diag([-1.0, -2.0, -3.0, -4.0]) @ x + np.full(4, u[0])


@engineered(4)
def diagonal_of_states(t, x, u, params):
    return np.diag(x[:2]) @ x[2:] @ np.ones((2, 4)) - x


@engineered(4)
def lower_triangle(t, x, u, params):
    m = np.tril(np.outer(x, x))
    return -m.sum(axis=1) + u[0]


@engineered(3)
def meshes(t, x, u, params):
    a, b = np.meshgrid(x, x)
    return (a - b).sum(axis=0) * 0.1 - x


@engineered(3)
def inserted(t, x, u, params):
    y = np.insert(x, 0, u[0])
    return y[:-1] - np.delete(y, 0)


@engineered(7, kappa=0.1)
def gradients(t, x, u, params):
    return -params["kappa"] * np.gradient(x, 0.5) + u[0]


@engineered(6)
def moving_average(t, x, u, params):
    return np.convolve(x, np.ones(3) / 3, mode="same") - x


@engineered(4, 2)
def input_as_a_column(t, x, u, params):
    b = np.array([[0, 0], [1, 0], [0, 0], [0, 1]])
    return (b @ u.reshape(-1, 1)).squeeze() - np.atleast_2d(x)[0]


@engineered(8, 0)
def batches_of_pairs(t, x, u, params):
    pairs = x.reshape(-1, 2)
    dx = np.zeros_like(pairs)
    dx[:, 0] = pairs[:, 1]
    dx[:, 1] = -np.sin(pairs[:, 0])
    return dx.ravel()


@engineered(10, 0, k=2.0)
def chain_of_masses(t, x, u, params):
    q, v = x[:5], x[5:]
    stretch = np.diff(np.concatenate(([0.0], q, [0.0])))
    return np.append(v, params["k"] * np.diff(stretch))
