"""Difference quotients of expressions: (q(v) - q(0)) / v without a division by v."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .graph import Expr, Graph, Untraceable, needed


@dataclass(frozen=True)
class _Quantity:
    """An expression, the same for v = 0, and what makes its quotient; None for what has no v."""

    here: Expr
    base: Expr
    quotient: Callable[[], Expr] | None = None


def difference_quotient(graph: Graph, result: Expr, variable: Expr) -> Expr:
    """Return (q(v) - q(0)) / v of an expression q, whose limit at v = 0 is the derivative."""
    # Terms without v have the quotient 0 exactly, and a factor v gives what it is multiplied by.
    quantities: dict[Expr, _Quantity] = {}
    for node in needed([result]):
        if node is variable:
            quantities[node] = _Quantity(node, graph.const(0.0), lambda: graph.const(1.0))
        elif all(quantities[arg].quotient is None for arg in node.args):
            quantities[node] = _Quantity(node, node)
        else:
            quantities[node] = _quantity_of(graph, node, [quantities[arg] for arg in node.args])
    return _quotient(graph, quantities[result])


def _quotient(graph: Graph, quantity: _Quantity) -> Expr:
    return graph.const(0.0) if quantity.quotient is None else quantity.quotient()


def _quantity_of(graph: Graph, node: Expr, parts: list[_Quantity]) -> _Quantity:
    base = graph.op(node.op, *(part.base for part in parts))

    def quotient() -> Expr:
        if node.op not in _RULES:
            raise Untraceable(f"the difference quotient of {node.op} is not an expression")
        return _RULES[node.op](graph, *parts)

    return _Quantity(node, base, quotient)


def _of_sum(graph: Graph, a: _Quantity, b: _Quantity) -> Expr:
    quotients = [_quotient(graph, part) for part in (a, b) if part.quotient]
    return quotients[0] if len(quotients) == 1 else graph.op("add", *quotients)


def _of_difference(graph: Graph, a: _Quantity, b: _Quantity) -> Expr:
    if b.quotient is None:
        return _quotient(graph, a)
    negated = graph.op("neg", _quotient(graph, b))
    return graph.op("sub", _quotient(graph, a), _quotient(graph, b)) if a.quotient else negated


def _of_product(graph: Graph, a: _Quantity, b: _Quantity) -> Expr:
    """a b - a0 b0 = a (b - b0) + b0 (a - a0); nothing is asked of a factor that meets 0."""
    for one, other in ((a, b), (b, a)):
        if other.quotient is None:
            return graph.op("mul", _quotient(graph, one), other.here)
    for one, other in ((a, b), (b, a)):
        if other.base.op == "const" and other.base.data == 0.0:
            return graph.op("mul", one.here, _quotient(graph, other))
    first = graph.op("mul", a.here, _quotient(graph, b))
    return graph.op("add", first, graph.op("mul", b.base, _quotient(graph, a)))


def _of_division(graph: Graph, a: _Quantity, b: _Quantity) -> Expr:
    """a / b - a0 / b0 = ((a - a0) - (a0 / b0) (b - b0)) / b."""
    if b.quotient is None:
        return graph.op("div", _quotient(graph, a), b.here)
    change = graph.op("mul", graph.op("div", a.base, b.base), _quotient(graph, b))
    return graph.op("div", graph.op("sub", _quotient(graph, a), change), b.here)


_RULES: dict[str, Callable[..., Expr]] = {
    "add": _of_sum,
    "sub": _of_difference,
    "neg": lambda graph, a: graph.op("neg", _quotient(graph, a)),
    "mul": _of_product,
    "div": _of_division,
}
