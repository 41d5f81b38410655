"""What NumPy finds in balls, difference quotients and sums: the functions of the catalogue.

Each kind of number has ``apply(name)`` for the functions of one argument of the table
`nlctl.expressions.functions`, ``pair(name, other)`` for those of two, ``minimum`` and ``maximum``,
and ``table(xp, fp)`` for a linear interpolation.
"""

import functools
import math
import operator
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb

from nlctl.expressions.functions import FUNCTIONS

from .pairs import FUNCTIONS_OF_TWO

_SINGLE = {name: row for name, row in FUNCTIONS.items() if row.enclosure and row.count == 1}
JUMPS = ("floor", "ceil", "sign", "trunc", "rint")


def calling(method: str, name: str) -> Callable[..., Any]:
    """Return what calls a method of a number with a name: NumPy looks for ``x.sin()``, say."""
    return lambda self, *others: getattr(self, method)(name, *others)


def of_lifted(operator: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return an operator that sees its second operand as one of the kind of the first."""

    @functools.wraps(operator)
    def method(self: Any, other: object) -> Any:
        lifted = self.lifted(other)
        return lifted if lifted is NotImplemented else operator(self, lifted)

    return method


class NumPyFunctions:
    """What balls, difference quotients and sums share: operators, and what NumPy looks for."""

    __slots__ = ()
    __hash__ = None  # type: ignore[assignment]  # equality may be undecided
    __neg__: Any  # what each kind has itself
    lifted: Any  # ``lifted(number)``: of this kind; NotImplemented for what is not a number
    apply: Any
    pair: Any
    table: Any
    _compared: Any  # ``_compared("lt", other)`` is ``self < other``, and so on

    __lt__, __le__ = calling("_compared", "lt"), calling("_compared", "le")
    __gt__, __ge__ = calling("_compared", "gt"), calling("_compared", "ge")
    __eq__, __ne__ = calling("_compared", "eq"), calling("_compared", "ne")
    __floor__, __ceil__ = calling("apply", "floor"), calling("apply", "ceil")
    __trunc__ = calling("apply", "trunc")
    __mod__, __floordiv__ = calling("pair", "remainder"), calling("pair", "floor_divide")

    def __pos__(self) -> Any:
        return self

    def __radd__(self, other: Any) -> Any:
        return self + other

    @of_lifted
    def __sub__(self, other: Any) -> Any:
        return self + -other

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __rmul__(self, other: Any) -> Any:
        return self * other

    @of_lifted
    def __rtruediv__(self, other: object) -> Any:
        return other / self

    def __pow__(self, n: Any) -> Any:
        if isinstance(n, NumPyFunctions) or n != int(n):
            return self.pair("power", n)
        return 1 / self**-n if n < 0 else self._whole_power(int(n))

    def _whole_power(self, n: int) -> Any:
        result = self.lifted(1)
        for _ in range(n):
            result = result * self
        return result

    def __bool__(self) -> bool:
        return self != 0

    def __array_ufunc__(self, ufunc: object, method: str, *inputs: object, **kwargs: object) -> Any:
        return getattr(_of_objects(ufunc), method)(*map(_objects, inputs), **kwargs)

    def __array_function__(
        self, function: Callable[..., Any], types: object, given: Any, named: Any
    ) -> Any:
        if function in _ARRAY_FUNCTIONS:
            return _ARRAY_FUNCTIONS[function](*given, **named)
        return function._implementation(*given, **named)

    def __rfloordiv__(self, other: object) -> Any:
        return self.lifted(other).pair("floor_divide", self)

    def __divmod__(self, other: object) -> Any:
        return self // other, self % other

    def __rmod__(self, other: object) -> Any:
        if isinstance(other, str):
            return NotImplemented
        return self.lifted(other).pair("remainder", self)

    def __rpow__(self, other: object) -> Any:
        return self.lifted(other) ** self

    def __round__(self, digits: int | None = None) -> Any:
        if digits:
            return NotImplemented
        return self.apply("rint")


for _name in _SINGLE:
    setattr(NumPyFunctions, _name, calling("apply", _name))
for _name in FUNCTIONS_OF_TWO:
    setattr(NumPyFunctions, _name, calling("pair", _name))


def _pairwise(name: str, a: Any, b: Any) -> Any:
    """Ask the operand that knows both: a ball knows numbers, a difference quotient balls, too."""
    kinds = [getattr(type(x), "rank", -1) for x in (a, b)]
    if max(kinds) < 0:
        return getattr(np, name)(a, b)
    if name in ("minimum", "maximum"):
        first, second = (a, b) if kinds[0] >= kinds[1] else (b, a)
        return getattr(first, name)(second)
    return (a if kinds[0] == max(kinds) else b.lifted(a)).pair(name, b)


def _single(name: str, function: Callable[..., Any], x: Any) -> Any:
    return x.apply(name) if isinstance(x, NumPyFunctions) else function(x)


@functools.cache
def _of_objects(ufunc: np.ufunc) -> Any:
    """Return a ufunc that asks objects what NumPy's own would compare, or refuse."""
    name = {"divmod": "", "float_power": "power"}.get(ufunc.__name__, ufunc.__name__)
    if name in _SINGLE and name != "absolute":
        return np.frompyfunc(functools.partial(_single, name, ufunc), 1, 1)
    if name == "fabs":
        return np.frompyfunc(abs, 1, 1)
    if name in ("deg2rad", "radians", "rad2deg", "degrees"):
        factor = math.pi / 180 if name in ("deg2rad", "radians") else 180 / math.pi
        return np.frompyfunc(lambda x: x * factor, 1, 1)
    if name == "power":
        return np.frompyfunc(operator.pow, 2, 1)
    if name == "logaddexp2":
        return np.frompyfunc(lambda a, b: _pairwise("logaddexp", a * _LN2, b * _LN2) / _LN2, 2, 1)
    if name in (*FUNCTIONS_OF_TWO, "minimum", "maximum", "fmin", "fmax"):
        name = {"fmin": "minimum", "fmax": "maximum"}.get(name, name)
        return np.frompyfunc(functools.partial(_pairwise, name), 2, 1)
    return ufunc


_LN2 = math.log(2)


def _objects(x: object) -> np.ndarray:
    """Return an array of plain objects: NumPy's own numbers would ask the ball in turn."""
    plain = x.item() if isinstance(x, np.generic) else x
    array = np.asarray(plain, dtype=object)
    if isinstance(x, np.ndarray) and x.dtype != object:
        array[...] = np.reshape(np.array(x.tolist(), dtype=object), x.shape)
    return array


def _interp(
    x: Any, xp: object, fp: object, left: object = None, right: object = None, period: object = None
):
    """Return np.interp of objects."""
    if left is not None or right is not None or period is not None:
        raise TypeError("np.interp with left, right or period has no enclosure")
    points = checked_table(xp, fp)
    if isinstance(x, NumPyFunctions):
        return x.table(*points)
    one = lambda v: v.table(*points) if isinstance(v, NumPyFunctions) else np.interp(v, *points)  # noqa: E731
    return np.frompyfunc(one, 1, 1)(x)


def checked_table(xp: Any, fp: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return break points and values of a table."""
    x, f = (tuple(map(float, np.ravel(a))) for a in (xp, fp))
    if len(x) != len(f) or not x or any(not a < b for a, b in pairwise(x)):
        raise TypeError("np.interp needs increasing break points, and as many values, of numbers")
    return x, f


def _sinc(x: Any) -> Any:
    """Return np.sinc of objects."""
    if isinstance(x, NumPyFunctions):
        return x.apply("sinc")
    return np.frompyfunc(lambda v: _single("sinc", np.sinc, v), 1, 1)(x)


_ARRAY_FUNCTIONS: dict[Any, Callable[..., Any]] = {np.interp: _interp, np.sinc: _sinc}


def enclosed_table(x: arb, xp: tuple[float, ...], fp: tuple[float, ...]) -> tuple[arb, arb]:
    """Return the value and the slopes of a linear interpolation on an interval."""
    if x.is_nan():
        return arb.nan(), arb.nan()
    low = x.lower() if x.is_finite() else arb(xp[0]) - 1
    high = x.upper() if x.is_finite() else arb(xp[-1]) + 1
    values = [_at(low, xp, fp), _at(high, xp, fp)]
    values += [arb(f) for a, f in zip(xp, fp, strict=True) if low <= a <= high]
    slopes = [
        (arb(f1) - f0) / (arb(x1) - x0)
        for x0, x1, f0, f1 in zip(xp, xp[1:], fp, fp[1:], strict=False)
        if low <= x1 and high >= x0
    ]
    slopes += [arb(0)] if low <= xp[0] or high >= xp[-1] else []
    value, slope = values[0], slopes[0]
    for other in values:
        value = value.union(other)
    for other in slopes:
        slope = slope.union(other)
    return value, slope


def _at(x: arb, xp: tuple[float, ...], fp: tuple[float, ...]) -> arb:
    """Return the interpolation at an end, which has no width."""
    if x <= xp[0]:
        return arb(fp[0])
    for x0, x1, f0, f1 in zip(xp, xp[1:], fp, fp[1:], strict=False):
        if x <= x1:
            return f0 + (x - x0) * (arb(f1) - f0) / (arb(x1) - x0)
    return arb(fp[-1])
