"""Balls (python-flint) that a block's own equations compute with, and their derivatives.

An equation sees a `Ball` as a number: arithmetic, comparisons and NumPy functions work, and the
result encloses every value that the equation takes for numbers inside the balls.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from flint import arb

from nlctl.expressions.functions import FUNCTIONS

from .paths import Undecided, branch

__all__ = ["Ball", "NumPyFunctions", "as_ball", "common", "power"]


def _function(name: str) -> Callable[[Any], Any]:
    def method(self: Any) -> Any:
        return self.apply(name)

    method.__doc__ = f"NumPy calls this for np.{name}(x)."
    return method


JUMPS = ("floor", "ceil", "sign")
_Comparison = Callable[[arb, arb], Any]


class NumPyFunctions:
    """What balls and difference quotients share: the functions that NumPy looks for.

    Those of one argument in the table `nlctl.expressions.functions` that have an enclosure, and
    minimum and maximum.
    """

    __slots__ = ()
    __hash__ = None  # type: ignore[assignment]  # equality may be undecided

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        if ufunc in (np.minimum, np.maximum):
            name = "minimum" if ufunc is np.minimum else "maximum"
            ufunc = np.frompyfunc(lambda a, b: _pairwise(name, a, b), 2, 1)
        return getattr(ufunc, method)(*map(_objects, inputs), **kwargs)


NumPyFunctions.__floor__ = _function("floor")  # type: ignore[attr-defined]  # NumPy looks for it
NumPyFunctions.__ceil__ = _function("ceil")  # type: ignore[attr-defined]
for _name, _row in FUNCTIONS.items():
    if _row.enclosure is not None and _row.count == 1:
        setattr(NumPyFunctions, _name, _function(_name))


def _objects(x: Any) -> np.ndarray:
    """Return an array of plain objects: NumPy's own numbers would ask the ball in turn."""
    plain = x.item() if isinstance(x, np.generic) else x
    array = np.asarray(plain, dtype=object)
    if isinstance(x, np.ndarray) and x.dtype != object:
        array[...] = np.reshape(np.array(x.tolist(), dtype=object), x.shape)
    return array


def _pairwise(name: str, a: Any, b: Any) -> Any:
    """Ask the operand that knows both: a ball knows numbers, a difference quotient balls, too."""
    if as_ball(a) is NotImplemented or not isinstance(b, NumPyFunctions):
        return getattr(a, name)(b)
    return getattr(b, name)(a)


