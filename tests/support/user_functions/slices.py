"""Parts of arrays: slices of all kinds, negative indices, masks, views of long and short arrays."""

import numpy as np

from ._entry import entry, pieces


@entry(discrete=True)
def last_state_by_negative_index(n):
    def update(t, x, u, params):
        dx = -x
        dx[-1] = u[0]
        return dx

    return pieces(update, states=n)


@entry(discrete=True)
def heat_equation(n):
    def update(t, x, u, params):
        k = params["k"]
        dx = np.zeros(n)
        dx[0] = k * (u[0] - 2 * x[0] + x[1])
        dx[1:-1] = x[2:] - 2 * x[1:-1] + x[:-2]
        dx[-1] = x[-2] - x[-1]
        return dx

    return pieces(update, states=n, k=1.3)


@entry
def small_slice_is_a_view(n):
    def update(t, x, u, params):
        dx = -x
        v = dx[:3]
        v[0] = 5
        v[-1] += u[0]
        return dx

    return pieces(update, states=n)


@entry
def view_sees_later_writes(n):
    def update(t, x, u, params):
        dx = -x
        v = dx[1:4]
        dx[1] = 1.0 + u[1]
        return dx * v.sum()

    return pieces(update, states=n)


@entry
def negative_index_everywhere(n):
    def update(t, x, u, params):
        dx = np.empty_like(x)
        for i in range(len(x)):
            dx[i] = x[i - 1] - x[i] + x[-i - 1]
        return dx

    return pieces(update, states=n)


