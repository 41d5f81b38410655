"""Where expressions switch: for each comparison, `floor`, `abs`, `max`, what is 0 there.

A condition that an expression depends on divides what it is made of in two.  On each side the
expression is smooth; where the switching function changes its sign it may jump, or have a kink.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable

from .graph import ORDERS, Expr, Graph, needed

_OF_DIFFERENCES = (*ORDERS, "minimum", "maximum")
_OF_SIGNS = ("absolute", "sign", "heaviside")
_OF_SECONDS = ("copysign",)
_OF_FIRSTS = ("arctan2",)
_OF_INTEGERS = {"floor": 0.0, "ceil": 0.0, "trunc": 0.0, "rint": 0.5}
_ROOTS = ("sqrt", "hypot")
_OF_QUOTIENTS = ("remainder", "fmod")
# functions that jump
JUMPING = (*_OF_INTEGERS, *_OF_QUOTIENTS, "sign", "heaviside", "copysign", "arctan2")


def conditions(exprs: Iterable[Expr], known: Collection[Expr] = ()) -> tuple[Expr, ...]:
    """Return all that expressions switch at, parts first."""
    roots = list(exprs)
    always = (n for n in needed(roots, known) if n.op in ORDERS and _is_of_infinity(n))
    passed = {*known, *always}  # what has one value, whatever is compared
    nodes = needed(roots, passed)
    return tuple(node for node in nodes if node.varies and node not in passed and _switches(node))


def _switches(node: Expr) -> bool:
    if node.op in _OF_DIFFERENCES:
        moves = any(arg.varies for arg in node.args)
        return moves and not _of_truths(node) and not _is_of_infinity(node)
    return (
        node.op in _OF_SIGNS
        or node.op in _OF_FIRSTS
        or at_integers(node)
        or (node.op in _OF_SECONDS and node.args[1].varies)
    )


def at_integers(node: Expr) -> bool:
    """Return whether an operation jumps where something is an integer, as `floor` and `%` do."""
    return node.op in _OF_INTEGERS or node.op in _OF_QUOTIENTS


def _is_of_infinity(node: Expr) -> bool:
    """Return whether an operation compares with infinity: which is larger never changes."""
    return node.op in _OF_DIFFERENCES and any(
        arg.op == "const" and abs(arg.data) == math.inf for arg in node.args
    )


def _of_truths(node: Expr) -> bool:
    return all(arg.kind == "b" for arg in node.args)


def switching_function(graph: Graph, condition: Expr) -> Expr:
    """Return what changes its sign where a condition switches."""
    op, args = condition.op, [graph.number(arg) for arg in condition.args]
    if op in _OF_DIFFERENCES:
        return _difference(graph, *args)
    if op in _OF_SIGNS or op in _OF_FIRSTS:
        return args[0]
    if op in _OF_SECONDS:
        return args[1]
    counted = args[0]
    if op in _OF_QUOTIENTS:
        counted = graph.op("div", *args)
    return _at_integers(graph, counted, _OF_INTEGERS.get(op, 0.0))


def switching_functions(graph: Graph, condition: Expr) -> tuple[Expr, ...]:
    """Return what changes its sign where a condition switches, of a product each factor."""
    function = switching_function(graph, condition)
    return (function,) if at_integers(condition) else _factors(function)


def _factors(function: Expr) -> tuple[Expr, ...]:
    """Return what a product changes its sign with: between two roots close by it is hardly < 0."""
    if function.op == "neg":
        return _factors(function.args[0])
    if function.op != "mul" or function.args[0] is function.args[1]:
        return (function,)
    parts = [part for arg in function.args if arg.varies for part in _factors(arg)]
    return tuple(parts) if len(set(parts)) == len(parts) > 0 else (function,)


def _difference(graph: Graph, a: Expr, b: Expr) -> Expr:
    """Return a - b; of what is compared with 0 itself, so that no rounding comes in."""
    # Of a root, a distance, the squares: near 0 it has a corner that no polynomial follows, so that
    # a step could pass through a small circle unseen.
    if a.op == "const" and a.data == 0.0:
        return b
    for root, other, step in ((a, b, 1), (b, a, -1)):
        if root.op in _ROOTS and not other.varies:
            squares = [_square_of_root(graph, root), graph.op("mul", other, other)]
            return graph.op("sub", *squares[::step])
    return graph.op("sub", a, b)


def _square_of_root(graph: Graph, root: Expr) -> Expr:
    args = [graph.number(arg) for arg in root.args]
    if root.op == "sqrt":
        return args[0]
    return graph.op("add", *(graph.op("mul", arg, arg) for arg in args))


def _at_integers(graph: Graph, counted: Expr, shift: float) -> Expr:
    """Return what has a simple root where `counted` + shift is an integer."""
    # sin(pi z) = (-1)^n sin(pi (z - n)) with the nearest integer n: rounding of pi z does not move
    # the roots.
    z = graph.op("add", counted, graph.const(shift)) if shift else counted
    nearest = graph.op("rint", z)
    half = graph.op("mul", nearest, graph.const(0.5))
    odd = graph.op("sub", half, graph.op("floor", half))  # 0 or 1/2
    sign = graph.op("sub", graph.const(1.0), graph.op("mul", graph.const(4.0), odd))
    rest = graph.op("mul", graph.const(math.pi), graph.op("sub", z, nearest))
    return graph.op("mul", sign, graph.op("sin", rest))