class Ball(NumPyFunctions):
    """An interval with the intervals of its partial derivatives.

    Attributes
    ----------
    value : flint.arb
    gradient : tuple of flint.arb
        Derivatives with respect to the coordinates of a box; empty for a constant.  Where a
        function has a corner they enclose its generalised gradient (Clarke).

    Examples
    --------
    An equation takes it in the place of a number, and its derivative comes along:

    >>> from flint import arb
    >>> from analysis.intervals.arithmetic import Ball
    >>> x = Ball(arb(3.0), (arb(1.0),))
    >>> y = x * x + 1
    >>> float(y.value), float(y.gradient[0])
    (10.0, 6.0)
    """

    __slots__ = ("gradient", "value")

    def __init__(self, value: arb, gradient: tuple[arb, ...] = ()) -> None:
        self.value = value
        self.gradient = gradient

    def __repr__(self) -> str:
        return f"Ball({self.value}, {self.gradient})"

    def chain(self, value: arb, slope: arb) -> Ball:
        """Return `value` with the derivatives of self times `slope`.

        Parameters
        ----------
        value : arb
            Enclosure of phi of the ball.
        slope : arb
            Enclosure of the derivative of phi.

        Returns
        -------
        Ball
            With as many derivatives.
        """
        return Ball(value, tuple(slope * g for g in self.gradient))

    def _joined(self, value: arb, by_self: Any, other: Ball, by_other: Any) -> Ball:
        """Return a ball whose derivative is by_self self' + by_other other'."""
        if not other.gradient:
            return self.chain(value, by_self)
        if not self.gradient:
            return other.chain(value, by_other)
        pairs = zip(self.gradient, other.gradient, strict=True)
        return Ball(value, tuple(by_self * g + by_other * h for g, h in pairs))

    def __neg__(self) -> Ball:
        return Ball(-self.value, tuple(-g for g in self.gradient))

    def __pos__(self) -> Ball:
        return self

    def __add__(self, other: Any) -> Any:
        other = as_ball(other)
        if other is NotImplemented:
            return other
        return self._joined(self.value + other.value, 1, other, 1)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        if other is self and self.value.is_finite():
            return Ball(arb(0))  # one quantity, not two in the same range
        other = as_ball(other)
        if other is NotImplemented:
            return other
        return self._joined(self.value - other.value, 1, other, -1)

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __mul__(self, other: Any) -> Any:
        if other is self:
            return self**2
        other = as_ball(other)
        if other is NotImplemented:
            return other
        return self._joined(self.value * other.value, other.value, other, self.value)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        other = as_ball(other)
        if other is NotImplemented:
            return other
        value = self.value / other.value
        return self._joined(value, 1 / other.value, other, -value / other.value)

    def __rtruediv__(self, other: Any) -> Any:
        other = as_ball(other)
        return other if other is NotImplemented else other / self

    def __pow__(self, n: Any) -> Ball:
        if n != int(n):
            return (self.apply("log") * n).apply("exp")
        if n < 0:
            return 1 / self ** (-n)
        return self.chain(power(self.value, int(n)), int(n) * power(self.value, max(int(n) - 1, 0)))

    def __abs__(self) -> Ball:
        return self.maximum(-self)

    def minimum(self, other: Any) -> Ball:
        """Smaller one; where balls overlap, the derivative is one or the other.

        Parameters
        ----------
        other : Ball or float
            What it is compared with.

        Returns
        -------
        Ball
            Encloses both where they overlap.
        """
        return self._extreme(as_ball(other), arb.min)

    def maximum(self, other: Any) -> Ball:
        """Larger one; where balls overlap, the derivative is one or the other.

        Parameters
        ----------
        other : Ball or float
            What it is compared with.

        Returns
        -------
        Ball
            Encloses both where they overlap.
        """
        return self._extreme(as_ball(other), arb.max)

    def _extreme(self, other: Ball, choose: Callable[[arb, arb], arb]) -> Ball:
        a, b = self.value, other.value
        if not a.overlaps(b) and a.is_finite() and b.is_finite():
            return self if choose(a, b).overlaps(a) else other  # itself: x - max(x, y) is 0
        n = max(len(self.gradient), len(other.gradient))
        ga, gb = (x.gradient or (arb(0),) * n for x in (self, other))
        gradient = tuple(g.union(h) for g, h in zip(ga, gb, strict=True))
        if not (a.is_finite() and b.is_finite()):
            return Ball(a.union(b), gradient)
        low, high = choose(a.lower(), b.lower()), choose(a.upper(), b.upper())
        return Ball(low.union(high), gradient)

    def apply(self, name: str) -> Ball:
        """Return phi of the ball for the NumPy function of that name.

        Parameters
        ----------
        name : str
            A function of the table that has an enclosure, such as ``sin``.

        Returns
        -------
        Ball
            With the derivatives by the chain rule.

        Raises
        ------
        Undecided
            If the function may jump within the ball.
        """
        row = FUNCTIONS[name]
        assert row.enclosure is not None
        value = row.enclosure(self.value)
        if name in JUMPS and not value.is_exact():
            raise Undecided(f"{name}({self.value}) jumps")
        if not self.gradient:
            return Ball(value)
        return self.chain(value, as_ball(row.derivative[0](Ball(self.value))).value)

    def _compare(self, other: Any, yes: _Comparison, no: _Comparison) -> Any:
        """Return yes(self, other), where `no` is its negation; see `branch`."""
        other = as_ball(other)
        if other is NotImplemented:
            return other
        a, b = self.value, other.value
        if a.is_nan() or b.is_nan():
            raise Undecided(
                "a comparison with a ball that is not a number (a division by 0, perhaps)"
            )
        return branch(bool(yes(a, b)), bool(no(a, b)), f"{yes.__name__}({a}, {b})")

    def __lt__(self, other: Any) -> bool:
        return self._compare(other, operator.lt, operator.ge)

    def __le__(self, other: Any) -> bool:
        return self._compare(other, operator.le, operator.gt)

    def __gt__(self, other: Any) -> bool:
        return self._compare(other, operator.gt, operator.le)

    def __ge__(self, other: Any) -> bool:
        return self._compare(other, operator.ge, operator.lt)

    def __eq__(self, other: object) -> bool:
        return self._compare(other, operator.eq, operator.ne)

    def __ne__(self, other: object) -> bool:
        return self._compare(other, operator.ne, operator.eq)

    def __bool__(self) -> bool:
        return self != 0


def common(a: arb, b: arb) -> arb:
    """Return what two enclosures of one set have in common; what is not finite encloses all."""
    if a.is_finite() and b.is_finite():
        return a.intersection(b)
    return a if a.is_finite() else b


def power(x: arb, n: int) -> arb:
    """Return x^n for n >= 0 from the ends of x (flint's own power of a ball around 0 is NaN).

    Examples
    --------
    >>> from flint import arb
    >>> from analysis.intervals.arithmetic import power
    >>> square = power(arb(0, 2), 2)  # of [-2, 2]
    >>> abs(float(square.lower())) < 1e-6 and 4.0 <= float(square.upper()) < 4.0001
    True
    """
    if not x.is_finite():
        return arb.nan() if x.is_nan() else arb(1) if n == 0 else arb(0, "inf")
    low, high = x.lower() ** n, x.upper() ** n
    around = low.union(high)
    return around.union(arb(0)) if n > 0 and n % 2 == 0 and x.contains(0) else around


def as_ball(x: Any) -> Any:
    """Return a number as a ball without width; NotImplemented for what is not a number.

    Examples
    --------
    >>> from analysis.intervals.arithmetic import as_ball
    >>> float(as_ball(0.5).value), as_ball("x")
    (0.5, NotImplemented)
    """
    if isinstance(x, Ball):
        return x
    if isinstance(x, arb):
        return Ball(x)
    if isinstance(x, int | float | np.integer | np.floating | np.bool_):
        return Ball(arb(float(x)))
    return NotImplemented
