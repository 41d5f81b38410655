"""Bounds of numbers that were rounded to nearest.

Let s be the result of +, -, *, / or a root.  Where it is normal, what was rounded lies within half
a unit in the last place of s, so below the float after s.  That float is at most |s| 2^-52 away, a
unit in the last place at the least, so s + |s| 2^-52, rounded once by a fused operation, is not
below it.  Sums that are not normal are exact, and so is a sum of 0; a product or quotient that is
not normal is within 2^-1074, which is added first and changes no s above 2^-1021.  No rounding mode
is set, no operation has a flag that lets a compiler reorder or contract it.

An interval whose ends are not numbers stands for a value that may not exist; either both ends are
or none is.  To keep that, an infinite lower bound +inf, which overflow makes, becomes the largest
float before it is rounded outwards, and an upper one -inf the least.
"""

from ..codegen.ir.text import Body, Operand, Value

UNIT = 2.0**-52
TINY = 2.0**-1074
LARGEST_FLOAT = float.fromhex("0x1.fffffffffffffp1023")
# relative error of a function of one number, of this package or of the C library. It is 8 to 16
# units in the last place. Those of `codegen.ir.functions` are within 2.1
# (tests/expressions/test_ir_functions.py), which their argument reduction and polynomials explain:
# a reduced argument with a relative error of 2^-52, a polynomial within 2^-53 of the function,
# three roundings. For glibc the manual's table "Known Maximum Errors in Math Functions" has at most
# 2 for all that are called here, 4 for cbrt and 5 for erfc; musl's and Apple's are of the same
# origin or better. tests/native/enclosures/test_enclosed_functions.py compares all of them with
# python-flint on the machine at hand, at dense and at hard arguments
FUNCTION_ERROR = 2.0**-49
FUNCTION_FLOOR = 2.0**-1068  # the same where the result is not normal


def outwards(
    b: Body, low: Value, high: Value, *, unit: float = UNIT, first: float = 0.0, last: float = 0.0
) -> tuple[Value, Value]:
    """Return bounds of what sums or roots were before they were rounded to these ends."""
    # `first` and `last` are added as well, before a part `unit` of each end and behind it.
    ends = []
    for s, side, beyond in ((low, -1.0, "ogt"), (high, 1.0, "olt")):
        moved = b.add(s, side * first, exact=True) if first else s
        most = -side * LARGEST_FLOAT
        moved = b.select(b.compare(beyond, moved, most), most, moved)
        moved = b.fma(b.intrinsic("fabs", moved), side * unit, moved)
        ends.append(b.add(moved, side * last, exact=True) if last else moved)
    return ends[0], ends[1]


def product_outwards(b: Body, low: Value, high: Value) -> tuple[Value, Value]:
    """Return bounds of what products or quotients were before they were rounded to these ends."""
    return outwards(b, low, high, first=TINY)


def function_outwards(b: Body, low: Value, high: Value) -> tuple[Value, Value]:
    """Return bounds of a function whose computed values are these ends."""
    return outwards(b, low, high, unit=FUNCTION_ERROR, last=FUNCTION_FLOOR)


def smaller(b: Body, x: Operand, y: Value) -> Value:
    """Return the smaller one; the second where one is not a number, as the processor has it."""
    x, y = b.same(x, y) if isinstance(x, Value) else (b.wide(x, y.width), y)
    return b.select(b.compare("olt", x, y), x, y)


def larger(b: Body, x: Operand, y: Value) -> Value:
    """Return the larger one; the second where one is not a number."""
    x, y = b.same(x, y) if isinstance(x, Value) else (b.wide(x, y.width), y)
    return b.select(b.compare("ogt", x, y), x, y)
