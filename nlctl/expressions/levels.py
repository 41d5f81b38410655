"""Where a number is at a level, what it is made of is at another one.

2 e^(-z^2) + 1 > c where -z^2 > log((c - 1) / 2): what may be a narrow peak, or flat around 0, is
undone from the outside, until a number is left that moves as gently as what it is made of.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .edges import is_square
from .graph import Expr, Graph
from .sharp import as_power

_STEEP = 3  # exponents from which on a power is too flat around 0 to be followed there
_BLURRED = 1e3  # times rounding: a level so uncertain is not where the number itself says it is
# inverses of functions that rise, and by how much the rounding of a level is larger in them
_INVERSE = {
    "exp": (math.log, lambda level, inner: 1.0 / abs(inner)),
    "log": (math.exp, lambda level, inner: abs(level)),
    "tanh": (math.atanh, lambda level, inner: abs(level / inner) / (1.0 - level * level)),
}


class AtLevel(NamedTuple):
    """Where a number is compared with what does not vary."""

    number: Expr
    level: Expr
    falls: bool = False  # whether it falls where what it has been made from rises
    is_blurred: bool = False

    def difference(self, graph: Graph) -> Expr:
        """Return how far above its level is what the number has been made from, by the number."""
        pair = [self.number, self.level]
        return graph.op("sub", *(pair[::-1] if self.falls else pair))


def undone(graph: Graph, at: AtLevel) -> AtLevel | None:
    """Return where what a number is made of is at a level, None if only sums would be undone."""
    # Of these a number that is left alone is as it is written, so that no rounding comes in.
    known = None
    while (step := _step(graph, at.number, at.level)) is not None:
        to, is_line = step
        blurred = at.is_blurred or to.is_blurred
        at = to._replace(falls=to.falls != at.falls, is_blurred=blurred)
        if not is_line or is_square(at.number):
            known = at
    return known


def factors_of_difference(graph: Graph, expr: Expr) -> tuple[Expr, ...]:
    """Return what changes its sign where a difference does: z - r and -r - z of z^2 - r^2."""
    # What is undone of a blurred level says about where: steps end there, and see the difference.
    if expr.op != "sub":
        return (expr,)
    first, second = expr.args
    for at in (AtLevel(first, second), AtLevel(second, first, True)):
        if at.level.varies:
            continue
        if is_square(at.number):
            return _at_both_roots(graph, at) or (expr,)
        inner = undone(graph, at)
        if inner is not None:
            of_inner = factors_of_difference(graph, inner.difference(graph))
            return (expr, *of_inner) if inner.is_blurred else of_inner
    return (expr,)


def _at_both_roots(graph: Graph, at: AtLevel) -> tuple[Expr, ...]:
    """Return two differences of what is squared, none where the square is never at the level."""
    if at.level.op == "const" and not at.level.data > 0.0:
        return ()
    z = graph.number(at.number.args[0])
    root = graph.op("sqrt", graph.op("maximum", at.level, graph.const(0.0)))
    pairs = ((z, root), (graph.op("neg", root), z))
    return tuple(AtLevel(*pair, at.falls).difference(graph) for pair in pairs)


def _step(graph: Graph, number: Expr, level: Expr) -> tuple[AtLevel, bool] | None:
    """Return a level of what is one operation further inside, and whether that is a line."""
    if not number.varies or level.varies:
        return None
    args = [graph.number(arg) for arg in number.args]
    if number.op in ("sqrt", "hypot") and level.op == "const" and not level.data >= 0.0:
        return None  # it never is
    if number.op == "sqrt":
        return AtLevel(args[0], graph.op("mul", level, level)), False
    if number.op == "hypot":
        squares = (graph.op("mul", arg, arg) for arg in args)
        return AtLevel(graph.op("add", *squares), graph.op("mul", level, level)), False
    if level.op == "const" and (inner := _inverse(graph, number, float(level.data))):
        return inner, False
    line = _line(graph, number.op, args, level)
    return None if line is None else (line, True)


def _inverse(graph: Graph, number: Expr, level: float) -> AtLevel | None:
    """Return the level of what a function that rises is of, or of the root of a power."""
    if number.op in _INVERSE:
        inverse, larger = _INVERSE[number.op]
        try:
            inner = inverse(level)
        except (ValueError, OverflowError):  # it never is
            return None
        is_blurred = inner == 0.0 or larger(level, inner) > _BLURRED
        return AtLevel(graph.number(number.args[0]), graph.const(inner), is_blurred=is_blurred)
    base, exponent = as_power(number)
    if exponent < _STEEP or not (level > 0.0 or exponent % 2):
        return None
    base, root = graph.number(base), math.copysign(abs(level) ** (1.0 / exponent), level)
    if exponent % 2:
        return AtLevel(base, graph.const(root))
    return AtLevel(graph.op("mul", base, base), graph.const(root * root))


def _line(graph: Graph, op: str, args: list[Expr], level: Expr) -> AtLevel | None:
    """Return the level of what is multiplied, or added to what does not vary."""
    if op == "neg":
        return AtLevel(args[0], graph.op("neg", level), True)
    if op not in ("add", "sub", "mul", "div") or all(arg.varies for arg in args):
        return None
    first = args[0].varies
    number, other = args if first else args[::-1]
    if op in ("mul", "div"):
        if other.op != "const" or other.data == 0.0 or (op == "div" and not first):
            return None
        rest = graph.op("div" if op == "mul" else "mul", level, other)
        return AtLevel(number, rest, other.data < 0.0)
    rest = graph.op("sub", level, other)
    if op == "sub":
        rest = graph.op("add", level, other) if first else graph.op("sub", other, level)
    known = other.op == rest.op == "const"
    is_blurred = not known or abs(float(other.data)) > _BLURRED * abs(float(rest.data))
    return AtLevel(number, rest, op == "sub" and not first, is_blurred)
