"""exp, sin, cos and tanh of floats and of vectors, without branches, and other functions.

NumPy's and libm's functions take one number at a time in compiled code; these are arithmetic
throughout, so they cost the same for a vector as for a number.  Each is the textbook's: reduce
the argument by a multiple of a constant given as a sum of short floats (Cody and Waite), take a
polynomial, put the power of two or the quadrant back.  tests/test_vector_math.py measures the
errors, and derives the polynomials: interpolation at the Chebyshev nodes of the reduced range.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.extending import overload, register_jitable

from ._vector_memory import (
    any_true,
    called,
    element,
    muladd,
    power_of_two,
    select,
    with_element,
)
from ._vector_type import Vector, cast, common_type, instruction

LOG2_E, LN2 = 1.4426950408889634, (0.6931471805592082, 7.371002565167799e-13)
# (e^r - 1 - r) / r^2 for |r| <= ln(2) / 2
EXP = (
    0.5, 0.1666666666666667, 0.04166666666666667, 0.008333333333326136, 0.0013888888888883748,
    0.00019841269874820627, 2.4801587325547743e-05, 2.7557255400206422e-06,
    2.75572736431103e-07, 2.5105217004720745e-08, 2.0914686968086876e-09,
)  # fmt: skip
TWO_OVER_PI = 0.6366197723675814
HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32)
# (sin(r) / r - 1) / z and (cos(r) - 1 + z / 2) / z^2 in z = r^2 for |r| <= pi / 4
SIN = (
    -0.16666666666666666, 0.008333333333330936, -0.00019841269836740532, 2.7557316093198404e-06,
    -2.5051129896450185e-08, 1.5917988979397435e-10,
)  # fmt: skip
COS = (
    0.041666666666666664, -0.0013888888888887389, 2.48015872987544e-05, -2.755731726587808e-07,
    2.087614504941318e-09, -1.138254464534925e-11,
)  # fmt: skip
LARGEST_ANGLE = 1e6  # beyond it multiples of HALF_PI's parts are no longer exact
ROUND = 1.5 * 2.0**52  # added and taken away again it leaves the nearest whole number

inlined = register_jitable(forceinline=True)


def floor(x):
    """Return the largest whole number <= x."""
    return np.floor(x)


def absolute(x):
    """Return |x|."""
    return np.abs(x)


def sqrt(x):
    """Return the square root; NaN for x < 0."""
    return np.sqrt(x)


def copysign(x, y):
    """Return |x| with the sign of y."""
    return np.copysign(x, y)


def _instruction(function: Callable[..., Any], name: str, count: int) -> None:
    """Let a function be one instruction in machine code."""

    def typed(typing_context, *kinds):
        kind = common_type(*kinds)

        def generate(context, builder, sig, args):
            pairs = zip(args, sig.args, strict=True)
            return called(builder, name, [cast(context, builder, v, k, kind) for v, k in pairs])

        return kind(*kinds), generate

    if count == 1:
        instruction(function)(lambda typing_context, x: typed(typing_context, x))
    else:
        instruction(function)(lambda typing_context, x, y: typed(typing_context, x, y))


_instruction(floor, "llvm.floor", 1)
_instruction(absolute, "llvm.fabs", 1)
_instruction(sqrt, "llvm.sqrt", 1)
_instruction(copysign, "llvm.copysign", 2)


@inlined
def minimum(a, b):
    """Return the smaller number; NaN if either is."""
    return select((a < b) | (a != a), a, b)


@inlined
def maximum(a, b):
    """Return the larger number; NaN if either is."""
    return select((a > b) | (a != a), a, b)


@inlined
def sign(x):
    """Return -1, 0 or 1; NaN for NaN."""
    return select(x > 0, 1.0, select(x < 0, -1.0, x))


@inlined
def _exp_parts(x):
    """Return the halves n, m of a whole number and e^r - 1, where e^x = 2^(n+m) e^r."""
    whole = (x * LOG2_E + ROUND) - ROUND
    a, b = x - whole * LN2[0], whole * LN2[1]
    r = a - b
    lost = (a - r) - b
    z = r * r
    even = muladd(muladd(muladd(EXP[10], z, EXP[8]), z, EXP[6]), z, EXP[4])
    odd = muladd(muladd(EXP[9], z, EXP[7]), z, EXP[5])
    high = muladd(odd, r, even)
    low = muladd(muladd(EXP[3], r, EXP[2]), z, muladd(EXP[1], r, EXP[0]))
    n = floor(0.5 * whole)
    return n, whole - n, r + muladd(muladd(high, z * z, low), z, lost)


@inlined
def exp(x):
    """Return e^x; overflows to infinity and underflows gradually to 0.  Error <= 1 ulp."""
    x = select(x > 800.0, 800.0, select(x < -800.0, -800.0, x))  # NaN stays
    n, m, y = _exp_parts(x)
    return (1.0 + y) * power_of_two(n) * power_of_two(m)


@inlined
def tanh(x):
    """Return the hyperbolic tangent, relatively accurate near 0.  Error <= 2 ulp."""
    y = absolute(x)
    y = select(y > 22.0, 22.0, y)
    n, m, e = _exp_parts(2.0 * y)
    scale = power_of_two(n + m)
    e = muladd(scale, e, scale - 1.0)
    return copysign(e / (e + 2.0), x)


@inlined
def _angle(x):
    """Return the nearest multiple of pi / 2, and what is left of x in two parts."""
    turns = (x * TWO_OVER_PI + ROUND) - ROUND
    a = x - turns * HALF_PI[0]
    w = turns * HALF_PI[1]
    b = a - w
    lost = (a - b) - w
    w = turns * HALF_PI[2]
    r = b - w
    return turns, r, lost + (((b - r) - w) - turns * HALF_PI[3])


@inlined
def _sin_cos(r, tail):
    """Return sin(r + tail) and cos(r + tail) for |r| <= pi / 4."""
    z = r * r
    zz = z * z
    s = muladd(muladd(SIN[5], z, SIN[4]), zz, muladd(SIN[3], z, SIN[2]))
    s = muladd(s, zz, muladd(SIN[1], z, SIN[0]))
    c = muladd(muladd(COS[5], z, COS[4]), zz, muladd(COS[3], z, COS[2]))
    c = muladd(c, zz, muladd(COS[1], z, COS[0]))
    half = 0.5 * z
    near = 1.0 - half
    sine = r + muladd(s * z, r, tail * near)
    cosine = near + (((1.0 - near) - half) + muladd(c, zz, -r * tail))
    return sine, cosine


@inlined
def _quadrant(turns):
    """Return whether sine and cosine change places, and whether their signs do."""
    half = 0.5 * turns
    odd = floor(half) != half
    return odd, half - 2.0 * floor(0.5 * half)  # 0, 0.5, 1 or 1.5


@inlined
def sin(x):
    """Return the sine of x in radians.  Error <= 1 ulp."""
    turns, r, tail = _angle(x)
    sine, cosine = _sin_cos(r, tail)
    odd, half = _quadrant(turns)
    y = select(odd, cosine, sine)
    return _exact_if_large(x, select(half >= 1.0, -y, y), math.sin)


@inlined
def cos(x):
    """Return the cosine of x in radians.  Error <= 1 ulp."""
    turns, r, tail = _angle(x)
    sine, cosine = _sin_cos(r, tail)
    odd, half = _quadrant(turns)
    y = select(odd, sine, cosine)
    return _exact_if_large(x, select((half == 0.5) | (half == 1.0), -y, y), math.cos)


def _exact_if_large(x, y, function):
    """Return y, but libm's value for the elements of x that are too large for the reduction."""
    far = (np.abs(x) > LARGEST_ANGLE) & np.isfinite(x)
    exact = np.vectorize(function, otypes=[float])(np.where(far, x, 0.0))
    return np.where(far, exact, y)[()]


