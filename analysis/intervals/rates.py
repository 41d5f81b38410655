"""The rate V' = dV/dx . f along a direction: exact derivatives of a function that is enclosed.

A `Rate` carries a quantity q and q' through a function, each a `Ball`, so that the derivative is
that of the function itself and of nobody's formula.  At a corner of min, max or abs it encloses
both sides; where the function jumps, or compares what a box leaves open, there is none.
"""

from __future__ import annotations

from typing import Any

from flint import arb

from nlctl.expressions.functions import FUNCTIONS

from .arithmetic import Ball, as_ball, of_unknown_slope
from .numpy_functions import JUMPS, NumPyFunctions, enclosed_table, of_lifted
from .pairs import FUNCTIONS_OF_TWO
from .paths import undecided


def as_rate(x: object) -> Any:
    """Return a number as a quantity that does not change; NotImplemented for what is none."""
    if isinstance(x, Rate):
        return x
    ball = as_ball(x)
    return ball if ball is NotImplemented else Rate(ball, Ball(arb(0)))


class Rate(NumPyFunctions):
    """A quantity and its rate."""

    __slots__ = ("here", "rate")
    rank = 1

    def __init__(self, here: Ball, rate: Ball) -> None:
        self.here = here
        self.rate = rate

    def __neg__(self) -> Rate:
        return Rate(-self.here, -self.rate)

    @of_lifted
    def __add__(self, other: Rate) -> Any:
        return Rate(self.here + other.here, self.rate + other.rate)

    @of_lifted
    def __mul__(self, other: Rate) -> Any:
        if other is self:
            return self**2
        return Rate(self.here * other.here, self.here * other.rate + other.here * self.rate)

    @of_lifted
    def __truediv__(self, other: Rate) -> Any:
        value = self.here / other.here
        return Rate(value, (self.rate - value * other.rate) / other.here)

    def _whole_power(self, n: int) -> Rate:
        slope = n * self.here ** max(n - 1, 0)
        return Rate(self.here**n, slope * self.rate)

    def __abs__(self) -> Rate:
        return self._chosen(-self, abs(self.here))

    def minimum(self, other: Rate) -> Rate:
        """Smaller one; where that is open the rate is one or the other."""
        other = as_rate(other)
        return self._chosen(other, self.here.minimum(other.here))

    def maximum(self, other: Rate) -> Rate:
        """Larger one; where that is open the rate is one or the other."""
        other = as_rate(other)
        return self._chosen(other, self.here.maximum(other.here))

    def _chosen(self, other: Rate, value: Ball) -> Rate:
        for one in (self, other):
            if value is one.here:
                return Rate(value, one.rate)
        a, b = self.rate, other.rate
        n = max(len(a.gradient), len(b.gradient))
        both = (x.gradient or (arb(0),) * n for x in (a, b))
        gradient = tuple(arb(0, "inf") for _ in zip(*both, strict=True))  # it may jump from a to b
        return Rate(value, Ball(a.value.union(b.value), gradient))

    def apply(self, name: str) -> Rate:
        """Return phi of the quantity for the NumPy function of that name."""
        here = self.here.apply(name)
        if name in JUMPS or name == "sinc":
            slope = Ball(self.here.value, (arb(1),)).apply(name).gradient[0]
            return Rate(here, of_unknown_slope(slope, self.here) * self.rate)
        return Rate(here, as_ball(FUNCTIONS[name].derivative[0](self.here)) * self.rate)

    def pair(self, name: str, other: Rate) -> Any:
        """Return phi of this and another quantity for the NumPy function of that name."""
        other = as_rate(other)
        if other is NotImplemented:
            return other
        _, by_self, by_other = FUNCTIONS_OF_TWO[name](self.here.value, other.here.value)
        rate = Ball(arb(0))
        for one, slope in ((self, by_self), (other, by_other)):
            if not one.rate.value.is_zero():
                rate = rate + of_unknown_slope(slope, one.here) * one.rate
        return Rate(self.here.pair(name, other.here), rate)

    def table(self, xp: tuple[float, ...], fp: tuple[float, ...]) -> Rate:
        """Return the linear interpolation of a table."""
        _, slope = enclosed_table(self.here.value, xp, fp)
        return Rate(self.here.table(xp, fp), of_unknown_slope(slope, self.here) * self.rate)

    lifted = staticmethod(as_rate)

    def _compared(self, order: str, other: Rate) -> Any:
        """A choice between formulas may jump: only what the whole box decides is followed."""
        other = as_rate(other)
        if other is NotImplemented:
            return other
        with undecided():
            return self.here._compared(order, other.here)
