"""The table of interval rules: what each function of the table of functions makes of arithmetic.

A rule returns an interval, and where the function may jump within its arguments.  Functions that
rise or fall are known by their ends, periodic ones by their ends and the turning points between
them.  Outside of its domain a function has no value: the ends are not numbers.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from ..codegen.ir.functions import applied
from ..codegen.ir.text import Body, Value
from . import arithmetic
from .arithmetic import Ends
from .rounding import function_outwards, larger, smaller

_Result = tuple[Ends, Value | None]  # and where it may jump, if it may
_INF = float("inf")
_PI_UP = math.nextafter(math.pi, 4.0)


@dataclass(frozen=True, kw_only=True)
class Monotone:
    """A function that rises or falls."""

    rises: bool = True
    # where it is defined, whether at the ends of that, too, and bounds of what it gives: a pole is
    # no value, as 1/0 is none, and 0 log(0) is not a number
    domain: tuple[float, float] = (-_INF, _INF)
    closed: bool = True
    values: tuple[float, float] = (-_INF, _INF)
    odd: bool = False  # whether its value has the sign of its argument


MONOTONE = {
    "exp": Monotone(values=(0.0, _INF)),
    "exp2": Monotone(values=(0.0, _INF)),
    "expm1": Monotone(values=(-1.0, _INF), odd=True),
    "log": Monotone(domain=(0.0, _INF), closed=False),
    "log2": Monotone(domain=(0.0, _INF), closed=False),
    "log10": Monotone(domain=(0.0, _INF), closed=False),
    "log1p": Monotone(domain=(-1.0, _INF), closed=False, odd=True),
    "tanh": Monotone(values=(-1.0, 1.0), odd=True),
    "sinh": Monotone(odd=True),
    "arcsin": Monotone(domain=(-1.0, 1.0), odd=True),
    "arccos": Monotone(rises=False, domain=(-1.0, 1.0), values=(0.0, _INF)),
    "arctan": Monotone(odd=True),
    "arcsinh": Monotone(odd=True),
    "arccosh": Monotone(domain=(1.0, _INF), values=(0.0, _INF)),
    "arctanh": Monotone(domain=(-1.0, 1.0), closed=False, odd=True),
    "cbrt": Monotone(odd=True),
    "erf": Monotone(values=(-1.0, 1.0), odd=True),
    "erfc": Monotone(rises=False, values=(0.0, 2.0)),
}
STEPS = ("floor", "ceil", "trunc", "rint", "sign")


def interval_of(b: Body, name: str, *args: Ends) -> _Result:
    """Return what a function of the table makes of intervals, and where it may jump."""
    if name in CHOICE_RULES:
        return CHOICE_RULES[name](b, *args), None
    args = tuple(map(arithmetic.finite, args))
    if name in SMOOTH_RULES:
        return arithmetic.routine(b, name, SMOOTH_RULES[name], *args), None
    return JUMP_RULES[name](b, *args)


# -- functions of one argument ---------------------------------------------------------------------


def _by_ends(b: Body, x: Ends, name: str, known: Monotone) -> Ends:
    first, last = x.values if known.rises else reversed(x.values)
    low, high = function_outwards(b, *(applied(b, name, v) for v in (first, last)))
    if known.values[0] > -_INF:
        low = larger(b, known.values[0], low)
    if known.values[1] < _INF:
        high = smaller(b, known.values[1], high)
    if known.odd:
        low = b.select(
            b.logic("and", b.compare("oge", x.low, 0.0), b.compare("olt", low, 0.0)), 0.0, low
        )
        falls = b.logic("and", b.compare("ole", x.high, 0.0), b.compare("ogt", high, 0.0))
        high = b.select(falls, 0.0, high)
    signed = known.values[0] >= 0 or (known.odd and x.not_negative)
    ends = Ends(low=low, high=high, not_negative=signed)
    if known.domain == (-_INF, _INF):
        return ends
    first, last = known.domain
    above = b.compare("oge" if known.closed else "ogt", x.low, first)
    below = b.compare("ole" if known.closed or last == _INF else "olt", x.high, last)
    return arithmetic.defined(b, b.logic("and", above, below), ends)


def _steps(b: Body, x: Ends, name: str) -> _Result:
    low, high = (applied(b, name, v) for v in x.values)
    ends = Ends(low=low, high=high, not_negative=x.not_negative)
    return ends, b.compare("one", low, high)


def _cosh(b: Body, x: Ends) -> Ends:
    return _by_ends(b, arithmetic.absolute_of(b, x), "cosh", Monotone(values=(1.0, _INF)))


_TURN = 1 / (2 * math.pi)


def _turns(b: Body, v: Value, per: float, shift: float, side: int) -> Value:
    """Return v per + shift, rounded to one side: turns of a circle, for per = 1/pi or 1/(2 pi)."""
    # The factor is within 2^-53 of what it stands for, two roundings follow, |per| < 1/3 and
    # |shift| <= 1: their sum is below 2^-52 |v| + 2^-50.
    room = b.fma(b.intrinsic("fabs", v), side * 2.0**-52, side * 2.0**-50)
    return b.add(b.fma(v, per, shift), room, exact=True)


def _meets(b: Body, x: Ends, per: float, shift: float) -> Value:
    """Return where an integer may lie among x per + shift."""
    low, high = _turns(b, x.low, per, shift, -1), _turns(b, x.high, per, shift, 1)
    return b.compare("oge", b.intrinsic("floor", high), low)


def _circular(name: str, top: float) -> Callable[..., Ends]:
    """Return the rule of sine or cosine, whose maxima are `top` turns from 0."""

    def rule(b: Body, x: Ends) -> Ends:
        first, last = (applied(b, name, v) for v in x.values)
        low, high = function_outwards(b, smaller(b, first, last), larger(b, first, last))
        low, high = larger(b, -1.0, low), smaller(b, 1.0, high)
        low = b.select(_meets(b, x, _TURN, 0.5 - top), -1.0, low)
        high = b.select(_meets(b, x, _TURN, -top), 1.0, high)
        is_number = b.logic("and", b.compare("ord", x.low, x.high), b.compare("ord", low, high))
        return arithmetic.defined(b, is_number, Ends(low=low, high=high))

    return rule


def _tan(b: Body, x: Ends) -> Ends:
    low, high = function_outwards(b, *(applied(b, "tan", v) for v in x.values))
    without_pole = arithmetic.negated(b, _meets(b, x, 1 / math.pi, -0.5))
    exists = b.logic("and", without_pole, b.compare("ole", low, high))
    return arithmetic.defined(b, exists, Ends(low=low, high=high))


# -- functions of two arguments --------------------------------------------------------------------


def _hypot(b: Body, x: Ends, y: Ends) -> Ends:
    x, y = arithmetic.absolute_of(b, x), arithmetic.absolute_of(b, y)
    ends = zip(x.values, y.values, strict=True)
    low, high = function_outwards(b, *(applied(b, "hypot", v, w) for v, w in ends))
    is_number = b.logic("and", b.compare("ord", x.low, y.low), b.compare("ord", low, high))
    size = Ends(low=larger(b, 0.0, low), high=high, not_negative=True)
    return arithmetic.defined(b, is_number, size)


def _corners(b: Body, name: str, x: Ends, y: Ends) -> Ends:
    """Return the least and the greatest value at the corners of a rectangle."""
    ends = [(v, w) for v in set(x.values) for w in set(y.values)]
    ends = sorted(ends, key=lambda pair: (pair[0].text, pair[1].text))
    values = [applied(b, name, v, w) for v, w in ends]
    low = high = values[0]
    numbers = b.compare("ord", low, high)
    for value in values[1:]:
        low, high = smaller(b, value, low), larger(b, value, high)
        numbers = b.logic("and", numbers, b.compare("ord", value, value))
    low, high = function_outwards(b, low, high)
    return arithmetic.defined(b, numbers, Ends(low=low, high=high))


def _power(b: Body, x: Ends, y: Ends) -> Ends:
    """x^y = e^(y ln x), which is largest and least at corners; it needs x >= 0."""
    at_zero = b.logic("and", b.compare("oge", x.low, 0.0), b.compare("ogt", y.low, 0.0))
    exists = b.logic("or", b.compare("ogt", x.low, 0.0), at_zero)
    result = _corners(b, "power", x, y)
    result = Ends(low=larger(b, 0.0, result.low), high=result.high, not_negative=True)
    return arithmetic.defined(b, exists, result)


def _arctan2(b: Body, y: Ends, x: Ends) -> _Result:
    """Off its cut the angle is largest and least at corners."""
    level = b.logic("and", b.compare("ole", y.low, 0.0), b.compare("oge", y.high, 0.0))
    cut = b.logic("and", level, b.compare("ole", x.low, 0.0))
    angle = _corners(b, "arctan2", y, x)
    low, high = b.select(cut, -_PI_UP, angle.low), b.select(cut, _PI_UP, angle.high)
    return Ends(low=low, high=high), cut


def _rest(name: str) -> Callable[..., _Result]:
    """Return the rule of a remainder: x - y q, where q is x / y rounded by `name`."""

    def rule(b: Body, x: Ends, y: Ends) -> _Result:
        least, most = (applied(b, name, v) for v in arithmetic.div(b, x, y).values)
        q, jumps = Ends(low=least, high=most), b.compare("une", least, most)
        one = arithmetic.sub(b, x, arithmetic.mul(b, y, q))
        zero = arithmetic.point_of(0.0, x.low.width)
        other = arithmetic.absolute_of(b, y)
        sides = (zero, y) if name == "floor" else (other, arithmetic.neg(b, other))
        bound = arithmetic.hull_of(b, *sides)
        low = b.select(jumps, bound.low, larger(b, bound.low, one.low))
        high = b.select(jumps, bound.high, smaller(b, bound.high, one.high))
        is_number = b.logic("and", b.compare("ord", q.low, q.high), b.compare("ord", low, high))
        return arithmetic.defined(b, is_number, Ends(low=low, high=high)), jumps

    return rule


def _copysign(b: Body, x: Ends, y: Ends) -> _Result:
    a = arithmetic.absolute_of(b, x)
    mirrored = arithmetic.neg(b, a)
    positive, negative = b.compare("ogt", y.low, 0.0), b.compare("olt", y.high, 0.0)
    low = b.select(positive, a.low, mirrored.low)
    high = b.select(negative, mirrored.high, a.high)
    open_ = arithmetic.negated(b, b.logic("or", positive, negative))
    return arithmetic.defined(b, b.compare("ord", y.low, y.high), Ends(low=low, high=high)), open_


def _heaviside(b: Body, x: Ends, h: Ends) -> _Result:
    zero, one = arithmetic.point_of(0.0, x.low.width), arithmetic.point_of(1.0, x.low.width)
    after, before = b.compare("ogt", x.low, 0.0), b.compare("olt", x.high, 0.0)
    here = b.logic("and", b.compare("oeq", x.low, 0.0), b.compare("oeq", x.high, 0.0))
    every = arithmetic.hull_of(b, arithmetic.hull_of(b, zero, one), h)
    ends = []
    for all_, at in zip(every.values, h.values, strict=True):
        ends.append(b.select(after, 1.0, b.select(before, 0.0, b.select(here, at, all_))))
    jumps = arithmetic.negated(b, b.logic("or", b.logic("or", after, before), here))
    step = Ends(low=ends[0], high=ends[1])
    return arithmetic.defined(b, b.compare("ord", x.low, x.high), step), jumps


def _logaddexp(b: Body, x: Ends, y: Ends) -> Ends:
    """It rises with both: max(x, y) + ln(1 + e^-|x - y|) at the lower and at the upper ends."""

    def at(v: Value, w: Value) -> Ends:
        one, other = Ends(low=v, high=v), Ends(low=w, high=w)
        apart = arithmetic.neg(b, arithmetic.absolute_of(b, arithmetic.sub(b, one, other)))
        small = SMOOTH_RULES["log1p"](b, SMOOTH_RULES["exp"](b, apart))
        return arithmetic.add(b, arithmetic.maximum(b, one, other), small)

    low, high = at(x.low, y.low).low, at(x.high, y.high).high
    return arithmetic.defined(b, b.compare("ord", low, high), Ends(low=low, high=high))


# the first know an infinite constant, and the last may jump
CHOICE_RULES: dict[str, Callable[..., Ends]] = {
    "absolute": arithmetic.absolute_of,
    "minimum": arithmetic.minimum,
    "maximum": arithmetic.maximum,
}
SMOOTH_RULES: dict[str, Callable[..., Ends]] = {
    **{name: partial(_by_ends, name=name, known=known) for name, known in MONOTONE.items()},
    "sqrt": arithmetic.root_of,
    "cosh": _cosh,
    "sin": _circular("sin", 0.25),
    "cos": _circular("cos", 0.0),
    "tan": _tan,
    "hypot": _hypot,
    "power": _power,
    "logaddexp": _logaddexp,
}
JUMP_RULES: dict[str, Callable[..., _Result]] = {
    **{name: partial(_steps, name=name) for name in STEPS},
    "arctan2": _arctan2,
    "remainder": _rest("floor"),
    "fmod": _rest("trunc"),
    "floor_divide": lambda b, x, y: _steps(b, arithmetic.div(b, x, y), "floor"),
    "copysign": _copysign,
    "heaviside": _heaviside,
}
