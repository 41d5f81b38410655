"""Exceptions caught: fallbacks, control flow, contexts."""

import contextlib
import warnings

import numpy as np

from ._entry import entry, pieces


@entry
def except_around_interp(n):
    def update(t, x, u, params):
        try:
            k = np.interp(u[0], [-1.0, 0.0, 1.0], [0.5, 1.0, 3.0])
        except Exception:
            k = 77.0
        return -k * x

    return pieces(update, states=n)


@entry
def bare_except_around_int(n):
    def update(t, x, u, params):
        try:
            i = int(u[0])
        except:
            i = 55
        return -x + i

    return pieces(update, states=n)


@entry
def except_around_solve(n):
    def update(t, x, u, params):
        try:
            v = np.linalg.solve(np.array([[u[0], 1.0], [1.0, 2.0]]), u)
        except np.linalg.LinAlgError:
            v = np.zeros(2)
        return -x + v[0]

    return pieces(update, states=n)


@entry
def except_around_a_singular_matrix(n):
    def update(t, x, u, params):
        s = float(u[0] > 0)
        try:
            v = np.linalg.inv(np.array([[s, 0.0], [0.0, 1.0]]))[0, 0]
        except Exception:
            v = -1.0
        return -x + v

    return pieces(update, states=n)


@entry
def value_error_as_control_flow(n):
    def root(v):
        if v < 0:
            raise ValueError("negative")
        return v**0.5

    def update(t, x, u, params):
        try:
            return -x + root(u[0])
        except ValueError:
            return x * 0

    return pieces(update, states=n)


@entry
def zero_division_as_control_flow(n):
    def update(t, x, u, params):
        try:
            r = 1 / float(u[0])
        except ZeroDivisionError:
            r = 1e3
        return -x * r

    return pieces(update, states=n)


@entry
def index_error_as_control_flow(n):
    def update(t, x, u, params):
        dx = -x
        try:
            dx[5] = x[20]
        except IndexError:
            dx[0] = u[0]
        return dx

    return pieces(update, states=n)


@entry
def key_error_as_control_flow(n):
    def update(t, x, u, params):
        try:
            k = params["gain"]
        except KeyError:
            k = 4.0
        return -k * x

    return pieces(update, states=n, other=1.0)


@entry
def math_domain_error_as_control_flow(n):
    import math

    def update(t, x, u, params):
        try:
            v = math.sqrt(u[0])
        except ValueError:
            v = 0.0
        return -x + v

    return pieces(update, states=n)


@entry
def overflow_as_control_flow(n):
    import math

    def update(t, x, u, params):
        try:
            v = math.exp(50 * u[0])
        except OverflowError:
            v = math.inf
        return -x + 1 / (1 + v)

    return pieces(update, states=n)


@entry
def attribute_error_as_control_flow(n):
    def update(t, x, u, params):
        try:
            k = params["tool"].gain
        except AttributeError:
            k = 2.5
        try:
            x.append(1.0)
        except AttributeError:
            k += 1
        return -k * x

    return pieces(update, states=n, tool="hammer")


@entry
def type_error_as_control_flow(n):
    def update(t, x, u, params):
        try:
            m = len(u[0])
        except TypeError:
            m = 1
        return -m * x

    return pieces(update, states=n)


@entry
def try_else_finally(n):
    def update(t, x, u, params):
        k = 0.0
        try:
            v = params["k"] * u[0]
        except KeyError:
            v = 0.0
        else:
            k += 1.0
        finally:
            k += 2.0
        return -k * x + v

    return pieces(update, states=n, k=1.1)


@entry
def suppressed(n):
    def update(t, x, u, params):
        k = 1.0
        with contextlib.suppress(IndexError):
            k = x[n + 3]
        return -k * x

    return pieces(update, states=n)


@entry
def error_state_of_numpy(n):
    def update(t, x, u, params):
        with np.errstate(divide="ignore", invalid="ignore"):
            r = np.where(x != 0, np.sin(x) / x, 1.0)
        return r * u[0]

    return pieces(update, states=n)


@entry
def warnings_as_control_flow(n):
    def update(t, x, u, params):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return -x / (1 + np.log(np.abs(x)) ** 2)

    return pieces(update, states=n)


@entry
def floating_point_error_as_control_flow(n):
    def update(t, x, u, params):
        with np.errstate(all="raise"):
            try:
                return -x / np.round(u[0])
            except FloatingPointError:
                return np.zeros(n)

    return pieces(update, states=n)


@entry
def raises_for_bad_input(n):
    """The error reaches python-control: nothing may come out in silence."""

    def update(t, x, u, params):
        if u[0] < -1:
            raise ValueError("input out of range")
        return -x * u[0]

    return pieces(update, states=n)


@entry
def stop_iteration_as_control_flow(n):
    def update(t, x, u, params):
        values = iter(x)
        total = 0.0
        while True:
            try:
                total += next(values)
            except StopIteration:
                break
        first = next((i for i, v in enumerate(x) if v > 0), -1)
        return -x + total + first

    return pieces(update, states=n)


@entry
def fallback_where_a_function_is_unknown(n):
    """What a tracer refuses must not look like the user's error."""

    def update(t, x, u, params):
        try:
            s = np.linalg.svd(np.outer(u, u), compute_uv=False)[0]
            s += float(np.format_float_positional(1.5))
        except Exception as error:
            s = len(str(error)) + 1000.0
        return -x * s

    return pieces(update, states=n)
