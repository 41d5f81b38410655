"""Errors that Python raises and a function catches: of its own numbers, never of NumPy's."""

import math
import operator
import statistics

import numpy as np

from engineers.entry import engineered


@engineered(2)
def zero_in_a_list(t, x, u, params):
    try:
        v = 1.0 / x.tolist()[0]
    except ZeroDivisionError:
        v = 0.0
    return [v, x[1]]


@engineered(2)
def zero_item(t, x, u, params):
    try:
        v = 1.0 / x[0].item()
    except ZeroDivisionError:
        v = 0.0
    return [v, x[1]]


@engineered(2)
def division_by_an_integer(t, x, u, params):
    try:
        v = 1.0 / int(x[0])
    except ZeroDivisionError:
        v = 0.0
    return [v, x[1]]


@engineered(2)
def beyond_a_list(t, x, u, params):
    tab = [1.0, 2.0, 4.0]
    try:
        v = tab[int(x[0])]
    except IndexError:
        v = -1.0
    return [v, x[1]]


@engineered(2)
def roots_and_quotients(t, x, u, params):
    try:
        v = math.sqrt(x[0]) / x[1]
    except ZeroDivisionError:
        v = 0.0
    except ValueError:
        v = -1.0
    return [v, x[1]]


@engineered(2)
def logarithms_and_overflow(t, x, u, params):
    try:
        v = math.log(x[0]) / math.exp(x[1])
    except (ValueError, ZeroDivisionError):
        v = -7.0
    except OverflowError:
        v = 11.0
    return [v, x[1]]


@engineered(2)
def quotient_of_floats(t, x, u, params):
    v, w = (float(x[0]), float(x[1]))
    try:
        r = v / (w - 1.0)
    except ZeroDivisionError:
        r = 0.0
    return [r, v]


@engineered(2)
def bare_except(t, x, u, params):
    q = 1.0 / x[0]  # infinite, where the same of a float is an error
    try:
        r = 1.0 / float(x[0])
    except:  # noqa: E722
        r = 0.25
    return [r, np.clip(q, -1.0, 1.0) - x[1]]


@engineered(2)
def key_that_is_missing(t, x, u, params):
    try:
        k = {1: 2.0, 2: 3.0}[int(x[0])]
    except KeyError:
        k = -0.5
    except Exception:
        k = 9.0
    return [k, x[1]]


@engineered(2)
def own_error_else_finally(t, x, u, params):
    try:
        if x[0] < 0:
            raise ValueError(f"neg {x[0]}")
        v = math.sqrt(x[1])
    except ValueError:
        v = 3.0
    else:
        v = v + 1
    finally:
        w = 2.0
    return [v * w, x[1]]


@engineered(2)
def singular_system(t, x, u, params):
    A = np.array([[x[0], 1.0], [1.0, x[1]]])
    try:
        s = np.linalg.solve(A, np.ones(2))
    except np.linalg.LinAlgError:
        s = np.zeros(2)
    return s


@engineered(2)
def return_within_try(t, x, u, params):
    try:
        return [1.0 / (math.sqrt(x[0]) - 1.0), x[1]]
    except ZeroDivisionError:
        return [5.0, 0.0]


@engineered(2)
def distance_in_a_quotient(t, x, u, params):
    try:
        r = 1.0 / math.dist([x[0]], [1.0])
    except ZeroDivisionError:
        r = 5.0
    return [r, x[1]]


@engineered(2)
def continue_in_a_handler(t, x, u, params):
    r = 0.0
    for v in x:
        try:
            r += math.log(v)
        except ValueError:
            continue
    return [r, x[1]]


@engineered(2)
def index_or_value_error(t, x, u, params):
    try:
        k = int(x[0])
        r = [1.0, 2.0, 4.0][k]
    except (ValueError, OverflowError):
        r = 5.0
    except IndexError:
        r = 7.0
    return [r, x[1]]


@engineered(2)
def overflow_of_exp(t, x, u, params):
    try:
        r = math.exp(x[0] * 50)
    except OverflowError:
        r = float("inf")
    return [min(r, 1000.0), x[1]]


@engineered(2)
def power_of_numpys(t, x, u, params):
    try:
        r = x[0] ** 0.5
    except Exception:
        r = 0.0
    return [r, x[1]]


