"""Functions of NumPy, SciPy and Python that are formulas: at points, what Python itself returns."""

import bisect
import heapq
import math
from collections import namedtuple

import control as ct
import numpy as np
import pytest
import scipy.integrate
import scipy.interpolate
import scipy.linalg
import scipy.ndimage
import scipy.signal
from scipy import special, stats

import nlctl

CORNERS = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0], [3.0, 3.0], [1.0, 1.5]])
HEIGHTS = np.array([0.0, 1.0, 2.0, 3.0, 9.0])
TRIANGLES = scipy.interpolate.LinearNDInterpolator(CORNERS, HEIGHTS, fill_value=-1.0)
RADIAL = scipy.interpolate.RBFInterpolator(CORNERS, HEIGHTS)
NEAREST = scipy.interpolate.NearestNDInterpolator(CORNERS, HEIGHTS)
NEWTON = scipy.interpolate.KroghInterpolator([0.0, 1.0, 2.5], [0.0, 1.0, -4.0])
CURVE = scipy.interpolate.CubicSpline([0.0, 1.0, 2.0], [[0.0, 1.0], [1.0, 0.0], [4.0, 1.0]])
STEPS = scipy.interpolate.interp1d([0.0, 1.0, 2.0], [[0.0, 1.0], [1.0, 0.0], [4.0, 1.0]], axis=0,
                                   bounds_error=False, fill_value=0.5)  # fmt: skip
ENDS = scipy.interpolate.interp1d(
    [0.0, 1.0, 2.0], [[0.0, 1.0, 4.0], [1.0, 0.0, 1.0]], bounds_error=False,
    fill_value=([-1.0, -2.0], 7.0),
)  # fmt: skip
CROSS = np.array([[0.0, 1.0, 0.0], [1.0, -4.0, 1.0], [0.0, 2.0, 0.0]])
GRID = scipy.interpolate.RegularGridInterpolator(
    ([0.0, 1.0], [0.0, 2.0]), np.arange(4.0).reshape(2, 2), method="nearest",
    bounds_error=False, fill_value=None,
)  # fmt: skip


class Settings:
    """A record whose attributes are read by their names."""

    def __init__(self):
        self.gain, self.weights = 3.0, np.array([1.0, 2.0])


SETTINGS = Settings()


class Bunch(dict):
    """A dict whose items are read as attributes, too."""

    __getattr__ = dict.__getitem__


BUNCH = Bunch(gain=3.0, inner=Bunch(offsets=np.array([1.0, 2.0])))


def regular(x):
    return np.outer(x[:3], x[1:]) + 9.0 * np.eye(3)


def made_inside(x):
    pair = namedtuple("Pair", "a b")(x[0], x[1])
    return pair.a * pair._replace(b=2.0).b


def depth(n, z):
    total = 0.0
    while n > 0:
        total, n = total + depth(n - 1, z) + z, n - 1
    return total


