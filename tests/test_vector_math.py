"""exp, sin, cos and tanh against decimal arithmetic, and vectors against NumPy."""

import functools
import math
from decimal import Decimal, getcontext, localcontext

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba.core import config
from numba.extending import register_jitable

from nlctl.native import _vector_math as vm
from nlctl.native import _vector_memory as memory

WIDTH = 8
DIGITS = 60
WITH_JIT = not getattr(config, "DISABLE_JIT", False)


@pytest.fixture(autouse=True)
def _precision():
    with localcontext() as context:
        context.prec = DIGITS
        yield


def arctan_of_inverse(n):
    """arctan(1 / n) by its series."""
    total, term, k = Decimal(0), Decimal(1) / n, 0
    while abs(term) > Decimal(10) ** -(getcontext().prec + 5):
        total += term / (2 * k + 1) * (-1) ** k
        term, k = term / (n * n), k + 1
    return total


def pi():
    """Machin's formula."""
    return 4 * (4 * arctan_of_inverse(5) - arctan_of_inverse(239))


def exact_sin(x):
    """Taylor's series at the nearest multiple of pi / 2, with as many digits as that takes."""
    half = pi() / 2
    turns = (x / half).to_integral_value()
    r = x - turns * half
    k = int(turns) % 4
    term, total, n = (r, Decimal(0), 1) if k % 2 == 0 else (Decimal(1), Decimal(0), 0)
    while term and abs(term) > Decimal(10) ** -(DIGITS + 5) * max(abs(total), abs(r)):
        total, n = total + term, n + 2
        term *= -r * r / (n * (n - 1))
    return -total if k >= 2 else total


def exact_cos(x):
    return exact_sin(x + pi() / 2)


def exact_tanh(x):
    with localcontext() as context:
        context.prec = 2 * DIGITS + 20
        e = (2 * x).exp()
        return (e - 1) / (e + 1)


EXACT = {
    "exp": lambda x: x.exp(),
    "sin": exact_sin,
    "cos": exact_cos,
    "tanh": exact_tanh,
}
POINTS = {
    "exp": [(-745, 709.7), (-1, 1), (-40, 0)],
    "tanh": [(-0.5, 0.5), (-3, 3), (-22, 22), (-1e-8, 1e-8)],
    "sin": [(-1, 1), (-10, 10), (-1e6, 1e6)],
    "cos": [(-1, 1), (-10, 10), (-1e6, 1e6)],
}
ULPS = {"exp": 1.0, "sin": 1.0, "cos": 1.0, "tanh": 2.0}


@functools.cache  # compiled once for all tests
def kernel(function):
    """Return a function that fills an array from another one, `WIDTH` numbers at a time."""
    load, store = memory.load, memory.store

    def apply(x, y):
        for i in range(0, x.size, 8):
            store(y, i, function(load(x, i, 8)))

    return numba.njit(apply, error_model="numpy") if WITH_JIT else apply


