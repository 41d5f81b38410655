"""Functions written as LLVM IR against decimal arithmetic, and others against NumPy."""

import ctypes
import dataclasses
import functools
import math
from decimal import Decimal, getcontext, localcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlctl.errors import CompileError
from nlctl.expressions.functions import FUNCTIONS
from nlctl.expressions.graph import numpy_function
from nlctl.native.codegen.ir import functions as ir
from nlctl.native.codegen.ir.text import Body, Module
from nlctl.native.machine.finish import finished

WIDTH = 8
DIGITS = 60


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
    "exp2": lambda x: (x * Decimal(2).ln()).exp(),
    "sin of both": exact_sin,
    "cos of both": exact_cos,
    "sin": exact_sin,
    "cos": exact_cos,
    "tanh": exact_tanh,
}
POINTS = {
    "exp": [(-745, 709.7), (-1, 1), (-40, 0), (-745, -707)],
    "exp2": [(-1074, 1023.9), (-1, 1), (-40, 0), (-1074, -1020)],
    "tanh": [(-0.5, 0.5), (-3, 3), (-22, 22), (-1e-8, 1e-8)],
    "sin": [(-1, 1), (-10, 10), (-1e6, 1e6)],
    "cos": [(-1, 1), (-10, 10), (-1e6, 1e6)],
}
POINTS |= {f"{name} of both": POINTS[name] for name in ("sin", "cos")}
ULPS = {"exp": 1.5, "exp2": 1.5, "sin": 2.1, "cos": 2.1, "tanh": 2.1}
ULPS |= {"sin of both": 1.6, "cos of both": 1.6}


@functools.cache  # compiled once for all tests
def kernel(name, width=WIDTH, inlined=False):
    """Return a function that fills y from x (and z), arrays of `width` numbers.

    ``"sin of both"`` is the sine where the cosine is computed as well.
    """
    module = Module(inlined=inlined)
    b = Body(module)
    one, _, both = name.partition(" of ")
    args = [b.load(f"%{array}", width if width > 1 else 0) for array in "xz"]
    if both:
        result = ir.sin_cos(b, args[0], {"sin", "cos"})[one]
    else:
        result = ir.applied(b, one, *args[: FUNCTIONS[one].count])
    b.store(result, b.address("y", 0))
    text = f"define void @f(ptr %x, ptr %z, ptr %y) {{\nentry:\n{b.text()}  ret void\n}}\n"
    code = finished(module.text() + text, ["f"], {})
    call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(code.addresses["f"])

    def apply(x, z, y):
        assert x.size == z.size == y.size == width
        call(*(array.ctypes.data for array in (x, z, y)))

    apply.code = code
    return apply


