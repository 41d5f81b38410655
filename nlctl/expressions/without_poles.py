"""Quotients, and sums and products of them, as one fraction.

Next to a pole, or where a divisor makes a narrow bell of what is compared, no polynomial follows
it, so that a step could pass over a change of its sign.  The dividend of the fraction has neither.
"""

from __future__ import annotations

from typing import NamedTuple

from .graph import Expr, Graph, deduce, needed
from .signs import POSITIVE

_MOST = 4  # divisors of one fraction: with each the products become longer
# a divisor above 0 with these alone is of the size of what is divided; exponentials overflow
_OF_SIZE = ("add", "sub", "neg", "mul", "div", "sqrt", "hypot", "absolute", "sin", "cos")


class Fraction(NamedTuple):
    """A quotient: what is divided, by what has zeros, and by what is above 0."""

    dividend: Expr
    poles: Expr | None = None  # None where there are none
    above: Expr | None = None
    count: int = 0  # of divisors

    @property
    def is_whole(self) -> bool:
        """Whether nothing is divided."""
        return self.poles is None and self.above is None


def as_fraction(graph: Graph, expr: Expr) -> Fraction:
    """Return sums, products and quotients as one fraction, whatever else as it is."""
    fractions: dict[Expr, Fraction] = {}

    def fraction(node: Expr) -> Fraction:
        whole = _of_parts(graph, node, fractions)
        return whole if whole.count <= _MOST else Fraction(graph.number(node))

    return deduce(fractions, expr, lambda node: node.args if _combines(node) else (), fraction)


def compared(graph: Graph, a: Fraction, b: Fraction) -> Expr:
    """Return what has the sign of a - b, without poles."""
    # sign(p / q - r / s) is that of (p s - r q) q s
    difference = _sum(graph, "sub", a, b)
    return multiplied(graph, difference.dividend, difference.poles)


def multiplied(graph: Graph, factor: Expr, *others: Expr | None) -> Expr:
    """Return a product with those of the others that there are."""
    for other in others:
        factor = factor if other is None else graph.op("mul", factor, other)
    return factor


def _combines(expr: Expr) -> bool:
    return expr.varies and expr.op in ("neg", "add", "sub", "mul", "div")


def _of_parts(graph: Graph, expr: Expr, fractions: dict[Expr, Fraction]) -> Fraction:
    if expr.op == "tan" and expr.varies:
        return Fraction(graph.op("sin", expr.args[0]), graph.op("cos", expr.args[0]), count=1)
    if not _combines(expr):
        return Fraction(graph.number(expr))
    a, b = fractions[expr.args[0]], fractions[expr.args[-1]]
    divides = expr.op == "div" and expr.args[1].varies
    is_above = divides and expr.args[1].sign == POSITIVE
    stays = not divides or (is_above and not _is_of_size(expr.args[1]))
    if a.is_whole and b.is_whole and stays:
        return Fraction(graph.number(expr))
    if expr.op == "neg":
        return a._replace(dividend=graph.op("neg", a.dividend))
    if expr.op == "mul":
        return _over_both(graph, graph.op("mul", a.dividend, b.dividend), a, b)
    if expr.op != "div":
        return _sum(graph, expr.op, a, b)
    if stays:
        return a._replace(dividend=graph.op("div", a.dividend, graph.number(expr.args[1])))
    dividend, count = multiplied(graph, a.dividend, b.poles, b.above), a.count + b.count + 1
    if is_above:  # and what is divided there: both or neither are below 0
        return Fraction(dividend, a.poles, _both(graph, a.above, b.dividend), count)
    return Fraction(dividend, _both(graph, a.poles, b.dividend), a.above, count)


def _is_of_size(divisor: Expr) -> bool:
    return all(
        not node.varies or not node.args or node.op in _OF_SIZE for node in needed([divisor])
    )


def _sum(graph: Graph, op: str, a: Fraction, b: Fraction) -> Fraction:
    """Return a sum or difference over a divisor that both have."""
    if (a.poles, a.above) == (b.poles, b.above):
        return a._replace(dividend=graph.op(op, a.dividend, b.dividend))
    parts = [multiplied(graph, x.dividend, y.poles, y.above) for x, y in ((a, b), (b, a))]
    return _over_both(graph, graph.op(op, *parts), a, b)


def _over_both(graph: Graph, dividend: Expr, a: Fraction, b: Fraction) -> Fraction:
    """Return a dividend over the divisors of two fractions."""
    poles, above = _both(graph, a.poles, b.poles), _both(graph, a.above, b.above)
    return Fraction(dividend, poles, above, a.count + b.count)


def _both(graph: Graph, one: Expr | None, other: Expr | None) -> Expr | None:
    return other if one is None else multiplied(graph, one, other)