def values(function, x):
    """Return a function's values at x, as vectors in machine code have them."""
    padded = np.zeros(-(-len(x) // WIDTH) * WIDTH)
    padded[: len(x)] = x
    y = np.empty_like(padded)
    with np.errstate(all="ignore"):
        kernel(function)(padded, y)
    return y[: len(x)]


def ulps(got, x, name):
    """Largest error in units of the last place of the result."""
    worst = 0.0
    for y, at in zip(got, x, strict=True):
        exact = EXACT[name](Decimal(float(at)))
        unit = Decimal(math.ulp(float(exact)))
        worst = max(worst, float(abs(Decimal(float(y)) - exact) / unit))
    return worst


@pytest.mark.parametrize("name", sorted(EXACT))
def test_errors_are_at_most_an_ulp_or_two(name):
    """At random points of every range, large and small."""
    rng = np.random.default_rng(3)
    x = np.concatenate([rng.uniform(low, high, 250) for low, high in POINTS[name]])
    assert ulps(values(getattr(vm, name), x), x, name) <= ULPS[name]


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_multiples_of_half_pi_lose_nothing(name):
    """The floats nearest to multiples of pi / 2, where nearly all of the argument cancels."""
    x = np.random.default_rng(4).integers(1, 636_000, 400) * (np.pi / 2)
    assert ulps(values(getattr(vm, name), x), x, name) <= 1.0
    x = np.array([math.pi, 355.0, 103993.0, 208341.0, 312689.0, 833719.0, 11.0, 22.0])
    assert ulps(values(getattr(vm, name), x), x, name) <= 1.0


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_angles_beyond_the_reduction_are_those_of_libm(name):
    """Also beside others in one vector, which keep their own values."""
    x = np.array([0.5, 1e7, -2.0, 1e15, 1e300, -1e9, 3.0, 1e6])
    y = values(getattr(vm, name), x)
    far = np.abs(x) > vm.LARGEST_ANGLE
    np.testing.assert_array_equal(y[far], [getattr(math, name)(v) for v in x[far]])
    np.testing.assert_array_equal(y[~far], values(getattr(vm, name), np.where(far, 0.0, x))[~far])


def test_limits():
    """Overflow, underflow, infinities, NaN and zeros."""
    inf, nan = np.inf, np.nan
    x = np.array([inf, -inf, nan, 0.0, 709.78, 709.79, -745.0, -746.0])
    np.testing.assert_array_equal(np.isinf(values(vm.exp, x)), [1, 0, 0, 0, 0, 1, 0, 0])
    np.testing.assert_array_equal(values(vm.exp, x)[[1, 2, 3, 6, 7]], [0, nan, 1, 5e-324, 0])
    np.testing.assert_array_equal(values(vm.tanh, x)[:4], [1, -1, nan, 0])
    assert np.signbit(values(vm.tanh, np.array([-0.0])))[0]
    for function in (vm.sin, vm.cos):
        np.testing.assert_array_equal(values(function, x)[:3], [nan] * 3)
    tiny = np.array([5e-324, -1e-310, 1e-300, -1e-20])
    np.testing.assert_array_equal(values(vm.tanh, tiny), tiny)
    np.testing.assert_array_equal(values(vm.sin, tiny), tiny)


@pytest.mark.parametrize("name", sorted(EXACT))
def test_one_number_is_computed_as_many_are(name):
    """The value of a float is that of a vector's element to the last bits."""
    x = np.random.default_rng(5).uniform(-20, 20, 80)
    function = getattr(vm, name)
    alone = numba.njit(lambda v: function(v)) if WITH_JIT else function
    np.testing.assert_allclose([alone(v) for v in x], values(function, x), rtol=5e-16)


NUMPY = ["sqrt", "absolute", "floor", "sign", *vm.UNARY]


@pytest.mark.parametrize("name", NUMPY)
def test_other_functions_are_numpys(name):
    """Element by element, NaN where NumPy has it."""
    x = np.array([-2.5, -1.0, -0.3, 0.0, 0.4, 1.0, 7.5, np.nan])
    with np.errstate(all="ignore"):
        expected = getattr(np, name)(x)
    np.testing.assert_allclose(values(vm.FUNCTIONS[name], x), expected, rtol=1e-14)


@pytest.mark.parametrize("name", ["minimum", "maximum", "copysign", *vm.BINARY])
def test_functions_of_two_arguments_are_numpys(name):
    """Vectors with vectors, and with a number; NaN from either side."""
    function = vm.FUNCTIONS[name]
    x = np.array([-2.5, -1.0, -0.3, 0.5, 0.4, 1.0, 7.5, np.nan])
    for other in (1.5, -2.0, np.nan):
        with np.errstate(all="ignore"):
            expected = getattr(np, name)(x, other)
        bound = _second(function, other)
        np.testing.assert_allclose(values(bound, x), expected, rtol=1e-14)


def _second(function, other):
    def bound(x):
        return function(x, other)

    return register_jitable(bound)


@given(st.lists(st.floats(allow_nan=False), min_size=8, max_size=8), st.integers(0, 7))
def test_an_element_does_not_depend_on_the_others(x, place):
    """Bit for bit, wherever it stands."""
    one = np.full(8, x[place])
    for function in KERNELS.values():
        y, z = np.empty(8), np.empty(8)
        with np.errstate(all="ignore"):
            function(np.array(x), y)
            function(one, z)
        assert y[place].tobytes() == z[0].tobytes() == z[5].tobytes()


KERNELS = {name: kernel(getattr(vm, name)) for name in EXACT}


def test_memory_functions_do_in_machine_code_what_they_do_in_numpy():
    """Loads, parts, choices and sums."""
    load, gather, first = memory.load, memory.gather, memory.first
    total, select, repeated = memory.total, memory.select, memory.repeated
    store, store_first = memory.store, memory.store_first

    def apply(x, y):
        a = gather(x, 1, 2, 8, 5)
        b = load(x, 3, 8)
        c = select((a > b) & ~(b < 0.0), first(b, 3), -a)
        store(y, 0, c)
        store_first(y, 8, repeated(total(c), 8), 3)

    x, found = np.random.default_rng(6).normal(size=20), []
    for function in (apply, numba.njit(apply)):
        y = np.zeros(12)
        function(x, y)
        found.append(y)
    np.testing.assert_array_equal(*found)
    assert found[0][11] == 0.0


def interpolated(f, low, high, count):
    """Coefficients of the polynomial through f at the Chebyshev nodes of [low, high]."""
    nodes = [
        (low + high) / 2 + (high - low) / 2 * exact_cos(pi() * (2 * k + 1) / (2 * count))
        for k in range(count)
    ]
    differences = [f(x) for x in nodes]  # Newton's, then multiplied out
    for step in range(1, count):
        for k in range(count - 1, step - 1, -1):
            span = nodes[k] - nodes[k - step]
            differences[k] = (differences[k] - differences[k - 1]) / span
    coefficients = [Decimal(0)] * count
    for k in range(count - 1, -1, -1):
        shifted = [Decimal(0), *coefficients[:-1]]
        coefficients = [s - nodes[k] * c for s, c in zip(shifted, coefficients, strict=True)]
        coefficients[0] += differences[k]
    return [float(c) for c in coefficients]


def test_polynomials_are_those_at_the_chebyshev_nodes():
    """The derivation of the coefficients, over the reduced ranges and a little more."""
    h = Decimal(2).ln() / 2 * Decimal("1.0001")
    z = (pi() / 4) ** 2 * Decimal("1.001")
    with localcontext() as context:
        context.prec = 2 * DIGITS
        exp = interpolated(lambda r: (r.exp() - 1 - r) / r**2 if r else Decimal("0.5"), -h, h, 11)
        sin = interpolated(lambda v: (exact_sin(v.sqrt()) / v.sqrt() - 1) / v, z * 0, z, 6)
        cos = interpolated(lambda v: (exact_cos(v.sqrt()) - 1 + v / 2) / v**2, z * 0, z, 6)
    for stored, derived in ((vm.EXP, exp), (vm.SIN, sin), (vm.COS, cos)):
        np.testing.assert_allclose(stored, derived, rtol=1e-12)


def test_constants_are_sums_of_short_floats():
    """pi / 2 and ln 2 to many more digits than a float has; their parts' products are exact."""
    for parts, exact, digits in ((vm.HALF_PI, pi() / 2, 47), (vm.LN2, Decimal(2).ln(), 27)):
        assert abs(sum(map(Decimal, parts)) - exact) < Decimal(10) ** -digits
        for part in parts[:-1]:
            bits = 53 - 20 if parts is vm.HALF_PI else 53 - 11
            mantissa, _ = math.frexp(part)
            assert (mantissa * 2.0**bits).is_integer()