FUNCTIONS = {
    "items as attributes": lambda x: BUNCH.gain * x[0] + BUNCH.inner.offsets[1] + BUNCH["gain"],
    "bits of Python's integers": lambda x: (int(10 * x[0]) & 12) + (int(x[1]) | 5) ^ 6,
    "bits below zero": lambda x: (int(10 * x[0]) & -4) + (~int(x[1])),
    "bits of two integers": lambda x: (
        (int(x[0] > 0) << 2 | int(x[1] > 0) << 1 | int(x[0] > x[1])) ^ (int(10 * abs(x[0])) & 7)
    ),
    "Gray code": lambda x: (n := int(10 * abs(x[0])) & 31) ^ (n >> 1),
    "bits of one below zero": lambda x: (int(10 * x[0]) & 13) & int(10 * x[1]),
    "bits of sums": lambda x: (int(x[0] > 0) + 2 * (int(3 * x[1]) % 5)) | (int(7 * x[0]) & 9),
    "shifts": lambda x: (int(10 * x[0]) >> 2) + (int(x[1]) << 3) + (1 << int(x[0] > 0)),
    "quotients": lambda x: int(10 * x[0]) // 3 + int(10 * x[1]) // -4,
    "bits of NumPy's": lambda x: np.bitwise_xor((10 * x).astype(int), 5).sum(),
    "truth and integer": lambda x: np.sum((1 - (x > 0)) & (1 - (x > 1))) + ((x[0] > 0) & 3),
    "Python's decimals": lambda x: round(float(x[0]), 2) + round(math.sin(x[1]), 3),
    "decimals at ties": lambda x: round(float(np.round(200 * x[0])) / 200, 2),
    "logarithm to a base": lambda x: math.log(abs(x[0]) + 1, 3),
    "many legs": lambda x: math.hypot(*x),
    "default": lambda x: max(map(abs, x), default=0.0),
    "a sum of a generator": lambda x: math.fsum(k * v for k, v in enumerate(x)),
    "largest": lambda x: heapq.nlargest(2, x[:3])[1],
    "vars": lambda x: vars(SETTINGS)["gain"] * x[0] + vars(SETTINGS)["weights"] @ x[:2],
    "a named tuple": made_inside,
    "recursion with a loop": lambda x: depth(3, x[0]),
    "histogram": lambda x: np.histogram(x, [-1.0, 0.0, 0.5, 2.0])[0] @ [1, 10, 100],
    "weighted histogram": lambda x: np.histogram(x, 3, (-1, 1), weights=x**2)[0][1],
    "bincount": lambda x: np.bincount((x > 0).astype(int), weights=x, minlength=2)[1],
    "isin": lambda x: np.sum(np.isin(np.sign(x), [1, 0])),
    "choose": lambda x: np.choose((x[0] > 0).astype(int), [x[1], 2 * x[2]]),
    "nanargmax": lambda x: np.nanargmax(np.where(x == max(x), np.nan, x)),
    "a mean where": lambda x: np.mean(x, where=x > -9),
    "a mean of columns": lambda x: np.mean(regular(x), where=np.array([True, False, True])),
    "a mean of rows": lambda x: np.mean(
        np.outer(x, [1.0, 2.0]), axis=0, where=(np.arange(x.size) > 0)[:, None]
    )[1],
    "a mean where it is so for all": lambda x: np.mean(x, where=x[0] > -9),
    "uneven gradient": lambda x: np.gradient(x, [0.0, 0.1, 0.3, 0.4])[1],
    "windows": lambda x: np.lib.stride_tricks.sliding_window_view(x, 2).mean(axis=1)[1],
    "fabs": lambda x: np.fabs(x).sum(),
    "QR": lambda x: np.linalg.qr(regular(x))[0][1, 2] + np.linalg.qr(regular(x))[1][0, 1],
    "pseudoinverse": lambda x: np.linalg.pinv(regular(x)[:, :]).sum(),
    "wide": lambda x: np.linalg.pinv(np.vstack([np.ones(4), np.arange(4.0), 0.1 * x])) @ x[:3] @ x,
    "least squares": lambda x: np.linalg.lstsq(regular(x), x[:3], rcond=None)[0] @ x[1:],
    "square root": lambda x: scipy.linalg.sqrtm(np.eye(2) + np.outer(x[:2], x[:2]))[0, 1],
    "Lyapunov": lambda x: scipy.linalg.solve_continuous_lyapunov(
        np.array([[-1.0, 0.2], [0.1 * np.tanh(x[2]), -2.0]]), -np.outer(x[:2], x[:2])
    )[0, 1],
    "Sylvester": lambda x: scipy.linalg.solve_sylvester(
        np.diag([1.0, 2.0 + x[0] ** 2]), np.eye(3) + 0.1 * np.outer(x[:3], x[:3]), np.ones((2, 3))
    )[1, 2],
    "Toeplitz": lambda x: scipy.linalg.toeplitz(x)[1] @ x,
    "roots": lambda x: np.roots([1.0, x[0], -1.0 - x[1] ** 2]).real.max() + x[2],
    "Bessel": lambda x: special.j0(x[0]) + special.jv(-3, x[1]) + special.i1(x[2]),
    "Macdonald": lambda x: special.k0(np.abs(x[0]) + 1e-3) + special.kv(2.5, x[1] ** 2 + 0.1),
    "exponential integral": lambda x: special.exp1(np.abs(x[0]) + 1e-6),
    "elliptic": lambda x: special.ellipk(0.9 * np.tanh(x[0])) + special.ellipe(-(x[1] ** 2)),
    "inverse of erf": lambda x: special.erfinv(0.9 * np.tanh(x[0]))
    + special.ndtri(1e-9 + x[1] ** 2 / 2000),
    "digamma": lambda x: special.digamma(x[0] + 0.01) + special.beta(x[1] ** 2 + 0.1, 2.0),
    "normal": lambda x: stats.norm.cdf(x[0], loc=x[1], scale=2.0) + stats.norm.pdf(x[2]),
    "triangles": lambda x: TRIANGLES(x[0], x[1]) + TRIANGLES(np.abs(x[:2])).sum(),
    "griddata": lambda x: scipy.interpolate.griddata(CORNERS, HEIGHTS, (abs(x[0]), 1.0)),
    "nearest": lambda x: NEAREST(x[0], x[1]),
    "radial": lambda x: RADIAL(x[None, :2])[0],
    "Newton's form": lambda x: NEWTON(x[0]) + NEWTON(x).sum(),
    "a curve": lambda x: CURVE(x[0]) @ x[1:3] + STEPS(x[2])[1],
    "ends of their own": lambda x: ENDS(x[0]) @ [1.0, 2.0] + ENDS(x)[1, 2],
    "stencils": lambda x: scipy.ndimage.convolve(x.reshape(2, 2), CROSS, mode="nearest")[0, 1]
    + scipy.ndimage.laplace(x.reshape(2, 2), mode="wrap")[1, 0],
    "stencils of signals": lambda x: scipy.signal.convolve2d(
        x.reshape(2, 2), CROSS, mode="same", boundary="symm"
    )[0, 1],
    "a grid's nearest": lambda x: GRID((x[0], x[1])),
    "Simpson": lambda x: scipy.integrate.simpson(x, x=[0.0, 1.0, 2.0, 4.0]),
    "filters": lambda x: scipy.signal.lfilter([0.5], [1, -0.5], x)[2]
    + scipy.ndimage.gaussian_filter1d(x, 1.0)[0],
    "bisect": lambda x: bisect.bisect([0.0, 1.0], x[0]),
}  # fmt: skip


