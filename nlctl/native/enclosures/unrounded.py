"""A graph whose constants are numbers, not what floats round them to.

A graph evaluates what is made of constants, rounded as any float.  Within a function that is what
a run computes; but the derivative of 0.1 (0.3 x) is the product of both floats, and an enclosure of
it has to hold that.
"""

from __future__ import annotations

import math
from fractions import Fraction

from ...expressions.graph import COMPARISONS, LOGIC, Expr, Graph

_EXACT = (*COMPARISONS, *LOGIC, "select", "neg", "absolute", "minimum", "maximum", "floor", "ceil",
          "trunc", "rint", "sign", "copysign", "heaviside")  # fmt: skip
_SUMS = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b if b else None,
}


class UnroundedGraph(Graph):
    """A graph that evaluates operations on constants only where nothing is rounded."""

    def op(self, name: str, *args: Expr) -> Expr:
        """Return an operation on numbers, or on the elements of vectors."""
        constant = bool(args) and all(a.op == "const" and a.kind == "f" for a in args)
        if constant and name not in _EXACT and not _is_exact(name, args, super().op):
            return self.node(name, *args)
        return super().op(name, *args)


def _is_exact(name: str, args: tuple[Expr, ...], fold: object) -> bool:
    """Whether an operation on constants gives a float, or none at all."""
    values = [a.data for a in args]
    if not all(map(math.isfinite, values)):
        return True
    if name not in _SUMS:
        return False
    exact = _SUMS[name](*map(Fraction, values))
    rounded = fold(name, *args).data  # type: ignore[operator]
    return exact is None or (math.isfinite(rounded) and Fraction(rounded) == exact)
