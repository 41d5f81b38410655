"""Functions of two intervals, with their partial derivatives: what balls know of hypot, %, ...

Every function takes two enclosures and returns one of the value and of both derivatives.  Where
it jumps between them the derivatives are without bounds, so that nobody takes it for smooth there;
where it has a corner they enclose the generalised gradient (Clarke).
"""

from collections.abc import Callable, Iterable

from flint import arb

Enclosed = tuple[arb, arb, arb]
_ANY, _ZERO, _ONE = arb(0, "inf"), arb(0), arb(1)
_UNIT = arb(0, 1)


def hull(values: Iterable[arb]) -> arb:
    """Return the smallest interval that holds others; everything if one is not finite."""
    union: arb | None = None
    for value in values:
        if not value.is_finite():
            return arb.nan() if value.is_nan() else _ANY
        union = value if union is None else union.union(value)
    assert union is not None
    return union


def _hypot(x: arb, y: arb) -> Enclosed:
    low = sum((arb(v.abs_lower()) ** 2 for v in (x, y)), arb(0))
    if not (x.is_finite() and y.is_finite()):
        return (x * y if x.is_nan() or y.is_nan() else _ANY), _UNIT, _UNIT
    high = sum((arb(v.abs_upper()) ** 2 for v in (x, y)), arb(0))
    value = low.max(arb(0)).sqrt().union(high.sqrt())
    if not low > 0:
        return value, _UNIT, _UNIT
    return value, _within_unit(x / value), _within_unit(y / value)


def _within_unit(slope: arb) -> arb:
    return slope.intersection(_UNIT) if slope.is_finite() else _UNIT


def _arctan2(y: arb, x: arb) -> Enclosed:
    if y.is_nan() or x.is_nan():
        return arb.nan(), _ANY, _ANY
    if y.contains(0) and not x > 0:
        return arb(0, arb.pi().upper()), _ANY, _ANY  # its cut, or the origin
    if not (y.is_finite() and x.is_finite()):
        return arb(0, arb.pi().upper()), _ANY, _ANY
    corners = [arb.atan2(a, b) for a in (y.lower(), y.upper()) for b in (x.lower(), x.upper())]
    square = x * x + y * y  # on a rectangle without the cut it is largest and least at corners
    return hull(corners), x / square, -y / square


def _remainder(x: arb, y: arb) -> Enclosed:
    return _rest(x, y, arb.floor, [_ZERO, y])


def _fmod(x: arb, y: arb) -> Enclosed:
    return _rest(x, y, lambda q: q.floor() if q >= 0 else q.ceil(), [-abs(y), abs(y)])


def _floor_divide(x: arb, y: arb) -> Enclosed:
    value = (x / y).floor()
    slope = _ZERO if value.is_exact() else _ANY  # between integers it is one number
    return value, slope, slope


def _rest(x: arb, y: arb, rounded: Callable[[arb], arb], ends: list[arb]) -> Enclosed:
    """Return what division by y leaves of x; between `ends` where several quotients are met."""
    quotient = x / y
    if quotient.is_finite():
        low, high = rounded(quotient.lower()), rounded(quotient.upper())
        if low.is_exact() and high.is_exact() and low == high:
            return x - y * low, _ONE, -low
    if not y.is_finite() or y.contains(0):
        return arb.nan(), _ANY, _ANY
    return hull(ends), _ANY, _ANY


def _copysign(x: arb, y: arb) -> Enclosed:
    size = abs(x)
    if y > 0 or y < 0:
        sign = arb(1 if y > 0 else -1)
        slope = sign * (_ONE if x > 0 else -_ONE if x < 0 else _UNIT)
        return sign * size, slope, _ZERO
    return hull([size, -size]), _UNIT, _ANY  # -0.0 has a sign of its own, too


def _heaviside(x: arb, h: arb) -> Enclosed:
    if x > 0 or x < 0:
        return arb(1 if x > 0 else 0), _ZERO, _ZERO
    if x.is_zero():
        return h, _ANY, _ONE
    return hull([_ZERO, _ONE, h]), _ANY, hull([_ZERO, _ONE])


def _logaddexp(x: arb, y: arb) -> Enclosed:
    if not (x.is_finite() and y.is_finite()):
        return (arb.nan() if x.is_nan() or y.is_nan() else _ANY), _UNIT, _UNIT

    def at(a: arb, b: arb) -> arb:
        return a.max(b) + (-abs(a - b)).exp().log1p()

    value = hull([at(x.lower(), y.lower()), at(x.upper(), y.upper())])  # it grows with both
    share = hull([_logistic(x.lower() - y.upper()), _logistic(x.upper() - y.lower())])
    return value, share, 1 - share


def _logistic(x: arb) -> arb:
    return 1 / (1 + (-x).exp()) if x >= 0 else x.exp() / (1 + x.exp())


def real_power(x: arb, y: arb, from_zero: bool = False) -> Enclosed:
    """Enclose x^y for x >= 0 and any y; not a number for x < 0, as NumPy has it."""
    if x > 0:
        log = x.log()
        value = (log * y).exp()
        return value, y * ((y - 1) * log).exp(), value * log
    if not x.is_finite() or not (from_zero or x.lower() >= 0) or not y.is_finite() or not y > 0:
        return arb.nan(), _ANY, _ANY
    top = arb(x.upper())
    if top.is_zero():
        return _ZERO, _ANY, _ANY
    ends = [(top.log() * e).exp() for e in (y.lower(), y.upper())]
    value = hull([_ZERO, *ends])
    steep = hull([_ZERO, *((y * ((e - 1) * top.log()).exp()) for e in (y.lower(), y.upper()))])
    return value, steep if y >= 1 else _ANY, _ANY


FUNCTIONS_OF_TWO: dict[str, Callable[[arb, arb], Enclosed]] = {
    "hypot": _hypot,
    "arctan2": _arctan2,
    "remainder": _remainder,
    "fmod": _fmod,
    "floor_divide": _floor_divide,
    "copysign": _copysign,
    "heaviside": _heaviside,
    "logaddexp": _logaddexp,
    "power": real_power,
}