@entry(discrete=True)
def every_second(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        dx[::2] = -x[::2] * u[0]
        dx[1::2] = x[1::2] + u[1]
        return dx

    return pieces(update, states=n)


@entry
def reversed_slice(n):
    def update(t, x, u, params):
        dx = x[::-1] * params["a"]
        dx[::-1][0] = u[0]
        return dx

    return pieces(update, states=n, a=0.7)


@entry
def backwards_with_bounds(n):
    def update(t, x, u, params):
        dx = x.copy()
        part = x[-1:0:-1]
        dx[: part.size] = part
        dx[-2::-2] *= u[0]
        return dx

    return pieces(update, states=n)


@entry
def empty_slices(n):
    def update(t, x, u, params):
        dx = -x
        dx[5:3] = 7.0
        dx[n:] = u[0]
        return dx + np.sum(x[n:]) + x[100:].size

    return pieces(update, states=n)


@entry
def slices_beyond_the_end(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        dx[n - 1 : 1000] = x[-1000:1].sum()
        dx[:1] = u[0]
        return dx

    return pieces(update, states=n)


@entry
def slice_objects(n):
    half = slice(0, n // 2)
    rest = slice(n // 2, None)

    def update(t, x, u, params):
        dx = np.zeros(n)
        dx[half] = -x[half] * u[0]
        dx[rest] = np.sin(x[rest])
        return dx

    return pieces(update, states=n)


@entry
def ellipsis_and_newaxis(n):
    def update(t, x, u, params):
        column = x[:, None]
        row = x[np.newaxis, ...]
        dx = x[...] - (column * row).sum(axis=0) / n
        dx[...] = dx * u[0]
        return dx

    return pieces(update, states=n)


@entry
def boolean_mask(n):
    def update(t, x, u, params):
        dx = -x
        dx[x > 0] = u[0]
        return dx

    return pieces(update, states=n)


@entry
def boolean_mask_read(n):
    def update(t, x, u, params):
        positive = x[x > 0.2]
        return -x + positive.sum() + positive.size

    return pieces(update, states=n)


@entry
def mask_with_array_value(n):
    def update(t, x, u, params):
        dx = x * 2
        low = (x < 0) | (x > params["high"])
        dx[low] = (x * u[1])[low]
        dx[~low] -= 1
        return dx

    return pieces(update, states=n, high=0.8)


@entry
def list_of_indices(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        dx[[0, -1]] = x[[-1, 0]]
        dx[[0, 1]] += u
        return dx

    return pieces(update, states=n)


@entry
def fancy_index_is_a_copy(n):
    def update(t, x, u, params):
        dx = -x
        part = dx[[0, 1]]
        part[0] = 99.0
        return dx + part.sum()

    return pieces(update, states=n)


@entry
def repeated_fancy_add(n):
    """NumPy adds once where an index comes twice; np.add.at adds twice."""

    def update(t, x, u, params):
        dx = x * 1.0
        dx[[0, 0, 1]] += u[0]
        np.add.at(dx, [0, 0], u[1])
        return dx

    return pieces(update, states=n)


@entry
def permutation(n):
    order = np.random.default_rng(0).permutation(n)

    def update(t, x, u, params):
        dx = np.empty(n)
        dx[order] = x
        return dx - x[order] * u[0]

    return pieces(update, states=n)


@entry
def np_take_and_put(n):
    def update(t, x, u, params):
        dx = np.take(x, [1, 0, -1]).sum() - x
        np.put(dx, [0], u[0])
        return dx

    return pieces(update, states=n)


@entry
def unpacked_states(n):
    def update(t, x, u, params):
        first, *rest = x
        *front, last = x
        return np.array([last * u[0]] + [-r for r in rest]) + len(front) * first

    return pieces(update, states=n)


@entry
def slice_of_slice(n):
    def update(t, x, u, params):
        dx = np.ones(n)
        dx[1:][:-1][::2] = x[1:][:-1][::2] * u[0]
        inner = dx[0:n][-2:]
        inner[:] = x[:2]
        return dx

    return pieces(update, states=n)


@entry
def row_of_matrix_is_a_view(n):
    def update(t, x, u, params):
        m = np.outer(x, u)
        row = m[0]
        row += 1
        m[1, :] *= row
        return m[:, 0] - m[:, 1]

    return pieces(update, states=n)


@entry
def matrix_blocks(n):
    def update(t, x, u, params):
        m = np.zeros((n, n))
        m[:2, :2] = [[0.0, u[0]], [-u[1], 0.5]]
        m[-1, -1] = x[0]
        m[0, 1:] += 0.1
        return m @ x

    return pieces(update, states=n)


@entry
def diagonal_is_assigned(n):
    def update(t, x, u, params):
        m = np.zeros((n, n))
        i = np.arange(n)
        m[i, i] = -x
        m[i[:-1], i[1:]] = u[0]
        return m.dot(np.ones(n))

    return pieces(update, states=n)


@entry
def swap_by_slices(n):
    """Both sides overlap: NumPy reads before it writes."""

    def update(t, x, u, params):
        dx = x * u[0]
        dx[1:] = dx[:-1]
        dx[0], dx[-1] = dx[-1], dx[0]
        return dx

    return pieces(update, states=n)


@entry
def overlapping_in_place(n):
    def update(t, x, u, params):
        dx = x + u[1]
        dx[1:] += dx[:-1]
        dx[:-1] -= dx[1:]
        return dx

    return pieces(update, states=n)


@entry
def swapped_views(n):
    """a, b = b, a of views copies nothing: both end up equal."""

    def update(t, x, u, params):
        dx = np.array([x, 2 * x])
        dx[0], dx[1] = dx[1], dx[0]
        return dx[0] - 3 * dx[1] * u[0]

    return pieces(update, states=n)


@entry
def index_from_parameter(n):
    def update(t, x, u, params):
        dx = -x
        dx[params["place"]] = u[0]
        return dx

    return pieces(update, states=n, place=-1)


@entry
def index_from_the_state(n):
    def update(t, x, u, params):
        i = int(abs(x[0])) % n
        dx = -x
        dx[i] = u[0] + x[-i]
        return dx

    return pieces(update, states=n)


@entry
def index_of_largest(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        dx[np.argmax(x)] = -x[np.argmin(x)]
        return dx

    return pieces(update, states=n)


@entry
def two_inputs_by_slice(n):
    def output(t, x, u, params):
        first, second = u[:n], u[n:]
        y = first - second
        y[-1] = u[-1]
        return y

    return pieces(None, output, inputs=2 * n, outputs=n)
