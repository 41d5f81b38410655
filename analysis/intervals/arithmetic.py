"""Balls (python-flint) that a block's own equations compute with, and their derivatives.

An equation sees a `Ball` as a number: arithmetic, comparisons and NumPy functions work, and the
result encloses every value that the equation takes for numbers inside the balls.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from contextvars import ContextVar
from typing import Any

import numpy as np
from flint import arb

from nlctl.expressions.functions import FUNCTIONS

from .numpy_functions import JUMPS, NumPyFunctions, enclosed_table, of_lifted
from .pairs import FUNCTIONS_OF_TWO, real_power
from .paths import Undecided, decided, meanwhile

__all__ = ["Ball", "NumPyFunctions", "as_ball", "common", "power"]


_ANY = arb(0, "inf")
# signs of a - b that a comparison of a and b allows
_ORDERS = {"lt": {-1}, "le": {-1, 0}, "gt": {1}, "ge": {0, 1}, "eq": {0}, "ne": {-1, 1}}
_NOT_NEGATIVE = ("sqrt", "exp", "cosh")
_ODD_AND_RISING = ("sinh", "tanh", "arctan", "arcsinh", "expm1", "log1p", "cbrt", "sign", "floor",
                   "ceil", "trunc", "rint")  # fmt: skip  # or of the sign of what they are of
_SINC_SLOPE = 1.3707  # above the largest slope of sin(pi x)/(pi x)
_QUIET: ContextVar[bool] = ContextVar("quiet", default=False)


def quiet() -> AbstractContextManager[Any]:
    """While a user's function runs its balls have no text: it would be another one of floats."""
    return meanwhile(_QUIET, True)