def values(name, x, z=1.0, width=WIDTH, inlined=False):
    """Return a function's values at x, computed `width` at a time."""
    padded = np.zeros(-(-len(x) // width) * width)
    padded[: len(x)] = x
    other, y = np.full(width, z), np.empty_like(padded)
    apply = kernel(name, width, inlined)
    for i in range(0, padded.size, width):
        apply(padded[i : i + width], other, y[i : i + width])
    return y[: len(x)]


def ulps(got, x, name):
    """Largest error in units of the last place of the result."""
    worst = 0.0
    for y, at in zip(got, x, strict=True):
        exact = EXACT[name](Decimal(float(at)))
        unit = Decimal(math.ulp(float(exact)))
        worst = max(worst, float(abs(Decimal(float(y)) - exact) / unit))
    return worst


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(EXACT))
def test_errors_are_at_most_an_ulp_or_two(name):
    """At random points of every range, large and small."""
    rng = np.random.default_rng(3)
    x = np.concatenate([rng.uniform(low, high, 250) for low, high in POINTS[name]])
    assert ulps(values(name, x), x, name) <= ULPS[name]


ANGLES = ["sin", "cos", "sin of both", "cos of both"]


@pytest.mark.parted
@pytest.mark.parametrize("name", ANGLES)
def test_multiples_of_half_pi_lose_nothing(name):
    """The floats nearest to multiples of pi / 2, where nearly all of the argument cancels."""
    x = np.random.default_rng(4).integers(1, 636_000, 400) * (np.pi / 2)
    assert ulps(values(name, x), x, name) <= 1.01
    x = np.array([math.pi, 355.0, 103993.0, 208341.0, 312689.0, 833719.0, 11.0, 22.0])
    assert ulps(values(name, x), x, name) <= 1.01


@pytest.mark.parametrize("width", [1, 4, 8])
@pytest.mark.parametrize("name", ANGLES)
def test_angles_beyond_the_reduction_are_those_of_libm(name, width):
    """Also beside others in one vector, which keep their own values."""
    x = np.array([0.5, 1e7, -2.0, 1e15, 1e300, -1e9, 3.0, 1e6])
    y = values(name, x, width=width)
    far = np.abs(x) > ir.LARGEST_ANGLE
    libm = getattr(math, name.partition(" ")[0])
    np.testing.assert_array_equal(y[far], [libm(v) for v in x[far]])
    np.testing.assert_array_equal(y[~far], values(name, np.where(far, 0.0, x))[~far])


def test_limits():
    """Overflow, underflow, infinities, NaN and zeros."""
    inf, nan = np.inf, np.nan
    x = np.array([inf, -inf, nan, 0.0, 709.78, 709.79, -745.0, -746.0])
    np.testing.assert_array_equal(np.isinf(values("exp", x)), [1, 0, 0, 0, 0, 1, 0, 0])
    np.testing.assert_array_equal(values("exp", x)[[1, 2, 3, 6, 7]], [0, nan, 1, 5e-324, 0])
    x2 = np.array([inf, -inf, nan, 0.0, 1023.0, 1024.0, -1074.0, -1076.0])
    np.testing.assert_array_equal(values("exp2", x2), [inf, 0, nan, 1, 2.0**1023, inf, 5e-324, 0])
    np.testing.assert_array_equal(values("tanh", x)[:4], [1, -1, nan, 0])
    assert np.signbit(values("tanh", np.array([-0.0])))[0]
    for name in ANGLES:
        np.testing.assert_array_equal(values(name, x)[:3], [nan] * 3)
    tiny = np.array([5e-324, -1e-310, 1e-300, -1e-20])
    for name in ("tanh", "sin", "sin of both"):
        np.testing.assert_array_equal(values(name, tiny), tiny)


@pytest.mark.parted
@pytest.mark.parametrize("name", sorted(EXACT))
def test_one_number_is_computed_as_many_are(name):
    """Alone, two, four or eight side by side, called or written out: the same bits."""
    x = np.random.default_rng(5).uniform(-20, 20, 80)
    for width in (1, 2, 4):
        for inlined in (False, True):
            alone = values(name, x, width=width, inlined=inlined)
            np.testing.assert_array_equal(alone, values(name, x))


@pytest.mark.parametrize("name", [f.name for f in FUNCTIONS.values() if f.count == 1])
def test_every_function_of_the_table_is_numpys(name):
    """Element by element, NaN where NumPy has it."""
    x = np.array([-2.5, -1.0, -0.3, 0.0, 0.4, 1.0, 7.5, np.nan])
    with np.errstate(all="ignore"):
        expected = numpy_function(name)(x)
    for width in (1, 8):
        np.testing.assert_allclose(values(name, x, width=width), expected, rtol=1e-14)


@pytest.mark.parametrize("name", [f.name for f in FUNCTIONS.values() if f.count == 2])
def test_every_function_of_two_arguments_is_numpys(name):
    """Of both signs, zeros and infinities; NaN from either side."""
    x = np.array([-2.5, -1.0, -0.3, 0.5, 0.0, -0.0, 7.5, np.nan, np.inf, -np.inf, 3.0, -3.0])
    for other in (1.5, -2.0, 0.0, np.inf, np.nan):
        with np.errstate(all="ignore"):
            expected = numpy_function(name)(x, other)
        found = values(name, x, other)
        np.testing.assert_allclose(found, expected, rtol=1e-14)
        if name in ("remainder", "copysign", "fmod"):
            np.testing.assert_array_equal(np.signbit(found)[:7], np.signbit(expected)[:7])


def test_logaddexp_neither_overflows_nor_loses_small_numbers():
    """ln(e^x + e^y): far apart the larger one, equal ones ln 2 more, infinities as NumPy's."""
    x = np.array([1e300, -1e300, 800.0, -800.0, np.inf, -np.inf, np.nan, 0.0])
    np.testing.assert_array_equal(values("logaddexp", x, -np.inf), x)
    np.testing.assert_array_equal(values("logaddexp", x[:6], np.inf), np.inf)
    for z in (-800.0, 0.0, 800.0):
        np.testing.assert_allclose(values("logaddexp", [z], z), z + np.log(2.0), rtol=1e-15)
    small = np.array([-30.0, -100.0, -700.0])
    np.testing.assert_allclose(values("logaddexp", small, 0.0), np.exp(small), rtol=1e-12)


@given(st.lists(st.floats(allow_nan=False), min_size=8, max_size=8), st.integers(0, 7))
def test_an_element_does_not_depend_on_the_others(x, place):
    """Bit for bit, wherever it stands."""
    one, z = np.full(8, x[place]), np.ones(8)
    for name in EXACT:
        y, w = np.empty(8), np.empty(8)
        kernel(name)(np.array(x), z, y)
        kernel(name)(one, z, w)
        assert y[place].tobytes() == w[0].tobytes() == w[5].tobytes()


@given(st.floats(-700, 700), st.floats(-1e6, 1e6))
def test_identities(x, angle):
    """e^x e^-x = 1, sin^2 + cos^2 = 1, and the pair is near the single ones."""
    e = values("exp", [x, -x])
    assert abs(e[0] * e[1] - 1) < 1e-15 * (1 + abs(x))
    s, c = values("sin of both", [angle])[0], values("cos of both", [angle])[0]
    assert abs(s * s + c * c - 1) < 1e-15
    np.testing.assert_allclose([s, c], [values(n, [angle])[0] for n in ("sin", "cos")], rtol=5e-16)


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
    h, half, two = Decimal(2).ln() / 2 * Decimal("1.0001"), Decimal("0.5"), Decimal(2).ln()
    z = (pi() / 4) ** 2 * Decimal("1.001")
    with localcontext() as context:
        context.prec = 2 * DIGITS
        exp = interpolated(lambda r: (r.exp() - 1 - r) / r**2 if r else half, -h, h, 10)
        exp2 = interpolated(lambda r: ((r * two).exp() - 1) / r if r else two, -half, half, 11)
        sin = interpolated(lambda v: (exact_sin(v.sqrt()) / v.sqrt() - 1) / v, z * 0, z, 6)
        cos = interpolated(lambda v: (exact_cos(v.sqrt()) - 1 + v / 2) / v**2, z * 0, z, 6)
        wide = interpolated(lambda v: (exact_sin(v.sqrt()) / v.sqrt() - 1) / v, z * 0, 4 * z, 8)
    pairs = (ir.EXP, exp), (ir.EXP2, exp2), (ir.SIN, sin), (ir.COS, cos), (ir.SIN_WIDE, wide)
    for stored, derived in pairs:
        np.testing.assert_allclose(stored, derived, rtol=1e-12)


def test_constants_are_sums_of_floats():
    """pi, pi / 2 and ln 2 to many more digits than a float has."""
    for parts, exact, digits in (
        (ir.HALF_PI, pi() / 2, 48), (ir.PI, pi(), 48), (ir.LN2, Decimal(2).ln(), 32),
    ):  # fmt: skip
        assert abs(sum(map(Decimal, parts)) - exact) < Decimal(10) ** -digits


def test_every_row_of_the_table_has_machine_code(monkeypatch):
    """One that has none says where it belongs, when it is first compiled."""
    own = [name for name, row in FUNCTIONS.items() if row.code == "own"]
    assert [name for name in own if name not in ir.INLINE | ir.CALLED] == []
    row = dataclasses.replace(FUNCTIONS["exp"], name="exp10")
    monkeypatch.setitem(FUNCTIONS, "exp10", row)
    with pytest.raises(CompileError, match=r"row of 'exp10'.*INLINE or CALLED"):
        ir.applied(Body(Module(inlined=True)), "exp10")
