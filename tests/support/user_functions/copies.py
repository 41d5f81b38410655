"""Copies and views, aliases, changes in place."""

import copy

import numpy as np

from ._entry import entry, pieces


@entry
def flatten_is_a_copy(n):
    def update(t, x, u, params):
        y = x.flatten()
        y[0] = 3.0
        return x - y * u[0]

    return pieces(update, states=n)


@entry
def copy_is_a_copy(n):
    def update(t, x, u, params):
        y = x.copy()
        y[-1] = 3.0
        return x * 2 - y

    return pieces(update, states=n)


@entry(alone=True)
def ravel_is_a_view(n):
    def update(t, x, u, params):
        y = x.ravel()
        y[0] = 3.0
        return x + u[0]

    return pieces(update, states=n)


@entry(alone=True)
def reshape_is_a_view(n):
    def update(t, x, u, params):
        m = x.reshape(-1, 1)
        m[0, 0] = u[0]
        m[-1] = u[1]
        return -x

    return pieces(update, states=n)


@entry
def reshape_of_a_transposed_is_a_copy(n):
    def update(t, x, u, params):
        m = np.vstack([x, x * u[0]])
        flat = m.T.reshape(-1)
        flat[0] = 42.0
        kept = m.reshape(-1)
        kept[1] = -7.0
        return m[0] + flat[:n] + m[1]

    return pieces(update, states=n)


@entry
def ravel_of_a_transposed_is_a_copy(n):
    def update(t, x, u, params):
        m = np.outer(x, u)
        flat = m.T.ravel()
        flat[:] = 0.0
        return m.sum(axis=1) + flat[0]

    return pieces(update, states=n)


@entry(alone=True)
def add_in_place_to_an_argument(n):
    def update(t, x, u, params):
        x += u[0]
        x *= 2
        return -x

    return pieces(update, states=n)


@entry(alone=True)
def input_clipped_in_place(n):
    def update(t, x, u, params):
        np.clip(u, -1, 1, out=u)
        return -x + u[0] * u[1]

    return pieces(update, states=n)


@entry(alone=True)
def angle_wrapped_in_place(n):
    def output(t, x, u, params):
        x[0] = (x[0] + np.pi) % (2 * np.pi) - np.pi
        return x

    def update(t, x, u, params):
        return -x * u[0]

    return pieces(update, output, states=n, outputs=n)


