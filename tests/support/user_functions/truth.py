"""Truth values, identity and None: what tests of parameters and of states mean."""

import numpy as np

from ._entry import entry, pieces


@entry(discrete=True)
def flag_is_true(n):
    def update(t, x, u, params):
        if params["flag"] is True:
            return -x
        return -2 * x + u[0]

    return pieces(update, states=n, flag=True)


@entry
def flag_equals_true(n):
    def update(t, x, u, params):
        if params["flag"] == True:
            return -x
        return -2 * x + u[0]

    return pieces(update, states=n, flag=False)


@entry
def flag_is_false(n):
    def update(t, x, u, params):
        return -x if params["flag"] is False else x * u[0]

    return pieces(update, states=n, flag=False)


@entry
def flag_as_a_number_is_not_true(n):
    """1.0 is not True, but equals it."""

    def update(t, x, u, params):
        a = 1.0 if params["flag"] is True else 2.0
        b = 3.0 if params["flag"] == True else 4.0
        return -a * x + b

    return pieces(update, states=n, flag=1.0)


@entry
def parameter_is_none(n):
    def update(t, x, u, params):
        limit = params["limit"]
        v = u[0] if limit is None else min(u[0], limit)
        return -x + v

    return pieces(update, states=n, limit=None)


@entry
def parameter_is_not_none(n):
    def update(t, x, u, params):
        if params.get("limit") is not None:
            return np.clip(-x, -params["limit"], params["limit"])
        return -x

    return pieces(update, states=n, limit=0.5)


@entry
def inverted_flag(n):
    """~True is -2, which is true; ~ of a NumPy truth value is `not`."""

    def update(t, x, u, params):
        inside = np.abs(u[0]) < 0.5
        a = 1.0 if ~inside else 2.0
        return -a * x + (~(x > 0)).sum()

    return pieces(update, states=n)


@entry
def inverted_python_flag(n):
    def update(t, x, u, params):
        a = 1.0 if ~params["count"] else 2.0
        return -a * x + ~params["count"] * u[0]

    return pieces(update, states=n, count=1)


@entry
def sum_of_comparisons(n):
    """NumPy's truth values of two elements: their sum is True, not 2."""

    def update(t, x, u, params):
        k = (x[0] > 0) + (x[1] > 0)
        return -x * k + (u[0] > 0) * 2.0

    return pieces(update, states=n)


@entry
def sum_of_python_comparisons(n):
    def update(t, x, u, params):
        k = (float(x[0]) > 0) + (float(x[1]) > 0) + bool(u[0] > 0)
        return -x * k

    return pieces(update, states=n)


@entry
def builtin_sum_of_comparisons(n):
    def update(t, x, u, params):
        return -x * sum(v > 0 for v in x) + sum([u[0] > 0, u[1] > 0])

    return pieces(update, states=n)


@entry
def difference_of_numpy_comparisons(n):
    """NumPy refuses to subtract truth values: an error in Python as well."""

    def update(t, x, u, params):
        return -x + ((u[0] > 0) - (u[0] < 0))

    return pieces(update, states=n)


@entry
def comparison_times_comparison(n):
    def update(t, x, u, params):
        inside = (u[0] > -1) * (u[0] < 1)
        both = (u[1] > 0) & (x[0] > 0) | (x[1] > 0)
        odd = (u[0] > 0) ^ (u[1] > 0)
        return -x * inside + both + 2.0 * odd

    return pieces(update, states=n)


@entry
def comparison_is_true(n):
    """A NumPy truth value is never the object True."""

    def update(t, x, u, params):
        if (u[0] > 0) is True:
            return 100 * x
        return -x

    return pieces(update, states=n)


@entry
def comparison_equals_true(n):
    def update(t, x, u, params):
        if (u[0] > 0) == True:
            return 100 * x
        return -x

    return pieces(update, states=n)


@entry
def truth_of_numbers(n):
    def update(t, x, u, params):
        k = 1.0 if u[0] else 2.0
        m = 3.0 if not x[0] else 4.0
        return -k * x + m + bool(u[1]) + bool(params["n"])

    return pieces(update, states=n, n=2)


@entry
def truth_of_containers(n):
    def update(t, x, u, params):
        empty, names = [], {"a": 1}
        k = 1.0 if empty else 2.0
        k += 1.0 if names and params else 5.0
        return -k * x

    return pieces(update, states=n, a=1.0)


@entry
def logical_functions(n):
    def update(t, x, u, params):
        a = np.logical_and(x > 0, x < 1)
        b = np.logical_or(a, u[0] > 0)
        return -x * a + np.logical_not(b) + np.logical_xor(a, b) * 2

    return pieces(update, states=n)


@entry
def logical_functions_of_numbers(n):
    def update(t, x, u, params):
        return -x + np.logical_and(u[0], u[1]) + np.logical_not(np.round(x))

    return pieces(update, states=n)


@entry
def identity_of_arrays(n):
    def update(t, x, u, params):
        y = x
        z = np.asarray(x)
        w = x + 0
        return -x + (y is x) + 2 * (z is x) + 4 * (w is x) + 8 * (x[0] is x[0])

    return pieces(update, states=n)


@entry
def key_in_params(n):
    def update(t, x, u, params):
        k = params["k"] if "k" in params else 9.0
        if not params.get("reverse", False):
            k = -k
        return k * x + ("other" in params)

    return pieces(update, states=n, k=0.9)


@entry
def equality_of_floats(n):
    def update(t, x, u, params):
        if u[0] == 1.0 or u[0] in (0.0, -1.0):
            return x * 0
        return -x + (u[0] != u[1]) + np.isclose(x[0], x[1]) + np.allclose(x, 0)

    return pieces(update, states=n)