@engineered(2)
def remainder_and_floor(t, x, u, params):
    try:
        r = 7.0 % float(x[0])
        r = r + 3.0 // float(x[0])
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def in_place_by_zero(t, x, u, params):
    v = float(x[0])
    v /= 2.0
    try:
        q = 3.0
        q /= v
    except ZeroDivisionError:
        q = 0.5
    return [q, x[1]]


@engineered(2)
def sum_of_a_list(t, x, u, params):
    try:
        r = 1.0 / sum(x.tolist())
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def size_of_an_item(t, x, u, params):
    try:
        r = 1.0 / abs(x.item(0))
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def divmod_by_zero(t, x, u, params):
    try:
        r = divmod(5.0, round(x[0]))[1]
    except ZeroDivisionError:
        r = 0.5
    except Exception:
        r = 4.0
    return [r, x[1]]


@engineered(2)
def numpy_divides_by_zero(t, x, u, params):
    try:
        r = x[0] / x[1]
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def divided_by_a_default(t, x, u, params):
    try:
        r = 1.0 / params.get("a", 0.0)
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def domains(t, x, u, params):
    try:
        r = math.atanh(x[0]) + math.acos(x[1]) + math.fmod(x[0], x[1])
    except ValueError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def signed_root(t, x, u, params):

    def f(v):
        try:
            return math.sqrt(v)
        except ValueError:
            return -math.sqrt(-v)

    return [f(x[0]), f(x[1])]


@engineered(2)
def not_positive_definite(t, x, u, params):
    try:
        L = np.linalg.cholesky(np.array([[x[0], 0.1], [0.1, x[1]]]))
    except np.linalg.LinAlgError:
        L = np.eye(2)
    return L @ x


@engineered(2)
def quotient_in_place(t, x, u, params):
    v, w = (float(x[0]), float(x[1]))
    try:
        v /= w
    except ZeroDivisionError:
        v = 0.5
    return [v, x[1]]


@engineered(2)
def divmod_of_floats(t, x, u, params):
    try:
        r = divmod(float(x[0]), float(x[1]))[0]
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def sum_of_quotients(t, x, u, params):
    try:
        r = sum(1.0 / float(v) for v in x)
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def vectorized_quotient(t, x, u, params):
    inv = np.vectorize(lambda v: 1.0 / v, otypes=[float])
    try:
        r = inv(x)
    except ZeroDivisionError:
        r = x * 1.0
    return r


@engineered(2)
def operator_truediv(t, x, u, params):
    try:
        r = operator.truediv(1.0, float(x[0]))
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def divisor_by_choice(t, x, u, params):
    try:
        r = 1.0 / (float(x[0]) if x[1] > 0 else 2.0)
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def nested_attempts(t, x, u, params):
    try:
        try:
            r = math.sqrt(x[0])
        except OverflowError:
            r = 7.0
    except ValueError:
        r = 0.5
    try:
        r = r + min(math.exp(x[1] * 80), 100.0)
    except Exception:
        r = 0.0
    return [r, x[1]]


@engineered(2)
def divided_by_a_floor(t, x, u, params):
    try:
        r = 1.0 / math.floor(x[0])
    except ZeroDivisionError:
        r = 0.5
    except ValueError:
        r = 0.75
    return [r, x[1]]


@engineered(2)
def tried_again(t, x, u, params):
    for k in range(3):
        try:
            r = math.sqrt(x[0] + k)
            break
        except ValueError:
            r = -1.0
    else:
        r = 100.0
    return [r, x[1]]


@engineered(2)
def zero_in_a_row(t, x, u, params):
    v = [float(x[0]), 1.0]
    try:
        r = 1.0 / v[0]
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def mean_of_statistics(t, x, u, params):
    try:
        r = 1.0 / statistics.fmean(x)
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def truth_of_numpy(t, x, u, params):
    try:
        r = 1.0 / (x[0] > 0)
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def truth_of_python(t, x, u, params):
    try:
        r = 1.0 / (float(x[0]) > 0)
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def how_many_are_chosen(t, x, u, params):
    try:
        r = 1.0 / len([v for v in x if v > 0])
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def how_many_counted(t, x, u, params):
    n = sum(1 for v in x if v > 0)
    try:
        r = 1.0 / n
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def truth_as_integer(t, x, u, params):
    n = int(x[0] > 0)
    try:
        r = 1.0 / n
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]


@engineered(2)
def place_of_the_largest(t, x, u, params):
    n = list(x).index(max(x))
    try:
        r = 1.0 / n
    except ZeroDivisionError:
        r = 0.5
    return [r, x[1]]
