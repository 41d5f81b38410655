"""What functions return: lists, tuples, columns, scalars, of the right size and of wrong ones."""

from decimal import Decimal
from fractions import Fraction

import numpy as np

from ._entry import entry, pieces


@entry
def returns_a_list_of_arrays(n):
    def update(t, x, u, params):
        return [x[i : i + 1] * u[0] for i in range(n)]

    return pieces(update, states=n)


@entry
def returns_a_column(n):
    def update(t, x, u, params):
        return -x[:, None]

    def output(t, x, u, params):
        return np.array([[x[0]], [u[0]]])

    return pieces(update, output, states=n, outputs=2)


@entry
def returns_a_row(n):
    def update(t, x, u, params):
        return np.array([-x * u[0]])

    return pieces(update, states=n)


@entry
def returns_a_scalar(n):
    def output(t, x, u, params):
        return x[0] * u[1]

    def update(t, x, u, params):
        return -x

    return pieces(update, output, states=n)


@entry
def returns_a_zero_dimensional_array(n):
    def output(t, x, u, params):
        return np.array(x.sum())

    def update(t, x, u, params):
        return np.negative(x)

    return pieces(update, output, states=n)


@entry
def returns_its_argument(n):
    def update(t, x, u, params):
        return x

    def output(t, x, u, params):
        return u

    return pieces(update, output, states=n, outputs=2)


@entry
def returns_integers_and_truth_values(n):
    def update(t, x, u, params):
        return [1] + [v > 0 for v in x[1:]]

    def output(t, x, u, params):
        return (3, True)

    return pieces(update, output, states=n, outputs=2)


@entry
def returns_a_constant_array(n):
    zero = np.zeros(n)

    def update(t, x, u, params):
        return zero

    return pieces(update, lambda t, x, u, params: 1.0, states=n)


@entry
def returns_nested_lists(n):
    def output(t, x, u, params):
        return [[x[0], u[0]], [x[1], 1.0]]

    def update(t, x, u, params):
        return (-x).tolist()

    return pieces(update, output, states=n, outputs=4)


@entry
def outputs_part_of_the_state(n):
    def update(t, x, u, params):
        return -x + u[0]

    return pieces(update, lambda t, x, u, params: x[:2], states=n, outputs=2)


@entry
def static_function_without_parameters(n):
    def output(t, x, u, params):
        return np.tanh(u) * t

    return pieces(None, output, inputs=n, outputs=n)


@entry
def no_inputs(n):
    def update(t, x, u, params):
        return -x + np.cos(t) + len(u) + u.sum()

    return pieces(update, states=n, inputs=0)


@entry
def one_input_as_a_number(n):
    def update(t, x, u, params):
        (force,) = u
        return -x + force

    return pieces(update, states=n, inputs=1)


@entry
def input_array_broadcast(n):
    """u has one element, which NumPy spreads over all states."""

    def update(t, x, u, params):
        return -x + u * params["b"]

    return pieces(update, states=n, inputs=1, b=2.5)


@entry
def as_many_inputs_as_states(n):
    def update(t, x, u, params):
        return u - x

    return pieces(update, states=n, inputs=n)


@entry
def feedthrough_of_one_input_only(n):
    def update(t, x, u, params):
        return -x + u[0]

    def output(t, x, u, params):
        return [x[0], u[1], x[-1] + 0 * u[0]]

    return pieces(update, output, states=n, outputs=3)


@entry
def wrong_size_on_one_path(n):
    """python-control takes what it gets, or fails: nlctl must not read beyond it."""

    def update(t, x, u, params):
        if u[0] > 0.5:
            return x[:-1]
        return -x

    return pieces(update, states=n)


@entry
def nothing_on_one_path(n):
    """A forgotten return gives None, of which NumPy makes one NaN."""

    def update(t, x, u, params):
        if u[0] <= 0.5:
            return -x

    return pieces(update, states=n)


@entry
def array_of_objects(n):
    """Numbers of several types, of which a run makes floats."""

    def update(t, x, u, params):
        rates = [-x[k] if k % 2 else Fraction(1, 3) * 2 for k in range(n)]
        rates[-1] = Decimal("0.25") if u[0] > 0 else np.array(np.bool_(True))
        return np.array(rates, dtype=object)

    return pieces(update, states=n)


@entry
def array_of_objects_and_a_difference(n):
    def update(t, x, u, params):
        return np.array([*x[1:], 3 * np.cos(x[0]) ** 2 - x[-1]], dtype=object)

    return pieces(update, states=n)
