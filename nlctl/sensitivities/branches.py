"""On which side of a jump equations are: an integer that is kept while they stay there.

Of a comparison it is whether it holds, of `sign` its value, of `floor` and `%` how many whole ones
there are.  With it the equations can be had as they were right before a jump, at the very point
where they have jumped.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..expressions.conditions import JUMPING, asks_for_number, conditions, number_rooted
from ..expressions.graph import Expr, Graph, needed

_ORDERS = {"gt": 1.0, "ge": 1.0, "lt": -1.0, "le": -1.0}
_WHOLE = ("floor", "ceil", "trunc", "rint")
_QUOTIENTS = {"remainder": "floor", "fmod": "trunc"}
_FAR = 1e300
_JUMPS = (*_ORDERS, *JUMPING)


@dataclass(frozen=True, kw_only=True)
class Branch:
    """One side of a jump."""

    now: Expr  # the side that the arguments are on
    level: Expr  # what is 0 where the side is left, and smooth there
    extent: Expr  # of what size the numbers are that it is the difference of
    margin: Expr  # at least 0 as long as the arguments are on the side that is kept
    value: Expr  # the operation, with the side that is kept


def jumping(exprs: Iterable[Expr]) -> list[Expr]:
    """Return the operations that may jump in expressions, parts first."""
    # What asks whether a root is a number has NaN on its other side, and no run comes there.
    nodes = conditions(exprs)
    return [node for node in nodes if node.op in _JUMPS and not asks_for_number(node)]


def by_comparisons(graph: Graph, exprs: Sequence[Expr]) -> list[Expr]:
    """Return expressions with comparisons in the places of `abs`, `max` and `min`."""
    new: dict[Expr, Expr] = {}
    for node in needed(exprs):
        args = [new.get(arg, arg) for arg in node.args]
        root = number_rooted(node)
        if node.varies and (node.op in ("maximum", "minimum", "absolute") or root is not None):
            one = graph.number(args[0] if root is None else new.get(root, root))
            both = node.op in ("maximum", "minimum")
            other = graph.number(args[1]) if both else graph.op("neg", one)
            order = graph.op("lt" if node.op == "minimum" else "gt", one, other)
            new[node] = graph.op("select", order, one, other)
        elif tuple(args) != node.args:
            new[node] = graph.like(node, *args)
    return [new.get(e, e) for e in exprs]


def branch_of(graph: Graph, op: str, args: Sequence[Expr], kept: Expr) -> Branch:
    """Return the side of an operation."""
    numbers = [graph.number(arg) for arg in args]
    if op in _ORDERS:
        return _of_order(graph, op, numbers, kept)
    if op in _WHOLE or op == "floor_divide":
        z, rounding = (graph.op("div", *numbers), "floor") if len(numbers) > 1 else (*numbers, op)
        level, margin = _beyond(graph, rounding, z), _within(graph, rounding, z, kept)
        return _side_of(graph, graph.op(op, *numbers), level, [z], margin, kept)
    if op in _QUOTIENTS:
        over, under = numbers
        z, rounding = graph.op("div", over, under), _QUOTIENTS[op]
        rest = graph.op(op, over, under)
        whole = graph.op("sub", over, rest)
        now = graph.op("rint", graph.op("div", whole, under))  # as many as the operation takes off
        other = graph.op("sub", over, graph.op("mul", kept, under))
        value = graph.op("select", graph.op("eq", kept, now), rest, other)  # to the last digit
        level, margin = _beyond(graph, rounding, z), _within(graph, rounding, z, kept)
        return _side_of(graph, now, level, [z], margin, value)
    return _of_sign(graph, op, numbers, kept)


def _side_of(
    graph: Graph, now: Expr, level: Expr, parts: Sequence[Expr], margin: Expr, value: Expr
) -> Branch:
    extent = graph.const(0.0)
    for part in parts:
        extent = graph.op("add", extent, graph.op("absolute", part))
    level, extent = bounded(graph, level), bounded(graph, extent)
    return Branch(now=now, level=level, extent=extent, margin=margin, value=value)


def bounded(graph: Graph, level: Expr) -> Expr:
    """Return a level that is finite, with parameters that are infinite: never met, and at rest."""
    low = graph.op("maximum", level, graph.const(-_FAR))
    return graph.op("minimum", low, graph.const(_FAR))


def _of_order(graph: Graph, op: str, numbers: Sequence[Expr], kept: Expr) -> Branch:
    one = graph.const(1.0)
    level = graph.op("sub", *numbers)
    now = graph.number(graph.op(op, *numbers))
    way = graph.op("sub", graph.op("mul", graph.const(2.0), kept), one)
    margin = graph.op("mul", graph.op("mul", graph.const(_ORDERS[op]), way), level)
    value = graph.op("gt", kept, graph.const(0.5))
    return _side_of(graph, now, level, numbers, margin, value)


def _of_sign(graph: Graph, op: str, numbers: Sequence[Expr], kept: Expr) -> Branch:
    const, other = graph.const, numbers[-1]
    level = other if op == "copysign" else numbers[0]
    margin = graph.op("mul", kept, level)
    if op in ("sign", "heaviside"):  # at 0 they are on a side of its own
        at_zero = graph.op("neg", graph.op("absolute", level))
        margin = graph.op("select", graph.op("eq", kept, const(0.0)), at_zero, margin)
        value, now = kept, graph.op("sign", level)
        if op == "heaviside":
            below = graph.op("select", graph.op("lt", kept, const(0.0)), const(0.0), other)
            value = graph.op("select", graph.op("gt", kept, const(0.0)), const(1.0), below)
        return _side_of(graph, now, level, [level], margin, value)
    below = graph.op("lt", level, const(0.0))
    now = graph.op("select", below, const(-1.0), const(1.0))
    if op == "copysign":
        value = graph.op("mul", graph.op("absolute", numbers[0]), kept)
    else:  # the angle jumps on the left half of the axis only
        reflected = graph.op("mul", const(math.pi), graph.op("sub", kept, now))
        left = graph.op("lt", other, const(0.0))
        angle = graph.op("arctan2", *numbers)
        value = graph.op("add", angle, graph.op("select", left, reflected, const(0.0)))
    return _side_of(graph, now, level, [level], margin, value)


def _beyond(graph: Graph, rounding: str, z: Expr) -> Expr:
    """Return how far `z` is beyond the nearest number at which its rounding jumps."""
    nearest = graph.op("rint", z)
    if rounding == "rint":
        nearest = graph.op("add", graph.op("floor", z), graph.const(0.5))
    elif rounding == "trunc":  # it does not jump at 0
        least = graph.op("maximum", graph.op("absolute", nearest), graph.const(1.0))
        nearest = graph.op("copysign", least, z)
    return graph.op("sub", z, nearest)


def _within(graph: Graph, rounding: str, z: Expr, kept: Expr) -> Expr:
    """Return what is at least 0 while `z` is rounded to the number that is kept."""
    op, one = graph.op, graph.const(1.0)
    above, below = op("sub", z, kept), op("sub", kept, z)
    if rounding == "rint":
        return op("sub", graph.const(0.5), op("absolute", above))
    up, down = (
        op("minimum", above, op("add", below, one)),
        op("minimum", below, op("add", above, one)),
    )
    if rounding == "floor":
        return up
    if rounding == "ceil":
        return down
    around = op("sub", one, op("absolute", z))
    outside = op("select", op("gt", kept, graph.const(0.0)), up, down)
    return op("select", op("eq", kept, graph.const(0.0)), around, outside)
