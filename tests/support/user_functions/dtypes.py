"""Kinds of numbers: whole ones, single precision, truth values, complex ones."""

import numpy as np

from ._entry import entry, pieces


@entry
def integers_are_assigned_floats(n):
    def update(t, x, u, params):
        dx = np.array([0] * n)
        dx[0] = 10 * u[0]
        dx[-1] = x[0]
        return dx

    return pieces(update, states=n)


@entry
def zeros_of_integers(n):
    def update(t, x, u, params):
        dx = np.zeros(n, dtype=int)
        dx[:] = 5 * x
        return dx * u[0]

    return pieces(update, states=n)


@entry
def asarray_as_integers(n):
    def output(t, x, u, params):
        return np.asarray(u, dtype=int)

    return pieces(None, output, inputs=n, outputs=n)


@entry
def astype_int(n):
    def update(t, x, u, params):
        levels = (x * 4).astype(int)
        return levels / 4 - x

    return pieces(update, states=n)


@entry
def zeros_like_of_integers(n):
    table = np.arange(n)

    def update(t, x, u, params):
        dx = np.zeros_like(table)
        dx[0] = u[0] * 3
        dx[1:] = x[1:] + 0.9
        return dx

    return pieces(update, states=n)


@entry
def full_of_an_integer(n):
    def update(t, x, u, params):
        dx = np.full(n, 2)
        dx[0] = u[0] + 1.5
        return dx * 1.0 + x

    return pieces(update, states=n)


@entry
def full_like_and_ones_like(n):
    def update(t, x, u, params):
        dx = np.full_like(np.arange(n), 2.9)
        dx += np.ones_like(x, dtype=int)
        return dx + x

    return pieces(update, states=n)


@entry
def arange_times_state(n):
    k = np.arange(1, n + 1)

    def update(t, x, u, params):
        w = k // 2
        return -(k**2) * x / n + w * u[0] + k % 3

    return pieces(update, states=n)


@entry
def single_precision_array(n):
    def update(t, x, u, params):
        dx = np.zeros(n, dtype=np.float32)
        dx[:] = x * 0.1
        return dx

    return pieces(update, states=n)


@entry
def single_precision_constant(n):
    gains = np.linspace(0.1, 1, n).astype(np.float32)

    def update(t, x, u, params):
        return gains * x + np.float32(0.1) * u[0]

    return pieces(update, states=n)


@entry
def single_precision_rounding(n):
    def update(t, x, u, params):
        return np.float32(u[0]) - x.astype("float32")

    return pieces(update, states=n)


@entry
def small_integers_wrap(n):
    def update(t, x, u, params):
        counts = np.zeros(n, dtype=np.int8)
        counts[:] = np.clip(x * 100, -120, 120)
        counts += counts
        return counts * 1.0

    return pieces(update, states=n)


@entry
def truth_values_as_numbers(n):
    def update(t, x, u, params):
        on = x > 0
        return on * u[0] - (~on) * 2.0 + on.sum()

    return pieces(update, states=n)


@entry
def boolean_array_assigned(n):
    def update(t, x, u, params):
        on = np.zeros(n, dtype=bool)
        on[0] = u[0]
        on[1:] = x[1:] > 0.3
        return on - 0.5 * x

    return pieces(update, states=n)


@entry
def sum_of_two_truth_arrays(n):
    """True + True is True in arrays."""

    def update(t, x, u, params):
        both = (x > 0) + (x > -1)
        return both * 3.0 - x

    return pieces(update, states=n)


@entry
def product_of_truth_values(n):
    def update(t, x, u, params):
        inside = (x > -1) * (x < 1)
        return np.where(inside, x, inside + 0.25)

    return pieces(update, states=n)


@entry
def integer_division_of_constants(n):
    def update(t, x, u, params):
        half = n // 2
        weights = np.array([1, 2, 3]) // 2
        return -x * half + weights.sum() + 7 // 2 - 7 / 2

    return pieces(update, states=n)


@entry
def integer_power_of_constants(n):
    def update(t, x, u, params):
        return x * 2**-1 + np.array([2, 3])[0] ** 3 + np.array([2.0, 3.0]).sum() ** -2

    return pieces(update, states=n)


@entry
def complex_numbers(n):
    def update(t, x, u, params):
        z = x[0] + 1j * x[1]
        w = z * np.exp(1j * u[0])
        return -x + abs(w) + w.real - w.imag

    return pieces(update, states=n)


@entry
def complex_arrays(n):
    def update(t, x, u, params):
        z = np.sqrt(x.astype(complex))
        return z.real - z.imag + np.angle(z) + np.conj(z).imag

    return pieces(update, states=n)


@entry
def float_of_elements(n):
    def update(t, x, u, params):
        a = float(x[0])
        b = x[1].item()
        c = np.float64(u[0])
        d = u[1:2].item()
        return [a - b + c * d] * n

    return pieces(update, states=n)


@entry
def integer_parameters_divide(n):
    def update(t, x, u, params):
        return -x * params["num"] / params["den"] + params["num"] // params["den"]

    return pieces(update, states=n, num=7, den=2)


@entry
def array_of_truth_values_and_numbers(n):
    def update(t, x, u, params):
        a = np.array([True, 2, 0.5])
        b = np.array([x[0] > 0, u[0] > 0])
        return x * a.sum() + b.sum() + b.mean()

    return pieces(update, states=n)


@entry
def object_array(n):
    def update(t, x, u, params):
        parts = np.array([x, u], dtype=object) if n != 2 else [x, u]
        return parts[0] * parts[1][0]

    return pieces(update, states=n)


@entry
def mixed_integer_matrix(n):
    A = -2 * np.eye(n, dtype=int) + np.eye(n, k=1, dtype=int)

    def update(t, x, u, params):
        B = A.copy()
        B[0, 0] = 1.7 * u[0]
        return B @ x + A.T @ x

    return pieces(update, states=n)
