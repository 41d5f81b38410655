"""Branches and loops: early returns, ends that depend on data, chained comparisons."""

import numpy as np

from ._entry import entry, pieces


@entry(discrete=True)
def early_return(n):
    def update(t, x, u, params):
        if u[0] > params["high"]:
            return np.zeros(n)
        if u[0] < -params["high"]:
            return [0.5] * n
        return -x * u[0]

    return pieces(update, states=n, high=0.8)


@entry
def returns_of_several_kinds(n):
    def update(t, x, u, params):
        if x[0] > 1:
            return list(-x)
        elif x[0] < -1:
            return tuple(2 * x)
        else:
            return (x * u[0]).reshape(-1, 1)

    return pieces(update, states=n)


@entry
def branch_binds_names(n):
    def update(t, x, u, params):
        if u[0] > 0:
            gain = 2.0
            offset = x[0]
        else:
            gain = -1.0
            offset = params["o"]
        return gain * x + offset

    return pieces(update, states=n, o=0.3)


@entry
def name_bound_in_one_branch(n):
    """UnboundLocalError in Python where u[0] <= 0: nothing may come out in silence."""

    def update(t, x, u, params):
        if u[0] > 0:
            gain = 2.0
        return gain * x

    return pieces(update, states=n)


@entry
def branch_writes_into_an_array(n):
    def update(t, x, u, params):
        dx = -x
        if u[0] > 0:
            dx[0] = 1.0
            dx[1:] += u[1]
        elif u[1] > 0:
            dx[-1] = 7.0
        return dx

    return pieces(update, states=n)


@entry
def branch_rebinds_an_alias(n):
    def update(t, x, u, params):
        a = np.zeros(n)
        b = np.ones(n)
        target = a if u[0] > 0 else b
        target[0] = x[0]
        return a - 2 * b

    return pieces(update, states=n)


@entry
def nested_branches(n):
    def update(t, x, u, params):
        k = 0.0
        if x[0] > 0:
            if x[1] > 0:
                k = 1.0
            elif u[0] > 0:
                k = 2.0
        else:
            k = 3.0 if x[1] < 0 and u[0] < 0 else 4.0
        return -k * x

    return pieces(update, states=n)


@entry
def chained_comparison(n):
    def update(t, x, u, params):
        if -0.5 < u[0] <= 0.5 < 1:
            return -x
        inside = 0 <= x[0] < 1 != x[1]
        return x if inside else 2 * x

    return pieces(update, states=n)


@entry
def and_or_give_values(n):
    """`a or b` is a value, not a truth value."""

    def update(t, x, u, params):
        v = u[0] or 3.0
        w = u[1] and 2.0
        return -x + v + w + (params["zero"] or 5.0) + (not u[0])

    return pieces(update, states=n, zero=0.0, changed={"zero": 1.5})


@entry
def while_loop_halves(n):
    def update(t, x, u, params):
        v = abs(u[0])
        steps = 0
        while v > 1.0:
            v /= 2
            steps += 1
        return -x * v + steps

    return pieces(update, states=n)


@entry
def newton_iteration(n):
    """Until it converges, at most 20 times."""

    def update(t, x, u, params):
        a = 1.0 + u[0] ** 2
        v = 1.0
        for _ in range(20):
            new = 0.5 * (v + a / v)
            if abs(new - v) < 1e-12:
                break
            v = new
        return v - x

    return pieces(update, states=n)


@entry
def fixed_number_of_iterations(n):
    def update(t, x, u, params):
        v = x
        for k in range(params["n"]):
            v = v - 0.1 * np.sin(v) * (k + 1)
        return v

    return pieces(update, states=n, n=4)


@entry
def while_with_counter(n):
    def update(t, x, u, params):
        i = 0
        dx = np.zeros(n)
        while i < n:
            dx[i] = -x[i] * i
            i += 1
        return dx

    return pieces(update, states=n)


@entry
def for_else_and_continue(n):
    def update(t, x, u, params):
        total = 0.0
        for v in x:
            if v < 0:
                continue
            if v > 2:
                break
            total += v
        else:
            total += 100.0
        return total - x

    return pieces(update, states=n)


