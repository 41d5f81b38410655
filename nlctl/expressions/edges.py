"""Where what is compared becomes NaN, or infinite: edges of domains, and poles."""

from __future__ import annotations

from collections.abc import Iterable

from .graph import Expr, Graph
from .signs import ANY_SIGN, POSITIVE

_ROOTS = ("sqrt", "log", "log2", "log10")
_ARCS = ("arcsin", "arccos", "arctanh")
_BEHIND_ONE = {"arccosh": "sub", "log1p": "add"}


def domain_edges(graph: Graph, nodes: Iterable[Expr]) -> list[Expr]:
    """Return what is below 0 where one of all parts of some expressions is NaN."""
    edges = dict.fromkeys(_domain(graph, node) for node in nodes if _ends(node))
    return [edge for edge in edges if edge.varies]


def have_edges(nodes: Iterable[Expr]) -> bool:
    """Return whether there are any."""
    return any(map(_ends, nodes))


def poles(graph: Graph, nodes: Iterable[Expr]) -> list[Expr]:
    """Return what is 0 where one of all parts of some expressions is infinite."""
    divisors: dict[Expr, None] = {}
    for node in nodes:
        if node.op == "div" and node.args[1].varies and node.args[1].sign != POSITIVE:
            divisors[graph.number(node.args[1])] = None
        if node.op == "tan" and node.varies:
            divisors[graph.op("cos", node.args[0])] = None
    return list(divisors)


def _ends(node: Expr) -> bool:
    """Return whether an operation has no value somewhere."""
    if not node.varies:
        return False
    if node.op in _ROOTS or (node.op == "power" and not _is_whole(node.args[1])):
        return node.args[0].sign == ANY_SIGN
    return node.op in (*_ARCS, *_BEHIND_ONE)


def _domain(graph: Graph, node: Expr) -> Expr:
    """Return what is at least 0 where an operation has a value."""
    arg, one = graph.number(node.args[0]), graph.const(1.0)
    if node.op in _ARCS:
        return graph.op("sub", one, graph.op("mul", arg, arg))
    return graph.op(_BEHIND_ONE[node.op], arg, one) if node.op in _BEHIND_ONE else arg


def _is_whole(exponent: Expr) -> bool:
    return exponent.kind == "i" or (exponent.op == "const" and float(exponent.data).is_integer())


def is_square(expr: Expr) -> bool:
    """Return whether an expression is a product of a number with itself, as it is written."""
    return expr.op == "mul" and expr.args[0] is expr.args[1]