class Ball(NumPyFunctions):
    """An interval with the intervals of its partial derivatives.

    Attributes
    ----------
    value : flint.arb
    gradient : tuple of flint.arb
        Derivatives with respect to the coordinates of a box; empty for a constant.  Where a
        function has a corner they enclose its generalised gradient (Clarke).
    not_negative : bool
        Whether no value is below 0, whatever the rounding of `value` says: the radius of a ball is
        rounded up, and that of [0, 1] begins below 0, where a root has no value.

    Examples
    --------
    An equation takes it instead of a number, and its derivative comes along:

    >>> from flint import arb
    >>> from nlctl.analysis.intervals.arithmetic import Ball
    >>> x = Ball(arb(3.0), (arb(1.0),))
    >>> y = x * x + 1
    >>> float(y.value), float(y.gradient[0])
    (10.0, 6.0)
    """

    __slots__ = ("gradient", "not_negative", "value")
    rank = 0  # of the kinds of numbers that compute with each other

    def __init__(
        self, value: arb, gradient: tuple[arb, ...] = (), not_negative: bool = False
    ) -> None:
        self.value = value
        self.gradient = gradient
        self.not_negative = not_negative or bool(value >= 0)

    def known_not_negative(self, is_known: bool = True) -> Ball:
        """Return the ball with what is known of its sign besides its ends.

        Parameters
        ----------
        is_known : bool, optional
            Whether no value is below 0.

        Returns
        -------
        Ball
            The same where nothing is new.
        """
        return Ball(self.value, self.gradient, True) if is_known and not self.not_negative else self

    def __repr__(self) -> str:
        if _QUIET.get():
            raise TypeError("asks for the text of its argument")
        return f"Ball({self.value}, {self.gradient})"

    __str__ = __repr__

    def __format__(self, form: str) -> str:
        return repr(self)

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

    @of_lifted
    def __add__(self, other: Ball) -> Any:
        result = self._joined(self.value + other.value, 1, other, 1)
        return result.known_not_negative(self.not_negative and other.not_negative)

    @of_lifted
    def __sub__(self, other: Ball) -> Any:
        if other is self and self.value.is_finite():
            return Ball(arb(0))  # one quantity, not two in the same range
        return self._joined(self.value - other.value, 1, other, -1)

    @of_lifted
    def __mul__(self, other: Ball) -> Any:
        if other is self:
            return self**2
        result = self._joined(self.value * other.value, other.value, other, self.value)
        return result.known_not_negative(self.not_negative and other.not_negative)

    @of_lifted
    def __truediv__(self, other: Ball) -> Any:
        value = self.value / other.value
        result = self._joined(value, 1 / other.value, other, -value / other.value)
        return result.known_not_negative(self.not_negative and other.not_negative)

    def __pow__(self, n: Any) -> Any:
        is_exact = isinstance(n, Ball) and n.value.is_exact() and not n.gradient
        return super().__pow__(float(n.value) if is_exact else n)

    def _whole_power(self, n: int) -> Ball:
        result = self.chain(power(self.value, n), n * power(self.value, max(n - 1, 0)))
        return result.known_not_negative(n % 2 == 0 or self.not_negative)

    def __abs__(self) -> Ball:
        return self.maximum(-self).known_not_negative()

    def minimum(self, other: Ball) -> Ball:
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
        other = as_ball(other)
        both = self.not_negative and other.not_negative
        return self._extreme(other, arb.min).known_not_negative(both)

    def maximum(self, other: Ball) -> Ball:
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
        other = as_ball(other)
        either = self.not_negative or other.not_negative
        return self._extreme(other, arb.max).known_not_negative(either)

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
            A function of the table that has an enclosure, such as ``sin``; or ``sinc``.

        Returns
        -------
        Ball
            With the derivatives by the chain rule; where it jumps within the ball they have no
            bound.
        """
        if name == "sinc":
            return self._sinc()
        row = FUNCTIONS[name]
        assert row.enclosure is not None
        not_negative = name in _NOT_NEGATIVE or (self.not_negative and name in _ODD_AND_RISING)
        if name == "sqrt" and self.not_negative and self.value.is_finite():
            value = self._root()
        else:
            value = row.enclosure(self.value)
        if name in JUMPS and not value.is_exact():
            low, high = (row.enclosure(end) for end in (self.value.lower(), self.value.upper()))
            if self.value.is_finite() and low.is_exact() and high.is_exact():
                value = low.union(high)
            return self.chain(value, _ANY).known_not_negative(not_negative)
        if not self.gradient:
            return Ball(value, (), not_negative)
        result = self.chain(value, as_ball(row.derivative[0](Ball(self.value))).value)
        return result.known_not_negative(not_negative)

    def _root(self) -> arb:
        """Return the root of what is not negative, of its ends."""
        ends = (arb(end).max(arb(0)).sqrt() for end in (self.value.lower(), self.value.upper()))
        low, high = ends
        return low.union(high)

    def _sinc(self) -> Ball:
        """Return sin(pi x)/(pi x)."""
        x = self.value
        value = x.sinc_pi() if x.is_finite() else arb(0, 1) if not x.is_nan() else arb.nan()
        slope, bound = arb.nan(), arb(0, _SINC_SLOPE)
        if x.is_finite() and not x.contains(0):
            slope = ((arb.pi() * x).cos() - x.sinc_pi()) / x
        return self.chain(value, common(slope, bound))

    def pair(self, name: str, other: Ball) -> Any:
        """Return phi of this ball and another one, for the NumPy function of that name.

        Parameters
        ----------
        name : str
            A function of `nlctl.analysis.intervals.pairs`.
        other : Ball or float
            The second argument.

        Returns
        -------
        Ball
            Where the function may jump, with derivatives without bound.
        """
        other = as_ball(other)
        if other is NotImplemented:
            return other
        if name == "power":
            rule = real_power(self.value, other.value, from_zero=self.not_negative)
        else:
            rule = FUNCTIONS_OF_TWO[name](self.value, other.value)
        value, by_self, by_other = rule
        result = self._joined(value, by_self, other, by_other)
        return result.known_not_negative(name in ("hypot", "power"))  # a real power has no sign

    def table(self, xp: tuple[float, ...], fp: tuple[float, ...]) -> Ball:
        """Return the linear interpolation of a table, constant beyond its ends.

        Parameters
        ----------
        xp, fp : tuple of m floats
            Increasing break points, and the values there.

        Returns
        -------
        Ball
            At break points the derivatives enclose those of both sides.
        """
        return self.chain(*enclosed_table(self.value, xp, fp))

    @staticmethod
    def lifted(number: object) -> Any:
        """Return a number as a ball.

        Parameters
        ----------
        number : float or Ball
            What is computed with.

        Returns
        -------
        Ball
            NotImplemented for what is not a number.
        """
        return as_ball(number)

    def _compared(self, order: str, other: Ball) -> Any:
        given, other, holds = other, as_ball(other), _ORDERS[order]
        if other is NotImplemented:
            return other
        a, b = self.value, other.value
        if a.is_nan() or b.is_nan():
            raise Undecided(
                "a comparison with a ball that is not a number (a division by 0, perhaps)"
            )
        if given is self:
            return 0 in holds
        possible = {k for k, no in ((-1, a >= b), (0, a != b), (1, a <= b)) if not no}
        key = (self, given if given is other else b)
        return decided(possible, holds, key, f"{order}({a}, {b})")


def common(a: arb, b: arb) -> arb:
    """Return what two enclosures of one set have in common; what is not finite encloses all."""
    if a.is_finite() and b.is_finite():
        return a.intersection(b)
    return a if a.is_finite() else b


def of_unknown_slope(value: arb, like: Ball) -> Ball:
    """Return a factor whose own derivatives are not known, of as many as another ball has."""
    return Ball(value, () if value.is_exact() else (_ANY,) * len(like.gradient))


def power(x: arb, n: int) -> arb:
    """Return x^n for n >= 0 from the ends of x (flint's own power of a ball around 0 is NaN).

    Examples
    --------
    >>> from flint import arb
    >>> from nlctl.analysis.intervals.arithmetic import power
    >>> square = power(arb(0, 2), 2)  # of [-2, 2]
    >>> abs(float(square.lower())) < 1e-6 and 4.0 <= float(square.upper()) < 4.0001
    True
    """
    if not x.is_finite():
        return arb.nan() if x.is_nan() else arb(1) if n == 0 else arb(0, "inf")
    low, high = x.lower() ** n, x.upper() ** n
    around = low.union(high)
    return around.union(arb(0)) if n > 0 and n % 2 == 0 and x.contains(0) else around


def as_ball(x: object) -> Any:
    """Return a number as a ball without width; NotImplemented for what is not a number.

    Examples
    --------
    >>> from nlctl.analysis.intervals.arithmetic import as_ball
    >>> float(as_ball(0.5).value), as_ball("x")
    (0.5, NotImplemented)
    """
    if isinstance(x, Ball):
        return x
    if isinstance(x, arb):
        return Ball(x)
    if isinstance(x, np.ndarray) and not x.ndim:  # of np.where
        return as_ball(x.item())
    if isinstance(x, int | float | np.integer | np.floating | np.bool_):
        return Ball(arb(float(x)))
    return NotImplemented