def points():
    rng = np.random.default_rng(5)
    return rng.normal(size=(240, 4)) * np.resize([0.1, 0.5, 1.0, 3.0, 10.0], (240, 1))


@pytest.mark.parted
@pytest.mark.parametrize("name", sorted(FUNCTIONS))
@pytest.mark.filterwarnings("ignore")
def test_a_function_is_traced_with_pythons_values(name):
    """At 240 points to 1e-12; where SciPy has NaN there is NaN."""
    function = FUNCTIONS[name]
    system = ct.nlsys(lambda t, x, u, p: [function(x), 0.0 * x[0], 0.0, 0.0], None,
                      states=4, inputs=1, outputs=4)  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    found = np.array([compiled.dynamics(0.0, x, [0.0])[0] for x in points()])
    wanted = np.array([float(function(x)) for x in points()])
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12)


@pytest.mark.filterwarnings("ignore")
def test_where_a_rank_is_lost_the_function_is_called():
    """x' = x - x by least squares of a matrix that has rank two from the beginning."""

    def update(t, x, u, p):
        matrix = np.diag([x[0], x[1], 0.0])
        return np.linalg.lstsq(matrix, np.array([x[0], x[1], 1.0]), rcond=None)[0] - x

    compiled = nlctl.compile(ct.nlsys(update, None, states=3, inputs=1, outputs=3))
    response = nlctl.input_output_response(compiled, [0.0, 1.0], 0.0, [0.5, 0.25, 1.0])
    ends = [1 - 0.5 * np.exp(-1), 1 - 0.75 * np.exp(-1), np.exp(-1)]
    np.testing.assert_allclose(response.outputs[:, -1], ends, rtol=1e-5)


@pytest.mark.parametrize("above", [0.0, 3.0])
def test_a_case_of_a_truth_value_asks_for_identity(above):
    """Python's own comparison is True or False itself; NumPy's equals it, and is not it."""
    for source in (_true, _false, _of_numpy):
        system = ct.nlsys(source, None, states=1, inputs=1, outputs=1)
        compiled = nlctl.compile(system)
        assert not compiled.equations.calls
        assert compiled.dynamics(0.0, [above], [0.0]) == system.dynamics(0.0, [above], [0.0])


def _of_numpy(t, x, u, params):
    match x[0] > 1.0:
        case True | False:
            return [1.0]
        case _:
            return [2.0 if (x[0] > 1.0) is False else 3.0]


def _true(t, x, u, params):
    match float(x[0]) > 1.0:
        case True:
            return [1.0]
        case _:
            return [2.0]


def _false(t, x, u, params):
    match float(x[0]) > 1.0:
        case False:
            return [1.0]
        case _:
            return [2.0]


class Law:
    """A law whose heirs ask for identity."""

    def value(self, v):
        return v


class Heir(Law):
    """Asks after a branch, in which names have come together."""

    def value(self, v, sign=None):
        if sign is True:
            return super().value(v)
        return -super().value(v)


HEIR = Heir()


