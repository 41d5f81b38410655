"""exp, sin, cos, tanh and others, of numbers and of vectors, as arithmetic.

The C library's functions take one number at a time; these cost the same for a vector.  Each is the
textbook's: reduce the argument by a multiple of a constant that is a sum of floats, each product
rounded once; take a polynomial by Estrin's scheme; put the power of two, or the sign, back.
tests/expressions/test_ir_functions.py measures the errors (exp, exp2 1.5, sin, cos and tanh 2.1
units in the last place) and derives the polynomials: interpolation at the Chebyshev nodes of the
reduced range.
"""

import math
from collections.abc import Callable, Sequence

from ....errors import CompileError
from ....expressions.functions import FUNCTIONS
from .text import Body, Value

_LOG2_E, LN2 = 1.4426950408889634, (0.6931471805599453, 2.3190468138462996e-17)
TWO_OVER_PI, HALF_PI = 0.6366197723675814, (
    1.5707963267948966, 6.123233995736766e-17, -1.4973849048591698e-33
)  # fmt: skip
PI = tuple(2 * part for part in HALF_PI)
# (e^r - 1 - r) / r^2 for |r| <= ln(2) / 2
EXP = (
    0.5000000000000001, 0.16666666666666669, 0.04166666666662413, 0.008333333333330062,
    0.0013888888917213717, 0.00019841269863053618, 2.4801521295954376e-05,
    2.7557268459997064e-06, 2.7620088445409746e-07, 2.510038549551032e-08,
)  # fmt: skip
# (2^r - 1) / r for |r| <= 1 / 2
EXP2 = (
    0.6931471805599453, 0.24022650695910097, 0.0555041086648216, 0.009618129107606888,
    0.0013333558146416936, 0.0001540353044173605, 1.525273382983612e-05, 1.321544258792169e-06,
    1.0178062445845774e-07, 7.072585949269223e-09, 4.4549605981865186e-10,
)  # fmt: skip
# (sin(r) / r - 1) / z and (cos(r) - 1 + z / 2) / z^2 in z = r^2 for |r| <= pi / 4
SIN = (
    -0.16666666666666666, 0.008333333333330936, -0.00019841269836740532, 2.7557316093198404e-06,
    -2.5051129896450185e-08, 1.5917988979397435e-10,
)  # fmt: skip
COS = (
    0.041666666666666664, -0.0013888888888887389, 2.48015872987544e-05, -2.755731726587808e-07,
    2.087614504941318e-09, -1.138254464534925e-11,
)  # fmt: skip
# the first for |r| <= pi / 2
SIN_WIDE = (
    -0.16666666666666666, 0.008333333333333316, -0.00019841269841254885, 2.7557319219139183e-06,
    -2.505210761393476e-08, 1.6058977114074673e-10, -7.643963965925357e-13, 2.731365867494017e-15,
)  # fmt: skip
LARGEST_ANGLE = 1e6  # beyond it three parts of pi are too few
ROUND = 1.5 * 2.0**52  # added, it leaves the nearest integer, which the last bits are
_SMALLEST, _STEP = -707.0, 64  # below e^-707 powers of two are made in two steps


def applied(b: Body, name: str, *args: Value) -> Value:
    """Return a function of the table of functions, written out or called."""
    code = FUNCTIONS[name].code
    if name in ("sin", "cos"):
        return sin_cos(b, args[0], {name})[name]
    if name in CALLED:
        return _call(b, name, CALLED[name], *args)[0]
    if code == "own":
        if name not in INLINE:
            raise CompileError(
                f"the row of '{name}' in nlctl/expressions/functions.py has the code 'own', and no "
                "machine code is written: enter it in INLINE or CALLED of "
                "nlctl/native/codegen/ir/functions.py"
            )
        return INLINE[name](b, *args)
    if code.startswith("llvm."):
        return b.intrinsic(code.removeprefix("llvm."), *args)
    return b.each(code, *args)


def sin_cos(b: Body, x: Value, kinds: set[str]) -> dict[str, Value]:
    """Return sine, cosine or both of one angle."""
    if len(kinds) == 2:
        return dict(zip(("sin", "cos"), _call(b, "sincos", _sin_and_cos, x), strict=True))
    (name,) = kinds
    make = _sin if name == "sin" else _cos
    return {name: _call(b, name, make, x)[0]}


Results = tuple[Value, ...]


def _call(b: Body, name: str, make: Callable[..., Results], *args: Value) -> Results:
    """Call a function of this module; it is written when it is first needed."""
    return b.called(name, make, b.same(*args), 2 if make is _sin_and_cos else 1)