@entry
def loop_with_data_dependent_break(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        for i in range(n):
            dx[i] = x[i] + u[0]
            if x[i] > 0.5:
                break
        return dx

    return pieces(update, states=n)


@entry
def loop_over_zip_and_enumerate(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        for i, (a, b) in enumerate(zip(x[:-1], x[1:])):
            dx[i] += b - a
            dx[i + 1] -= b - a
        for i, k in reversed(list(enumerate(u))):
            dx[i] += k
        return dx

    return pieces(update, states=n)


@entry
def loop_variable_after_the_loop(n):
    def update(t, x, u, params):
        for v in x:
            pass
        for k in range(3):
            w = k * u[0]
        return -x + v + k + w

    return pieces(update, states=n)


@entry
def ranges_with_steps(n):
    def update(t, x, u, params):
        dx = np.zeros(n)
        for i in range(n - 1, -1, -2):
            dx[i] = x[i]
        for i in range(0, n, 3):
            dx[i] -= u[0]
        return dx + len(range(0, n, 3))

    return pieces(update, states=n)


@entry
def runge_kutta_inside(n):
    """A model integrated by hand over several short steps."""

    def f(v, u):
        return -v * abs(v) + u

    def update(t, x, u, params):
        h, v = 0.01, x
        for _ in range(5):
            k1 = f(v, u[0])
            k2 = f(v + h / 2 * k1, u[0])
            v = v + h * k2
        return (v - x) / (5 * h)

    return pieces(update, states=n)


@entry
def time_dependent_phases(n):
    def update(t, x, u, params):
        if t < 1:
            k = 1.0
        elif t < params["switch"]:
            k = np.sin(t)
        else:
            return -x * 0
        return -k * x + (t > 2)

    return pieces(update, states=n, switch=3.0)


@entry
def comparison_of_arrays_by_equality(n):
    def update(t, x, u, params):
        if (x == 0).all():
            return np.ones(n)
        return np.where(x == x[0], 1.0, -x) + np.array_equal(x, x[::-1])

    return pieces(update, states=n)


@entry
def ternary_chain(n):
    def output(t, x, u, params):
        v = u[0]
        lo, hi = params["lo"], params["hi"]
        return v - hi if v > hi else v - lo if v < lo else 0.0

    return pieces(None, output, lo=-0.3, hi=0.5)


@entry
def dead_branch_calls_nonsense(n):
    """A branch that is never taken may hold what does not work."""

    def update(t, x, u, params):
        if params["debug"]:
            raise RuntimeError("debugging")
        return -x + u[0]

    return pieces(update, states=n, debug=False, changed={"debug": False})


@entry
def assertion(n):
    def update(t, x, u, params):
        assert len(x) == n, "wrong size"
        assert x.shape == (n,) and x.ndim == 1
        return -x

    return pieces(update, states=n)


@entry
def assertion_about_data(n):
    """Python raises where it does not hold: nothing may come out in silence."""

    def update(t, x, u, params):
        assert u[0] > 0, "must be positive"
        return -x * u[0]

    return pieces(update, states=n)


@entry
def truth_of_an_array(n):
    """The truth of more than one element is an error in NumPy."""

    def update(t, x, u, params):
        if u > 0:
            return -x
        return x

    return pieces(update, states=n)


@entry
def truth_of_one_element(n):
    def output(t, x, u, params):
        if u > 0:
            return u * 2
        return -u

    return pieces(None, output, inputs=1)


@entry
def bisection(n):
    def update(t, x, u, params):
        lo, hi = -10.0, 10.0
        for _ in range(30):
            mid = (lo + hi) / 2
            if mid + np.tanh(mid) > u[0]:
                hi = mid
            else:
                lo = mid
        return mid - x

    return pieces(update, states=n)


@entry
def insertion_sort(n):
    def update(t, x, u, params):
        a = list(x[:5])
        for i in range(1, len(a)):
            j = i
            while j > 0 and a[j - 1] > a[j]:
                a[j - 1], a[j] = a[j], a[j - 1]
                j -= 1
        return -x + a[0] + 2 * a[-1]

    return pieces(update, states=n)
