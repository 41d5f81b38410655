"""Arrays that a function makes of numbers and then writes into, in each their own kind.

An array of floats takes what the state decides; one of integers cuts what is behind the point, and
raises an error where there is no integer.
"""

import control as ct
import numpy as np
import pytest
from user_function_checks import Plain, Points, agrees, expected

import nlctl


def of_products(x):
    a = np.arange(3) * 1.0
    a[1] = x[0]
    a[-1] += x[1]
    return a * x


def of_casts(x):
    a = 1.0 + 0.1 * np.arange(3).astype(float)
    b = np.arange(3).astype(float)
    a[0], b[2] = x[1], x[0]
    return a - b * x


def seen_in_a_part(x):
    a = np.arange(4) / 2
    part = a[1:]
    a[2] = x[0]
    part[0] = x[1]
    return a[:3] + part * x


def in_a_branch(x):
    a = np.array([1, 2, 3]) * 0.5
    if x[0] > 0:
        a[0] = x[1]
    return a * x


def cut_one_by_one(x):
    counts = np.array([0, 0, 0])
    for i in range(3):
        counts[i] = 10 * x[i]
    return counts / 2 - counts // 2 + counts % 3


def cut_at_once(x):
    counts = np.zeros(3, dtype=int)
    counts[:] = 10 * x
    counts[1] = 3.7
    return 0.1 * counts - x


def cut_in_a_matrix(x):
    gains = np.array([[1, 2, 3], [0, 3, 1], [4, 0, 1]])
    other = gains.copy()
    other[0, 1] = 2.7 * x[0]
    return other @ x + gains @ x


def cut_under_a_mask(x):
    a = np.array([1, 2, 3])
    a[x > 0] = 7.9
    return a * x


def cut_in_a_branch(x):
    a = np.array([1, 2, 3])
    if x[0] > 0:
        a[0] = 3 * x[1]
    return a**2 - 0.1 * (a @ x) + a.mean() + np.max(a)


def truths_as_integers(x):
    a = np.array([1, 2, 3])
    a[0] = x[0] > 0
    a[1:] = x[:2] < x[2]
    return a * x


def without_one(x):
    a = np.array([1, 2, 3])
    try:
        a[0] = 1e30 * x[0]
    except OverflowError:
        a[0] = 5
    return a * x


def places(x):
    order = np.arange(3)
    order[0], order[2] = order[2], order[0]
    count = np.array([2, 3])
    count[0] = 3
    y = np.zeros(count[0])
    y[order] = x
    return y * sum(range(count[1]))


def compared(function):
    """Return a system, and points with ties, zeros, NaN and what no integer is."""
    system = ct.nlsys(lambda t, x, u, params: function(x), None, states=3, inputs=0, outputs=3,
                      name="block")  # fmt: skip
    x = np.random.default_rng(5).normal(size=(3, 20)) * np.resize([0.1, 1.0, 3.0], 20)
    x[:, 0], x[:, 1], x[:, 2] = 0.0, 1.0, [-0.5, 0.5, 1.5]
    x[0, 3], x[1, 4], x[2, 5], x[0, 6] = np.nan, np.inf, 1e300, -1e19
    return system, Points(np.zeros(20), x, np.zeros((0, 20)))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "function",
    [of_products, of_casts, seen_in_a_part, in_a_branch, cut_one_by_one, cut_at_once,
     cut_in_a_matrix, cut_under_a_mask, cut_in_a_branch, truths_as_integers, without_one, places],
    ids=lambda f: f.__name__,
)  # fmt: skip
def test_an_array_takes_what_the_state_decides_as_in_numpy(function):
    system, at = compared(function)
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    with np.errstate(all="ignore"):
        rates, _ = Plain(compiled).run(at)
        for lane in range(at.t.size):
            want, _ = expected(system, at.at(lane))
            assert agrees(rates[:, lane], want), at.x[:, lane]


def under_two_names(x):
    a = np.arange(3) * 1.0
    b = a
    b[0] = x[0]
    return a * x


def added_in_place(x):
    a = np.array([1, 2, 3])
    a[0] = x[0]
    a *= x[1] > 0  # which NumPy does, other than += 0.5
    a += 0.5
    return a * x


def copied_into(x):
    a = np.array([1, 2, 3])
    a[0] = 2
    np.copyto(a, x)  # which NumPy refuses without casting=
    return a * x


@pytest.mark.filterwarnings("ignore::nlctl.errors.EngineWarning")
@pytest.mark.parametrize("function", [under_two_names, added_in_place, copied_into])
def test_what_may_be_another_array_or_an_error_is_called(function):
    assert nlctl.compile(compared(function)[0]).equations.calls