@overload(_exact_if_large, jit_options={"forceinline": True})
def _(x, y, function):
    if not isinstance(x, Vector):
        return lambda x, y, function: function(x) if abs(x) > LARGEST_ANGLE else y
    width = x.width

    def exact(x, y, function):
        if any_true(absolute(x) > LARGEST_ANGLE):
            for i in range(width):
                if abs(element(x, i)) > LARGEST_ANGLE:
                    y = with_element(y, i, function(element(x, i)))
        return y

    return exact


def _one_by_one(ufunc: Any) -> Callable[[Any], Any]:
    """Return a NumPy function of one argument that takes vectors too, element by element."""

    def function(x):
        return ufunc(x)

    @overload(function)
    def _(x):
        if not isinstance(x, Vector):
            return lambda x: ufunc(x)
        width = x.width

        def each(x):
            y = x
            for i in range(width):
                y = with_element(y, i, ufunc(element(x, i)))
            return y

        return each

    return function


def _two_by_two(ufunc: Any) -> Callable[[Any, Any], Any]:
    """Return a NumPy function of two arguments that takes vectors too, element by element."""

    def function(x, y):
        return ufunc(x, y)

    @overload(function)
    def _(x, y):
        widths = [k.width for k in (x, y) if isinstance(k, Vector)]
        if not widths:
            return lambda x, y: ufunc(float(x), float(y))
        width = widths[0]

        def each(x, y):
            z = x + y
            for i in range(width):
                z = with_element(z, i, ufunc(element(x, i), element(y, i)))
            return z

        return each

    return function


FAST = {f.__name__: f for f in (exp, sin, cos, tanh, sqrt, absolute, floor, copysign, sign)}
FAST |= {f.__name__: f for f in (minimum, maximum)}
UNARY = (
    "log", "log2", "log10", "log1p", "expm1", "exp2", "tan", "sinh", "cosh", "arcsin", "arccos",
    "arctan", "arcsinh", "arccosh", "arctanh", "ceil", "trunc", "rint", "cbrt",
)  # fmt: skip
BINARY = ("arctan2", "hypot", "power", "remainder", "fmod")
FUNCTIONS: dict[str, Callable[..., Any]] = (
    FAST
    | {name: _one_by_one(getattr(np, name)) for name in UNARY}
    | {name: _two_by_two(getattr(np, name)) for name in BINARY}
)
"""Every function of NumPy that vectors know, by NumPy's name."""
