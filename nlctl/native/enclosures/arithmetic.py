"""Intervals as pairs of values, and arithmetic, comparisons and choices of them."""

from collections.abc import Callable
from dataclasses import dataclass

from ..codegen.ir.functions import applied
from ..codegen.ir.text import Body, Value, constant
from .rounding import larger, outwards, product_outwards, smaller

NAN = float("nan")


@dataclass(frozen=True, kw_only=True)
class Ends:
    """An interval in every lane; or what is known of a truth value."""

    # its ends.  Of a truth value: whether it surely holds, and whether it possibly does
    low: Value
    high: Value
    point: float | None = None  # of a constant, what it is
    not_negative: bool = False  # whether no lane has a lower end below 0, whatever the box is

    @property
    def values(self) -> tuple[Value, Value]:
        """Both ends."""
        return self.low, self.high


def point_of(x: float, width: int) -> Ends:
    """Return a constant."""
    v = constant(x, width)
    return Ends(low=v, high=v, point=x, not_negative=x >= 0)


def routine(b: Body, name: str, make: Callable[..., Ends], *args: Ends) -> Ends:
    """Return what a rule makes of intervals; it is written once, as a function of a module."""
    known = "".join("c" if x.point is not None else "n" if x.not_negative else "p" for x in args)
    if "c" in known:
        return make(b, *args)
    full = f"{name}.{known}"

    def written(inner: Body, *ends: Value) -> tuple[Value, Value]:
        pairs = zip(ends[::2], ends[1::2], args, strict=True)
        given = [Ends(low=v, high=w, not_negative=x.not_negative) for v, w, x in pairs]
        result = make(inner, *given)
        if result.not_negative:
            b.module.declared[f"; {full} is not negative"] = None
        return result.values

    low, high = b.called(full, written, [v for x in args for v in x.values], 2)
    return Ends(low=low, high=high, not_negative=f"; {full} is not negative" in b.module.declared)


def finite(x: Ends) -> Ends:
    """Return what can be computed with: an infinite constant becomes NaN."""
    return point_of(NAN, x.low.width) if x.point in (float("inf"), -float("inf")) else x


def truth(x: bool, width: int) -> Ends:
    """Return a truth value that is known."""
    v = constant(x, width, "b")
    return Ends(low=v, high=v)


# -- sums ------------------------------------------------------------------------------------------


def add(b: Body, x: Ends, y: Ends) -> Ends:
    x, y = finite(x), finite(y)
    sums = (b.add(v, w, exact=True) for v, w in zip(x.values, y.values, strict=True))
    low, high = outwards(b, *sums)
    return Ends(low=low, high=high, not_negative=x.not_negative and y.not_negative)


def sub(b: Body, x: Ends, y: Ends) -> Ends:
    if x is y:  # one quantity, not two in the same range: 0 where it is finite
        low, high = (b.sub(v, v, exact=True) for v in x.values)
        low = b.select(b.compare("uno", low, high), NAN, low)
        return Ends(low=low, high=low, not_negative=True)
    return add(b, x, neg(b, y))


def neg(b: Body, x: Ends) -> Ends:
    if x.point is not None:
        return point_of(-x.point, x.low.width)
    return Ends(low=b.neg(x.high), high=b.neg(x.low))


# -- products --------------------------------------------------------------------------------------


