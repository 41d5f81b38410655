"""Expressions that have poles as quotients of two that have none."""

from __future__ import annotations

from .edges import is_positive
from .graph import Expr, Graph


def as_fraction(graph: Graph, expr: Expr) -> tuple[Expr, Expr | None]:
    """Return dividend and divisor of sums, products and quotients; None where there is no pole."""
    return _fraction(graph, expr, {})


def _fraction(
    graph: Graph, expr: Expr, known: dict[Expr, tuple[Expr, Expr | None]]
) -> tuple[Expr, Expr | None]:
    if expr not in known:
        known[expr] = _of_parts(graph, expr, known)
    return known[expr]


def _of_parts(
    graph: Graph, expr: Expr, known: dict[Expr, tuple[Expr, Expr | None]]
) -> tuple[Expr, Expr | None]:
    if expr.op == "tan" and expr.varies:
        return graph.op("sin", expr.args[0]), graph.op("cos", expr.args[0])
    if expr.op not in ("neg", "add", "sub", "mul", "div") or not expr.varies:
        return graph.number(expr), None
    (p, q), (r, s) = (_fraction(graph, arg, known) for arg in (expr.args[0], expr.args[-1]))
    has_pole = expr.op == "div" and expr.args[1].varies and not is_positive(expr.args[1])
    if q is None and s is None and not has_pole:
        return graph.number(expr), None
    if expr.op == "neg":
        return graph.op("neg", p), q
    if expr.op == "mul":
        return graph.op("mul", p, r), _either(graph, q, s)
    if expr.op != "div":
        both = graph.op(expr.op, multiplied(graph, p, s), multiplied(graph, r, q))
        return both, _either(graph, q, s)
    if has_pole:
        return multiplied(graph, p, s), multiplied(graph, r, q)
    return graph.op("div", p, graph.number(expr.args[1])), q


def multiplied(graph: Graph, factor: Expr, other: Expr | None) -> Expr:
    """Return a product, or the factor alone where there is no other."""
    return factor if other is None else graph.op("mul", factor, other)


def _either(graph: Graph, q: Expr | None, s: Expr | None) -> Expr | None:
    return s if q is None else multiplied(graph, q, s)
