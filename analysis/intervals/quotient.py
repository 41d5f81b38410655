"""Difference quotients in v: F(x, v)/v = (f(x, v) - f(x, 0))/v without a division by v.

A `Slope` carries a quantity at v, the same at v = 0, and their difference quotient, through the
equation.  Terms without v then have the quotient 0 exactly, the limit v -> 0 needs no care, and
the quotient has no pole for balls that contain v = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flint import arb

from nlctl.expressions.functions import FUNCTIONS

from .arithmetic import Ball, as_ball, common, of_unknown_slope
from .numpy_functions import JUMPS, NumPyFunctions, enclosed_table, of_lifted
from .pairs import FUNCTIONS_OF_TWO
from .paths import Undecided

_NOT = {"gt": "le", "ge": "lt", "ne": "eq"}  # what does not hold where these do


class Slope(NumPyFunctions):
    """A quantity q of an equation: q(v), q(0) and (q(v) - q(0)) / v, each a `Ball`."""

    __slots__ = ("base", "here", "quotient")
    rank = 1

    def __init__(self, here: Ball, base: Ball, quotient: Ball) -> None:
        self.here = here
        self.base = base
        self.quotient = quotient

    @property
    def is_constant(self) -> bool:
        """Whether the quantity does not depend on v."""
        return self.here is self.base

    def __neg__(self) -> Slope:
        return Slope(-self.here, -self.base, -self.quotient)

    @of_lifted
    def __add__(self, other: Slope) -> Any:
        return Slope(self.here + other.here, self.base + other.base, self.quotient + other.quotient)

    @of_lifted
    def __mul__(self, other: Slope) -> Any:
        if other.is_constant:  # not 0 times v, which is nothing where v is unbounded
            quotient = other.base * self.quotient
        elif self.is_constant:
            quotient = self.base * other.quotient
        else:
            quotient = _both(
                self.here * other.quotient + other.base * self.quotient,
                other.here * self.quotient + self.base * other.quotient,
            )
        return Slope(self.here * other.here, self.base * other.base, quotient)

    @of_lifted
    def __truediv__(self, other: Slope) -> Any:
        base = self.base / other.base
        quotient = (self.quotient - base * other.quotient) / other.here
        return Slope(self.here / other.here, base, quotient)

    def __abs__(self) -> Slope:
        return self if self >= 0 else -self

    def minimum(self, other: object) -> Any:
        """Smaller one, where that is decided."""
        return self if self <= other else other

    def maximum(self, other: object) -> Any:
        """Larger one, where that is decided."""
        return self if self >= other else other

    def pair(self, name: str, other: Slope) -> Any:
        """Return phi of this and another quantity for the NumPy function of that name."""
        # By the mean value theorem: the derivatives are those between v and 0.
        other = self.lifted(other)
        if other is NotImplemented:
            return other
        here, base = self.here.pair(name, other.here), self.base.pair(name, other.base)
        between = [a.here.value.union(a.base.value) for a in (self, other)]
        _, by_self, by_other = FUNCTIONS_OF_TWO[name](*between)
        quotient = Ball(arb(0))
        for one, slope in ((self, by_self), (other, by_other)):
            if not one.is_constant:
                quotient = quotient + one.quotient * of_unknown_slope(slope, one.quotient)
        return Slope(here, base, quotient)

    def table(self, xp: tuple[float, ...], fp: tuple[float, ...]) -> Slope:
        """Return the linear interpolation of a table."""
        here, base = self.here.table(xp, fp), self.base.table(xp, fp)
        _, slope = enclosed_table(self.here.value.union(self.base.value), xp, fp)
        return Slope(here, base, self.quotient * of_unknown_slope(slope, self.quotient))

    @staticmethod
    def lifted(number: object) -> Any:
        """Return a number as a quantity that does not depend on v."""
        if isinstance(number, Slope):
            return number
        ball = as_ball(number)
        return ball if ball is NotImplemented else Slope(ball, ball, Ball(arb(0)))

    def apply(self, name: str) -> Slope:
        """Return phi of the quantity for the NumPy function of that name."""
        if self.is_constant:
            base = self.base.apply(name)
            return Slope(base, base, Ball(arb(0)))
        here, base = self.here.apply(name), self.base.apply(name)
        secant = _secant(name, self.here, self.base, here, base)
        return Slope(here, base, secant * self.quotient)

    def _compared(self, order: str, other: Slope) -> Any:
        """A quotient exists within one branch only."""
        other = self.lifted(other)
        if other is NotImplemented:
            return other
        if order in _NOT:
            return not self._compared(_NOT[order], other)
        if order == "eq":
            return self._compared("le", other) and self._compared("ge", other)
        at_v = self.here._compared(order, other.here)
        if at_v != self.base._compared(order, other.base):
            raise Undecided("v and 0 lie on different branches of the equation")
        return at_v


def _secant(name: str, a: Ball, b: Ball, at_a: Ball, at_b: Ball) -> Ball:
    """Return (phi(a) - phi(b)) / (a - b), with the limit phi'(a) where a = b."""
    # It is the mean of phi' between a and b, so it lies in phi'(hull) and its derivatives with
    # respect to a and b lie in phi''(hull) / 2. Where a - b has no zero the quotient itself is an
    # enclosure as well.
    if name in JUMPS or name == "sinc":
        return _secant_of_jump(name, a, b, at_a, at_b)
    mean = as_ball(FUNCTIONS[name].derivative[0](Ball(a.value.union(b.value), (arb(1),))))
    half = (mean.gradient[0] if mean.gradient else arb(0)) / 2
    enclosure = (a + b).chain(mean.value, half)
    distance = a - b
    if distance.value.contains(0):
        return enclosure
    quotient = (at_a - at_b) / distance
    return _both(enclosure, quotient)


def _both(one: Ball, other: Ball) -> Ball:
    """Return what two enclosures of one quantity have in common."""
    pairs = zip(one.gradient, other.gradient, strict=False)
    gradient = tuple(common(g, h) for g, h in pairs) or one.gradient or other.gradient
    return Ball(common(one.value, other.value), gradient)


def _secant_of_jump(name: str, a: Ball, b: Ball, at_a: Ball, at_b: Ball) -> Ball:
    """Return (phi(a) - phi(b)) / (a - b) without a second derivative, or where phi may jump."""
    over = Ball(a.value.union(b.value), (arb(1),)).apply(name)
    mean, distance = over.gradient[0], a - b
    if not distance.value.contains(0):
        mean = common(mean, ((at_a - at_b) / distance).value)
    return of_unknown_slope(mean, distance)


def slope_in(function: Callable[..., Any], v: Any) -> Ball:
    """Return (q(v) - q(0)) / v for a function q of one number, as a ball."""
    result = function(Slope(as_ball(v), Ball(arb(0)), Ball(arb(1))))
    return result.quotient if isinstance(result, Slope) else Ball(arb(0))