def mul(b: Body, x: Ends, y: Ends) -> Ends:
    """Return the product: of its ends two are enough where the sign of a factor is known."""
    # 0 times infinity is left out where another product of ends is known; the others hold all
    # limits.
    if x is y:
        return square_of(b, finite(x))
    x, y = finite(x), finite(y)
    if y.point is not None or (y.not_negative and x.point is None and not x.not_negative):
        x, y = y, x
    if x.point is not None and x.point < 0:
        return neg(b, mul(b, point_of(-x.point, x.low.width), y))
    if x.point == 0:
        zero = b.select(b.compare("uno", y.low, y.low), NAN, 0.0)
        return Ends(low=zero, high=zero, not_negative=True)
    low, high = product_outwards(b, *_ends_of_product(b, x, y))
    if x.not_negative and y.not_negative:
        product = Ends(low=larger(b, 0.0, low), high=high, not_negative=True)
        return product if x.point is not None else defined(b, b.compare("ord", low, high), product)
    if x.point is not None:
        return Ends(low=low, high=high)
    if x.not_negative:
        return defined(b, b.compare("ord", low, high), Ends(low=low, high=high))
    both = b.compare("oge", smaller(b, x.low, y.low), 0.0)  # a root of it shall be known to exist
    low = b.select(b.logic("and", both, b.compare("olt", low, 0.0)), 0.0, low)
    return Ends(low=low, high=high)


def _ends_of_product(b: Body, x: Ends, y: Ends) -> tuple[Value, Value]:
    times = lambda v, w: b.mul(v, w, exact=True)  # noqa: E731
    if x.point is not None or (x.not_negative and y.not_negative):
        return times(x.low, y.low), times(x.high, y.high)
    if x.not_negative:
        ends = []
        for choose, end in ((smaller, y.low), (larger, y.high)):
            first, last = times(x.high, end), times(x.low, end)
            ends.append(choose(b, first, _number_of(b, last, first)))
        return ends[0], ends[1]
    first, second, third, last = (times(v, w) for v in x.values for w in y.values)
    last = _number_of(b, last, first)  # it alone decides whether the ends are numbers
    low = smaller(b, first, smaller(b, second, smaller(b, third, last)))
    return low, larger(b, first, larger(b, second, larger(b, third, last)))


def _number_of(b: Body, v: Value, other: Value) -> Value:
    """Return a value, or another one where it is not a number."""
    return b.select(b.compare("uno", v, v), other, v)


def absolute_of(b: Body, x: Ends) -> Ends:
    """Return the absolute value."""
    if x.not_negative:
        return x
    mirrored = b.neg(x.high)
    low = larger(b, 0.0, larger(b, x.low, mirrored))
    return Ends(low=low, high=larger(b, b.neg(x.low), x.high), not_negative=True)


def square_of(b: Body, x: Ends) -> Ends:
    a = absolute_of(b, x)
    low, high = product_outwards(b, *(b.mul(v, v, exact=True) for v in a.values))
    return Ends(low=larger(b, 0.0, low), high=high, not_negative=True)


def div(b: Body, x: Ends, y: Ends) -> Ends:
    """Return the quotient; not a number where the divisor may be 0."""
    positive, negative = b.compare("ogt", y.low, 0.0), b.compare("olt", y.high, 0.0)
    x, y = finite(x), finite(y)
    mirrored = [neg(b, v) for v in (x, y)]
    above, below = (
        [b.select(negative, t, o) for t, o in zip(t.values, o.values, strict=True)]
        for t, o in zip(mirrored, (x, y), strict=True)
    )
    under = b.select(b.compare("oge", above[0], 0.0), below[1], below[0])
    over = b.select(b.compare("oge", above[1], 0.0), below[0], below[1])
    quotients = (b.op("fdiv", v, w, exact=True) for v, w in ((above[0], under), (above[1], over)))
    low, high = product_outwards(b, *quotients)
    signs = b.logic("and", b.compare("oge", above[0], 0.0), b.compare("olt", low, 0.0))
    low = b.select(signs, 0.0, low)
    exists = b.logic("and", b.logic("or", positive, negative), b.compare("ord", low, high))
    return defined(b, exists, Ends(low=low, high=high))


def defined(b: Body, exists: Value, x: Ends) -> Ends:
    """Return an interval where it exists, and what is not a number elsewhere."""
    low, high = (b.select(exists, v, NAN) for v in x.values)
    return Ends(low=low, high=high, not_negative=x.not_negative)