def estrin(b: Body, coefficients: Sequence[float], x: Value) -> Value:
    """Evaluate a polynomial by Estrin's scheme: pairs, pairs of pairs, ..."""
    terms: list[Value | float] = list(coefficients)
    while True:
        terms = [
            b.muladd(terms[i + 1], x, terms[i]) if i + 1 < len(terms) else terms[i]
            for i in range(0, len(terms), 2)
        ]
        if len(terms) == 1:
            return b.wide(terms[0], x.width)
        x = b.mul(x, x)


# -- powers ----------------------------------------------------------------------------------------


def _clamped(b: Body, x: Value, low: float, high: float) -> Value:
    """Return x between two bounds; NaN stays."""
    x = b.select(b.compare("ogt", x, high), high, x)
    return b.select(b.compare("olt", x, low), low, x)


def _reduced(b: Body, x: Value, shift: float) -> tuple[Value, Value]:
    """Return r and m with e^x = 2^n e^r, where n + shift is in the last bits of m."""
    m = b.fma(x, _LOG2_E, ROUND + shift)
    n = b.sub(m, ROUND + shift, exact=True)
    return b.fma(n, -LN2[1], b.fma(n, -LN2[0], x)), m


def _scaled(b: Body, y: Value, m: Value, small: Value) -> Value:
    """Return y 2^k, where k + 1023 is in the last bits of m."""
    # Where the result may be small it is made in two steps, so that it underflows gradually.
    bits = b.logic("add", b.bits(m), b.integer("and", b.mask(small), _STEP))
    y = b.mul(y, b.real(b.integer("shl", bits, 52)), exact=True)
    return b.mul(y, b.select(small, 2.0**-_STEP, 1.0), exact=True)


def _exp(b: Body, x: Value) -> Results:
    """e^x = 2 e^r 2^(n-1): overflows to infinity, underflows gradually to 0."""
    x = _clamped(b, x, -746.0, 710.0)
    r, m = _reduced(b, x, 1022)
    tail = estrin(b, [2 * c for c in EXP], r)
    y = b.muladd(tail, b.mul(r, r), b.muladd(r, 2.0, 2.0))
    return (_scaled(b, y, m, b.compare("olt", x, _SMALLEST)),)


def _exp2(b: Body, x: Value) -> Results:
    x = _clamped(b, x, -1077.0, 1024.5)
    m = b.add(x, ROUND + 1022, exact=True)
    r = b.sub(x, b.sub(m, ROUND + 1022, exact=True), exact=True)
    y = b.muladd(estrin(b, [2 * c for c in EXP2], r), r, 2.0)
    return (_scaled(b, y, m, b.compare("olt", x, _SMALLEST * _LOG2_E)),)


def _tanh(b: Body, x: Value) -> Results:
    """(e^2y - 1) / (e^2y + 1), relatively accurate near 0."""
    y = b.intrinsic("fabs", x)
    y = b.select(b.compare("ogt", y, 22.0), 22.0, y)
    r, m = _reduced(b, b.add(y, y), 1023)
    e = b.muladd(estrin(b, EXP, r), b.mul(r, r), r)
    scale = b.real(b.integer("shl", b.bits(m), 52))
    e = b.muladd(scale, e, b.sub(scale, 1.0))
    return (b.intrinsic("copysign", b.op("fdiv", e, b.add(e, 2.0)), x),)


# -- angles ----------------------------------------------------------------------------------------


def _less(b: Body, x: Value, n: Value, parts: Sequence[float]) -> Value:
    """Return x - n (a + b + c)."""
    for part in parts:
        x = b.fma(n, -part, x)
    return x


def _sin_and_cos(b: Body, x: Value) -> Results:
    """Both, from what is left of multiples of pi / 2; the last bits say which is which."""
    m = b.fma(x, TWO_OVER_PI, ROUND)
    r = _less(b, x, b.sub(m, ROUND, exact=True), HALF_PI)
    z = b.mul(r, r)
    sine = b.muladd(b.mul(r, z), estrin(b, SIN, z), r)
    cosine = b.muladd(b.mul(z, z), estrin(b, COS, z), b.muladd(z, -0.5, 1.0))
    bits = b.bits(m)
    odd = b.is_negative(b.integer("shl", bits, 63))
    sign = -(2**63)
    in_sine = b.integer("and", b.integer("shl", bits, 62), sign)
    in_cosine = b.integer("and", b.integer("shl", b.integer("add", bits, 1), 62), sign)
    s = b.real(b.logic("xor", b.bits(b.select(odd, cosine, sine)), in_sine))
    c = b.real(b.logic("xor", b.bits(b.select(odd, sine, cosine)), in_cosine))
    # but the C library's values for the elements that are too large
    return b.unless_larger(x, LARGEST_ANGLE, {"sin": s, "cos": c})