@entry
def alias_of_a_result(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        same = dx
        same[0] = u[0]
        same = same + 1
        same[1] = 50.0
        return dx

    return pieces(update, states=n)


@entry
def chained_assignment(n):
    def update(t, x, u, params):
        a = b = np.zeros(n)
        a[0] = x[0]
        b[1] = x[1]
        b += u[0]
        return a

    return pieces(update, states=n)


@entry
def list_alias(n):
    def update(t, x, u, params):
        rows = [[0.0, 0.0]] * 2
        rows[0][1] = x[0]
        dx = list(-x)
        other = dx
        other[0] = rows[1][1] * u[0]
        return dx

    return pieces(update, states=n)


@entry
def list_slice_is_a_copy(n):
    def update(t, x, u, params):
        dx = list(x)
        part = dx[:2]
        part[0] = 100.0
        dx[1:2] = [u[0]]
        dx += []
        return dx

    return pieces(update, states=n)


@entry
def array_of_list_is_a_copy(n):
    def update(t, x, u, params):
        values = [x[0], u[0]]
        a = np.array(values)
        values[0] = 0.0
        b = np.array(a)
        b[0] = 1.0
        c = np.asarray(a)
        c[1] = 2.0
        return -x + a[0] + 10 * a[1] + b[0]

    return pieces(update, states=n)


@entry(alone=True)
def asarray_of_an_argument_is_no_copy(n):
    def update(t, x, u, params):
        v = np.asarray(u, dtype=float)
        v[0] = 0.5
        return x * u[0]

    return pieces(update, states=n)


@entry
def array_of_an_argument_is_a_copy(n):
    def update(t, x, u, params):
        v = np.array(u)
        v[0] = 0.5
        w = np.array(x, copy=True)
        w[-1] = v[0]
        return w * u[0] + x

    return pieces(update, states=n)


@entry
def astype_is_a_copy(n):
    def update(t, x, u, params):
        y = x.astype(float)
        y[0] = 4.0
        return x + y * u[1]

    return pieces(update, states=n)


@entry
def transpose_is_a_view(n):
    def update(t, x, u, params):
        m = np.zeros((2, n))
        m.T[:, 0] = x
        m.T[-1, 1] = u[0]
        return m[0] + m[1]

    return pieces(update, states=n)


@entry
def swapaxes_and_flat(n):
    def update(t, x, u, params):
        m = np.zeros((2, n))
        m.swapaxes(0, 1)[0, 1] = u[0]
        m.flat[1] = x[1]
        return m[0] * 2 - m[1]

    return pieces(update, states=n)


@entry
def augmented_rebinding(n):
    """y = y + 1 makes a new array; y += 1 does not."""

    def update(t, x, u, params):
        y = x * 1
        z = y
        y = y + u[0]
        z += u[1]
        return y - 2 * z

    return pieces(update, states=n)


@entry
def function_that_changes_its_argument(n):
    def limit(v, high):
        v[v > high] = high
        v[0] -= 1

    def update(t, x, u, params):
        dx = x * u[0]
        limit(dx, params["high"])
        return dx

    return pieces(update, states=n, high=0.5)


@entry
def out_argument(n):
    def update(t, x, u, params):
        dx = np.empty(n)
        np.multiply(x, u[0], out=dx)
        np.add(dx, 1.0, out=dx)
        np.negative(dx[:1], out=dx[:1])
        return dx

    return pieces(update, states=n)


@entry
def fill_and_copyto(n):
    def update(t, x, u, params):
        dx = np.empty(n)
        dx.fill(u[0])
        np.copyto(dx[1:], x[:-1])
        np.fill_diagonal(dx.reshape(1, -1), u[1])
        return dx

    return pieces(update, states=n)


@entry
def sorted_in_place(n):
    def update(t, x, u, params):
        y = x.copy()
        y.sort()
        z = sorted(x)
        return y * u[0] - np.array(z[::-1])

    return pieces(update, states=n)


@entry
def deep_copied(n):
    template = {"gain": np.ones(n), "list": [1.0, 2.0]}

    def update(t, x, u, params):
        own = copy.deepcopy(template)
        own["gain"][0] = u[0]
        own["list"].append(3.0)
        return own["gain"] * x + sum(own["list"])

    return pieces(update, states=n)


@entry
def broadcast_and_changed(n):
    def update(t, x, u, params):
        m = np.broadcast_to(x, (2, n)).copy()
        m[0] = u[0]
        return m[1] - m[0]

    return pieces(update, states=n)


@entry
def view_held_across_a_loop(n):
    def update(t, x, u, params):
        work = np.zeros(3)
        tail = work[1:]
        dx = np.zeros(n)
        for i in range(n):
            work[0] = x[i]
            work[2] = work[0] * u[0]
            dx[i] = tail[1] + tail[0]
            tail[0] += 0.1
        return dx

    return pieces(update, states=n)


@entry
def scratch_buffer_wholly_rewritten(n):
    """An array kept by the closure, of which every element is written before it is read."""
    buffer = np.empty(n)

    def update(t, x, u, params):
        buffer[:] = -x
        buffer[0] += u[0]
        return buffer

    return pieces(update, states=n)


@entry
def constant_array_is_not_changed(n):
    offset = np.linspace(0, 1, n)

    def update(t, x, u, params):
        o = offset
        o = o + x
        o[0] = u[0]
        return o

    return pieces(update, states=n)
