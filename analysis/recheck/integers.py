"""Intervals of integers in units of 2^-96, rounded outward, their functions and digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from typing import Any

_UNIT = 1 << 96
_INF = math.inf
_FAR = _UNIT << 900  # no end has more digits, whatever powers a file has; floats go so far


def _product(a: int, b: int) -> Any:
    """Return a b, where an end at 0 wins over one without bound."""
    if not a or not b:
        return 0
    if abs(a) == _INF or abs(b) == _INF:
        return _INF if (a > 0) == (b > 0) else -_INF
    return a * b


class Interval:
    """All numbers from `low` to `high`, in units of 2^-96; none has an end beyond 2^900."""

    __slots__ = ("high", "low")

    def __init__(self, low: Any, high: Any) -> None:  # rounded outward
        self.low: Any = low if -_FAR <= low <= _FAR else _FAR if low > 0 else -_INF
        self.high: Any = high if -_FAR <= high <= _FAR else _INF if high > 0 else -_FAR

    @staticmethod
    def of(low: Any, high: Any = None) -> Interval:
        """Return the least interval around rational ends, which may be infinite."""
        high = low if high is None else high
        ends = (low if abs(low) == _INF else math.floor(low * _UNIT),
                high if abs(high) == _INF else math.ceil(high * _UNIT))  # fmt: skip
        return Interval(*ends)

    @property
    def top(self) -> Any:
        """The upper end, as a fraction."""
        return self.high if abs(self.high) == _INF else Fraction(self.high, _UNIT)

    @property
    def bottom(self) -> Any:
        """The lower end, as a fraction."""
        return self.low if abs(self.low) == _INF else Fraction(self.low, _UNIT)

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __add__(self, other: Interval) -> Interval:
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval) -> Interval:
        return self + -other

    def __mul__(self, other: Interval) -> Interval:
        ends = [_product(a, b) for a in (self.low, self.high) for b in (other.low, other.high)]
        low, high = min(ends), max(ends)
        return Interval(low if abs(low) == _INF else low // _UNIT,
                        high if abs(high) == _INF else -(-high // _UNIT))  # fmt: skip

    def __truediv__(self, other: Interval) -> Interval:
        if other.low <= 0 <= other.high:
            return ALL
        square = _UNIT * _UNIT
        low, high = (0 if abs(e) == _INF else Fraction(square, e) for e in (other.high, other.low))
        return self * Interval(math.floor(low), math.ceil(high))

    def hull(self, other: Interval) -> Interval:
        """Return the least interval around both."""
        return Interval(min(self.low, other.low), max(self.high, other.high))

    def meet(self, other: Interval) -> Interval:
        """Return what both have in common, where they enclose one set."""
        return Interval(max(self.low, other.low), min(self.high, other.high))

    def power(self, n: int) -> Interval:
        """Return the n-th power, n >= 0, from its ends; of an even one no value is negative."""
        base = absolute(self) if n % 2 == 0 else self
        low = high = UNITY
        for _ in range(n):
            low = low * Interval(base.low, base.low)
            high = high * Interval(base.high, base.high)
        return Interval(low.low, high.high)

    def monotone(
        self, function: Callable[[int], Interval], below: object, above: object
    ) -> Interval:
        """Return a rising function of all, with its limits where there is no end."""
        low = below if self.low == -_INF else function(self.low).low
        return Interval(low, above if self.high == _INF else function(self.high).high)


UNITY, ZERO, ALL = Interval(_UNIT, _UNIT), Interval(0, 0), Interval(-_INF, _INF)
TWO = Interval(2 * _UNIT, 2 * _UNIT)
WITHIN_ONE = Interval(-_UNIT, _UNIT)


def absolute(x: Interval) -> Interval:
    """Return |x|."""
    if x.low >= 0:
        return x
    return -x if x.high <= 0 else Interval(0, max(-x.low, x.high))


def _terms(coefficients: Iterable[Fraction]) -> tuple[Interval, ...]:
    return tuple(map(Interval.of, coefficients))


_ARTANH = _terms(Fraction(i % 2, max(i, 1)) for i in range(96))
_ARCTAN = _terms(Fraction((-1) ** (i // 2) * (i % 2), max(i, 1)) for i in range(96))
_REST = Interval(-(_UNIT >> 90), _UNIT >> 90)


def _series(x: Interval, terms: Iterable[Interval]) -> Interval:
    """Return a sum of powers, constant first, of which all that follows is below 2^-90."""
    total, power = ZERO, UNITY
    for term in terms:
        total, power = total + power * term if term.high else total, power * x
    return total + _REST


def _taylor(x: Interval, signs: tuple[int, ...]) -> Interval:
    """Return a sum of x^i / i! with these signs in turn, for |x| <= 4."""
    total, term = ZERO, UNITY
    for i in range(64):
        sign = signs[i % len(signs)]
        total = total + term if sign > 0 else total - term if sign < 0 else total
        term = term * x
        term = Interval(term.low // (i + 1), -(-term.high // (i + 1)))
    return total + _REST


def exp(x: Interval) -> Interval:
    """Return e^x."""

    def at(end: int) -> Interval:
        if abs(end) > 800 * _UNIT:
            return Interval(0, 1) if end < 0 else Interval(_UNIT << 1100, _INF)
        halved = Interval(end >> 10, -(-end >> 10))  # |x| < 1
        total = _taylor(halved, (1,))
        for _ in range(10):
            total = total * total
        return Interval(max(total.low, 0), total.high)

    return x.monotone(at, 0, _INF)


def sqrt(x: Interval) -> Interval:
    """Return the root, of what is negative by rounding 0."""

    def at(end: int) -> Interval:
        square = max(end, 0) * _UNIT
        root = math.isqrt(square)
        return Interval(root, root + (root * root < square))

    return ALL if x.low < 0 else x.monotone(at, 0, _INF)


_LN_2 = _series(Interval.of(Fraction(1, 3)), _ARTANH) * TWO
PI_ENCLOSED = (_series(Interval.of(Fraction(1, 5)), _ARCTAN) * Interval.of(16)
      - _series(Interval.of(Fraction(1, 239)), _ARCTAN) * Interval.of(4))  # fmt: skip


def log(x: Interval) -> Interval:
    """Return the natural logarithm."""

    def at(end: int) -> Interval:
        if end <= 0:
            return ALL
        n = end.bit_length() - _UNIT.bit_length()
        part = Interval.of(Fraction(end, _UNIT) / Fraction(2) ** n)  # 1 to 2
        return Interval.of(n) * _LN_2 + _series((part - UNITY) / (part + UNITY), _ARTANH) * TWO

    return ALL if x.low <= 0 else x.monotone(at, -_INF, _INF)


def arctan(x: Interval) -> Interval:
    """Return the inverse tangent."""

    def at(end: int) -> Interval:
        y = Interval(end, end)
        for _ in range(2):  # arctan y = 2 arctan(y / (1 + (1 + y^2)^(1/2)))
            y = y / (UNITY + sqrt(UNITY + y * y))
        return _series(y, _ARCTAN) * Interval.of(4)

    quarter = (PI_ENCLOSED * Interval.of(Fraction(1, 2))).high
    return x.monotone(at, -quarter, quarter)


def sin(x: Interval) -> Interval:
    """Return the sine."""
    whole = PI_ENCLOSED * TWO
    if not x.high - x.low < whole.low or abs(x.low) > _UNIT << 40:
        return WITHIN_ONE

    def at(end: int) -> Interval:
        y = Interval(end, end) - whole * Interval.of(round(Fraction(end, whole.low)))
        return _taylor(y, (0, 1, 0, -1)).meet(WITHIN_ONE)

    range_of_sine = at(x.low).hull(at(x.high))
    for share, extreme in ((Fraction(1, 4), _UNIT), (Fraction(-1, 4), -_UNIT)):
        turns = x / whole - Interval.of(share)
        if math.floor(turns.top) >= math.ceil(turns.bottom):
            range_of_sine = range_of_sine.hull(Interval(extreme, extreme))
    return range_of_sine


def cos(x: Interval) -> Interval:
    """Return the cosine."""
    return sin(x + PI_ENCLOSED * Interval.of(Fraction(1, 2)))


def tanh(x: Interval) -> Interval:
    """Return the hyperbolic tangent."""

    def at(end: int) -> Interval:
        return (UNITY - TWO / (exp(Interval(end, end) * TWO) + UNITY)).meet(WITHIN_ONE)

    return x.monotone(at, -_UNIT, _UNIT)


# functions with their derivatives, as far as a certificate may have them
_OfOne = Callable[[Interval], Interval]
KNOWN_FUNCTIONS: dict[str, tuple[_OfOne, _OfOne]] = {
    "exp": (exp, exp),
    "sin": (sin, cos),
    "cos": (cos, lambda x: -sin(x)),
    "tanh": (tanh, lambda x: (UNITY - tanh(x).power(2)).meet(Interval(0, _UNIT))),
    "sqrt": (sqrt, lambda x: UNITY / (TWO * sqrt(x))),
    "log": (log, lambda x: UNITY / x),
    "arctan": (arctan, lambda x: UNITY / (UNITY + x.power(2))),
    "absolute": (absolute, lambda x: WITHIN_ONE if x.low <= 0 <= x.high else
                 UNITY if x.low > 0 else -UNITY),
}  # fmt: skip


def text_above(number: float | Fraction, digits: int = 6) -> str:
    """Return the first digits of a number, rounded up: of an upper bound."""
    return _text(number, Context(prec=digits, rounding=ROUND_CEILING))


def text_below(number: float | Fraction) -> str:
    """Return the first digits of a number, rounded down: of a lower bound, or of a proved set."""
    return _text(number, Context(prec=6, rounding=ROUND_FLOOR))


def exact_text(number: float | Fraction) -> str:
    """Return all digits that the float nearest to a number has: of a premise."""
    return repr(float(number)).removesuffix(".0")


def _text(number: float | Fraction, rounded: Context) -> str:
    if isinstance(number, Fraction):
        moved = rounded.divide(Decimal(number.numerator), Decimal(number.denominator))
    else:  # 0.1 is the float of that name
        moved = rounded.plus(Decimal(repr(float(number))))
    return f"{float(moved):.{rounded.prec}g}"