def _sin(b: Body, x: Value) -> Results:
    """An odd polynomial of what is left of the nearest multiple of pi."""
    m = b.fma(x, 1 / math.pi, ROUND)
    return b.unless_larger(x, LARGEST_ANGLE, {"sin": _half_turn(b, x, m, 0.0, b.bits(m))})


def _cos(b: Body, x: Value) -> Results:
    """A sine from the nearest odd multiple of pi / 2 on."""
    m = b.add(b.fma(x, 1 / math.pi, -0.5), ROUND, exact=True)
    cosine = _half_turn(b, x, m, 0.5, b.integer("xor", b.bits(m), 1))
    return b.unless_larger(x, LARGEST_ANGLE, {"cos": cosine})


def _half_turn(b: Body, x: Value, m: Value, shift: float, sign: Value) -> Value:
    n = b.sub(m, ROUND, exact=True)
    n = b.add(n, shift, exact=True) if shift else n
    r = _less(b, x, n, PI)
    z = b.mul(r, r)
    y = b.muladd(b.mul(r, z), estrin(b, SIN_WIDE, z), r)
    return b.real(b.logic("xor", b.bits(y), b.integer("shl", sign, 63)))


# -- choices ---------------------------------------------------------------------------------------


def _extreme(how: str) -> Callable[[Body, Value, Value], Value]:
    def write(b: Body, x: Value, y: Value) -> Value:
        """The first if it is beyond the second, or NaN."""
        first = b.logic("or", b.compare(how, x, y), b.compare("uno", x, x))
        return b.select(first, x, y)

    return write


def _sign(b: Body, x: Value) -> Value:
    """-1, 0 or 1; NaN for NaN."""
    below = b.select(b.compare("olt", x, 0.0), -1.0, b.add(x, 0.0, exact=True))
    return b.select(b.compare("ogt", x, 0.0), 1.0, below)


def _heaviside(b: Body, x: Value, y: Value) -> Value:
    """0 or 1, at 0 the second; NaN for NaN."""
    x, y = b.same(x, y)
    here = b.select(b.compare("oeq", x, 0.0), y, x)
    below = b.select(b.compare("olt", x, 0.0), 0.0, here)
    return b.select(b.compare("ogt", x, 0.0), 1.0, below)


def _remainder(b: Body, x: Value, y: Value) -> Value:
    """NumPy's: it has the sign of the divisor, as Python's ``%``."""
    x, y = b.same(x, y)
    rest = b.each("fmod", x, y)
    signs = b.logic("xor", b.compare("olt", y, 0.0), b.compare("olt", rest, 0.0))
    other = b.logic("and", b.compare("one", rest, 0.0), signs)
    rest = b.select(other, b.add(rest, y), rest)
    return b.select(b.compare("oeq", rest, 0.0), b.intrinsic("copysign", 0.0, y), rest)


def _floor_divide(b: Body, x: Value, y: Value) -> Value:
    """NumPy's, from the exact remainder: right where x / y is rounded to an integer."""
    x, y = b.same(x, y)
    rest = b.each("fmod", x, y)
    quotient = b.op("fdiv", b.sub(x, rest, exact=True), y, exact=True)
    signs = b.logic("xor", b.compare("olt", y, 0.0), b.compare("olt", rest, 0.0))
    down = b.logic("and", b.compare("one", rest, 0.0), signs)
    quotient = b.select(down, b.sub(quotient, 1.0, exact=True), quotient)
    whole = b.intrinsic("floor", quotient)
    up = b.compare("ogt", b.sub(quotient, whole, exact=True), 0.5)
    whole = b.select(up, b.add(whole, 1.0, exact=True), whole)
    return b.select(b.compare("oeq", y, 0.0), b.op("fdiv", x, y, exact=True), whole)


def _logaddexp(b: Body, x: Value, y: Value) -> Value:
    """max(x, y) + ln(1 + e^-|x - y|), which neither overflows nor asks for inf - inf."""
    x, y = b.same(x, y)
    larger, apart = _extreme("ogt")(b, x, y), b.sub(x, y, exact=True)
    small = _call(b, "exp", _exp, b.sub(0.0, b.intrinsic("fabs", apart), exact=True))[0]
    rest = b.select(b.compare("oeq", x, y), math.log(2.0), b.each("log1p", small))
    return b.add(larger, rest, exact=True)


CALLED = {"exp": _exp, "exp2": _exp2, "tanh": _tanh, "sin": _sin, "cos": _cos}
INLINE = {
    "minimum": _extreme("olt"),
    "maximum": _extreme("ogt"),
    "logaddexp": _logaddexp,
    "sign": _sign,
    "heaviside": _heaviside,
    "remainder": _remainder,
    "floor_divide": _floor_divide,
}