def root_of(b: Body, x: Ends) -> Ends:
    low, high = outwards(b, *(b.intrinsic("sqrt", v) for v in x.values))
    low = b.select(b.compare("olt", low, 0.0), 0.0, low)
    root = Ends(low=low, high=high, not_negative=True)
    return defined(b, b.compare("oge", x.low, 0.0), root)


# -- choices ---------------------------------------------------------------------------------------


def minimum(b: Body, x: Ends, y: Ends) -> Ends:
    return _extreme_of(b, x, y, "minimum", x.not_negative and y.not_negative, float("inf"))


def maximum(b: Body, x: Ends, y: Ends) -> Ends:
    return _extreme_of(b, x, y, "maximum", x.not_negative or y.not_negative, -float("inf"))


def _extreme_of(b: Body, x: Ends, y: Ends, name: str, signed: bool, neutral: float) -> Ends:
    """Return one of two values at either end; what is not a number wins."""
    for one, other in ((x, y), (y, x)):
        if one.point == neutral:
            return other
    x, y = finite(x), finite(y)
    low, high = (applied(b, name, v, w) for v, w in zip(x.values, y.values, strict=True))
    return Ends(low=low, high=high, not_negative=signed)


def hull_of(b: Body, x: Ends, y: Ends) -> Ends:
    """Return what holds both; not a number if one is none."""
    low, high = applied(b, "minimum", x.low, y.low), applied(b, "maximum", x.high, y.high)
    return Ends(low=low, high=high, not_negative=x.not_negative and y.not_negative)


def choice_of(b: Body, condition: Ends, x: Ends, y: Ends) -> Ends:
    """Return what a condition chooses, both where it is open."""
    x, y = finite(x), finite(y)
    both = hull_of(b, x, y)

    def chosen(v: Value, w: Value, neither: Value) -> Value:
        rest = b.select(condition.high, neither, w)
        return b.select(condition.low, v, rest)

    low, high = map(chosen, x.values, y.values, both.values)
    return Ends(low=low, high=high, not_negative=both.not_negative)


def select_truth(b: Body, condition: Ends, x: Ends, y: Ends) -> Ends:
    """Return which truth value a condition chooses."""
    yes, no = logic(b, "and", condition, x), logic(b, "and", logic_not(b, condition), y)
    either, surely = logic(b, "or", yes, no), b.logic("and", x.low, y.low)
    return Ends(low=b.logic("or", either.low, surely), high=either.high)


def comparison_of(b: Body, op: str, x: Ends, y: Ends) -> Ends:
    """Return whether a comparison surely holds, and whether it possibly does."""
    # One with what is not a number is open.
    if op in ("gt", "ge"):
        x, y, op = y, x, {"gt": "lt", "ge": "le"}[op]
    if op in ("lt", "le"):
        low = b.compare(f"o{op}", x.high, y.low)
        return Ends(low=low, high=b.compare(f"u{op}", x.low, y.high))
    same = b.logic("and", b.compare("ole", x.high, y.low), b.compare("ole", y.high, x.low))
    meet = b.logic("and", b.compare("uge", x.high, y.low), b.compare("uge", y.high, x.low))
    equal = Ends(low=same, high=meet)
    return equal if op == "eq" else logic_not(b, equal)


def logic_not(b: Body, x: Ends) -> Ends:
    return Ends(low=negated(b, x.high), high=negated(b, x.low))


def negated(b: Body, v: Value) -> Value:
    return b.logic("xor", v, constant(True, v.width, "b"))


def logic(b: Body, op: str, x: Ends, y: Ends) -> Ends:
    """Return ``and``, ``or`` or ``xor`` of two truth values."""
    if op != "xor":
        low, high = (b.logic(op, v, w) for v, w in zip(x.values, y.values, strict=True))
        return Ends(low=low, high=high)
    one, other = logic(b, "and", x, logic_not(b, y)), logic(b, "and", logic_not(b, x), y)
    return logic(b, "or", one, other)


def left_open(b: Body, condition: Ends) -> Value:
    """Return where a condition is open."""
    return b.logic("and", condition.high, negated(b, condition.low))
