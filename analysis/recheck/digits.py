"""Numbers as text that says no more than they do: rounded to the safe side, or not rounded."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction


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