@pytest.mark.parametrize("above", [0.0, 3.0])
def test_what_cannot_be_asked_on_expressions_is_called(above):
    """Words that stay as they are, of a method that calls super(), and the class of an object."""
    for source in (
        lambda t, x, u, params: [HEIR.value(x[0], float(x[0]) > 1.0)],
        lambda t, x, u, params: [1.0 if type(HEIR) is Heir else x[0]],
    ):
        system = ct.nlsys(source, None, states=1, inputs=1, outputs=1)
        compiled = nlctl.compile(system)
        assert compiled.equations.calls
        assert compiled.dynamics(0.0, [above], [0.0]) == system.dynamics(0.0, [above], [0.0])


@pytest.mark.parametrize("above", [0.0, 3.0])
def test_a_lambda_is_in_the_words_of_a_function(above):
    """Identity, choices, and what stands at a place that is computed."""
    rows = [[1, 2.0], [3, 4.0]]
    for source in (
        lambda t, x, u, params: [1.0 if (float(x[0]) > 1.0) is True else 2.0],
        lambda t, x, u, params, *, k=2.0: [
            (y := k * x[0]) + rows[int(y > 1)][0] * (lambda z: z)(y)
        ],
        lambda t, x, u, params: [{0: 5.0, 1: 7.0}[int(x[0] > 1.0)] if x[0] is not None else 0.0],
    ):
        system = ct.nlsys(source, None, states=1, inputs=1, outputs=1)
        compiled = nlctl.compile(system)
        assert compiled.dynamics(0.0, [above], [0.0]) == system.dynamics(0.0, [above], [0.0])
        assert not compiled.equations.calls


@pytest.mark.parametrize("above", [0.0, 3.0])
def test_an_object_from_outside_is_of_its_class_in_a_pattern(above):
    system = ct.nlsys(_by_class, None, states=1, inputs=1, outputs=1)
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    assert compiled.dynamics(0.0, [above], [0.0]) == system.dynamics(0.0, [above], [0.0])


def _by_class(t, x, u, params):
    match SETTINGS:
        case Settings(gain=k):
            return [k * x[0]]
    return [0.0]


@pytest.mark.filterwarnings("ignore")
def test_where_nan_is_sorted_the_function_is_called():
    """Seven in order, x' = -x: where NaN ends up only Python says."""

    def update(t, x, u, params):
        first, *_ = sorted([*(v + k for k, v in enumerate(x)), np.sqrt(u[0])])
        return [-v if first < 9.0 else v for v in x]

    system = ct.nlsys(update, None, states=6, inputs=1, outputs=6)
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    response = nlctl.input_output_response(compiled, [0.0, 1.0], 2.0, np.ones(6))
    np.testing.assert_allclose(response.outputs[:, -1], np.exp(-1), rtol=1e-6)
    called = nlctl.input_output_response(compiled, [0.0, 1.0], -1.0, np.ones(6))
    np.testing.assert_allclose(called.outputs[:, -1], np.exp(-1), rtol=1e-6)


def test_a_parameter_may_hold_its_items_as_attributes():
    system = ct.nlsys(lambda t, x, u, p: [p["of"].gain * x[0]], None, states=1, inputs=1, outputs=1,
                      params={"of": BUNCH})  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    assert compiled.dynamics(0.0, [0.5], [0.0]) == [1.5]


KEYS = {1: 2.0, 2: 3.0}


def _types(t, x, u, params):
    numbers, text = {1: x[0], 2: 1.0}, f"{x[0]}"
    kinds = (type(numbers) is dict, type(KEYS) == dict, type(text) is str)  # noqa: E721
    return [numbers[1] if all(kinds) and isinstance(np.tanh, object) else 5.0]


@pytest.mark.parametrize("source", [
    lambda t, x, u, params: [1.0 if isinstance(np.tanh, np.ufunc) else x[0]],
    lambda t, x, u, params: [1.0 if type(np.tanh) == type(np.sin) else x[0]],  # noqa: E721
])  # fmt: skip
def test_the_type_of_a_function_is_asked_where_it_stands(source):
    """In a trace something else stands for it."""
    compiled = nlctl.compile(ct.nlsys(source, None, states=1, inputs=1, outputs=1))
    assert compiled.equations.calls
    assert compiled.dynamics(0.0, [0.5], [0.0]) == [1.0]


def test_types_of_what_stands_for_others_are_theirs():
    compiled = nlctl.compile(ct.nlsys(_types, None, states=1, inputs=1, outputs=1))
    assert not compiled.equations.calls
    assert compiled.dynamics(0.0, [0.5], [0.0]) == [0.5]


def test_values_that_are_repeated_over_places_are_left_to_numpy():
    """NumPy 2.4 reads beyond the end of the two of them."""

    def update(t, x, u, params):
        sums = np.zeros(3)
        np.add.at(sums, np.array([[0, 1], [1, 2]]), x[:2])
        return sums

    compiled = nlctl.compile(ct.nlsys(update, None, states=3, inputs=1, outputs=3))
    (call,) = compiled.equations.calls.values()
    assert "repeated" in call.reason


BY_PLACE = scipy.interpolate.interp1d([-40.0, 0.0, 40.0], [1.0, 2.0, 4.0])


def _changed_under_two_names(t, x, u, params):
    one = np.array(x[0])
    other = one
    other += 1.0
    return [one + other]


def _changed_in_a_view(t, x, u, params):
    y = x.copy()
    y[:1].squeeze()[...] += 1.0
    element = y[:1].reshape(())
    element *= 2.0
    return y


def _is_an_array(t, x, u, params):
    made = [np.where(x[0] > 0, 1.0, 2.0), BY_PLACE(x[0]), np.copy(x[0]), np.asarray(x[0])]
    numbers = [x[0], x.sum(), np.clip(x[0], 0.0, 1.0), np.array(x[0])[()]]
    are = [isinstance(v, np.ndarray) and not np.isscalar(v) and hasattr(v, "__len__") for v in made]
    return [float(all(are)) + 10.0 * sum(isinstance(v, np.ndarray) for v in numbers)]


def _type_is_an_array(t, x, u, params):
    return [1.0 if type(np.array(x[0])) is np.ndarray else 2.0]


def _changed_where_a_condition_holds(t, x, u, params):
    one = np.array(x[0])
    other = one
    for limit in range(8):
        if x[0] > limit:
            other += 1.0
    return [one]


def _a_view_in_one_branch(t, x, u, params):
    def moved(value, y):
        part = np.array(value)
        if value > 0.0:
            part = y[0, ...]
        part -= 1.0
        return y[0] + part

    y = np.array([x[0], 1.0])
    return [sum(moved(x[0] - k, y) for k in range(8))]


def _changed_in_a_loop(t, x, u, params):
    one = np.array(x[0])
    other = one
    while other > 1.0:
        other -= 0.5
    return [one]


@pytest.mark.parametrize("above", [-1.0, 0.25, 3.0])
def test_an_array_without_axes_is_not_a_number(above):
    """It changes under all its names, and what asks for its type is told so."""
    for source in (
        _changed_under_two_names, _changed_in_a_view, _is_an_array, _type_is_an_array,
        _changed_where_a_condition_holds, _changed_in_a_loop, _a_view_in_one_branch,
    ):  # fmt: skip
        system = ct.nlsys(source, None, states=1, inputs=1, outputs=1)
        compiled = nlctl.compile(system)
        wanted = system.dynamics(0.0, np.array([above]), np.array([0.0]))
        assert compiled.dynamics(0.0, [above], [0.0]) == wanted, source.__name__


def _returning_in_branches(value, limit):
    if value > limit:
        value = value - limit
        test = value
        value = 2.0 * test
        return value + test
    result = limit
    if value < -limit:
        value, result = result, value
        return value - result
    value += 1.0
    return sum([value * k for k in (1.0, 2.0)]) + result


def test_what_follows_an_early_return_is_a_choice():
    """256 ways by eight calls; names that are assigned again have the values of their branch."""
    system = ct.nlsys(
        lambda t, x, u, params: [_returning_in_branches(v, 0.5) for v in x], None,
        states=8, inputs=1, outputs=8,
    )  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    rng = np.random.default_rng(3)
    for x in rng.normal(size=(40, 8)):
        wanted = system.dynamics(0.0, x, np.array([0.0]))
        np.testing.assert_allclose(compiled.dynamics(0.0, x, [0.0]), wanted, rtol=1e-14)


def _named_in_a_test(value, limit):
    rest = 0.0
    if (limit > 0.5 and value > limit) or value < (rest := -limit):
        return value
    return limit + rest


def test_a_name_that_a_test_gives_is_that_of_the_function():
    """Three calls have more than a few ways; what is asked last gives a name its value."""
    system = ct.nlsys(
        lambda t, x, u, params: [_named_in_a_test(v, u[0]) for v in x], None,
        states=3, inputs=1, outputs=3,
    )  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    rng = np.random.default_rng(4)
    for x, u in zip(rng.normal(size=(20, 3)), rng.normal(size=(20, 1)), strict=True):
        wanted = system.dynamics(0.0, x, u)
        np.testing.assert_array_equal(compiled.dynamics(0.0, x, u), wanted)
