"""Derivatives of expressions along a direction: forward mode, as expressions again."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from .arrays import scalar
from .functions import FUNCTIONS
from .graph import COMPARISONS, LOGIC, Expr, Graph, Untraceable, needed
from .stage import Stage

__all__ = ["tangents"]


def tangents(
    graph: Graph, results: Iterable[Expr], seed: Callable[[Expr], Expr | None]
) -> list[Expr | None]:
    """Return the derivatives of expressions along a direction in what they are made of.

    Parameters
    ----------
    graph : Graph
        Where the expressions are kept, and the derivatives, too.
    results : iterable of Expr
    seed : callable
        Takes what is read from an array (a leaf) and returns its own derivative, an expression of
        the same size, or None for 0.

    Returns
    -------
    list of Expr or None
        None where the derivative is 0 whatever the values are.  At kinks and jumps: the
        derivative of the side that the value belongs to.

    Raises
    ------
    Untraceable
        If an opaque function, which has no expressions, is among what results are made of.
    """
    reader, results = _Reader(graph, seed), list(results)
    for node in needed(results):
        reader.known[node] = reader.tangent(node)
    return [reader.known[expr] for expr in results]


class _Reader:
    """Goes through a graph once; `known` are the derivatives so far."""

    def __init__(self, graph: Graph, seed: Callable[[Expr], Expr | None]) -> None:
        self.graph, self.seed = graph, seed
        self.known: dict[Expr, Expr | None] = {}
        self._partials: dict[tuple[str, int], Any] = {}
        self._stage = Stage(graph)

    def tangent(self, node: Expr) -> Expr | None:
        """Return the derivative of an expression whose parts have theirs."""
        if node.op == "leaf":
            return self.seed(node)
        parts = [self.known[arg] for arg in node.args]
        if node.op in ("call", "solve"):
            raise Untraceable(f"{node.data[0]} is no expression: it has no derivative")
        if all(part is None for part in parts) or node.op in COMPARISONS or node.op in LOGIC:
            return None
        if node.op in FUNCTIONS:
            return self._function(node, parts)
        return getattr(self, f"_{node.op}")(node, *parts)

    def _zero_if_none(self, tangent: Expr | None) -> Expr:
        return self.graph.const(0.0) if tangent is None else tangent

    def _add(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr | None:
        return self.graph.op("add", a, b) if a and b else a or b

    def _sub(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr | None:
        if a and b:
            return self.graph.op("sub", a, b)
        return a or self.graph.op("neg", self._zero_if_none(b))

    def _neg(self, node: Expr, a: Expr) -> Expr:
        return self.graph.op("neg", a)

    def _mul(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr | None:
        left = self.graph.op("mul", a, node.args[1]) if a else None
        right = self.graph.op("mul", node.args[0], b) if b else None
        return self._add(node, left, right)

    def _div(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr:
        """(a / b)' = (a' - (a / b) b') / b."""
        change = self._sub(node, a, self.graph.op("mul", node, b) if b else None)
        return self.graph.op("div", self._zero_if_none(change), node.args[1])

    def _select(self, node: Expr, _: Expr | None, a: Expr | None, b: Expr | None) -> Expr:
        yes, no = self._zero_if_none(a), self._zero_if_none(b)
        return self.graph.op("select", node.args[0], yes, no)

    def _item(self, node: Expr, a: Expr) -> Expr:
        return self.graph.item(a, node.data)

    def _slice(self, node: Expr, a: Expr) -> Expr:
        start, step = node.data
        return self.graph.part(a, start, step, node.size or 1)

    def _concat(self, node: Expr, *parts: Expr | None) -> Expr:
        return self.graph.joined(list(zip(map(self._zero_if_none, parts), node.data, strict=True)))

    def _sum(self, node: Expr, a: Expr) -> Expr:
        return self.graph.sum(a, node.args[0].size or 1)

    def _function(self, node: Expr, parts: list[Expr | None]) -> Expr | None:
        found: Expr | None = None
        for i, part in enumerate(parts):
            if part is not None:
                term = self.graph.op("mul", self._partial(node, i), part)
                found = self.graph.op("add", found, term) if found else term
        return found

    def _partial(self, node: Expr, i: int) -> Expr:
        """Return a partial derivative of a function of the table; its row is traced for that."""
        if (node.op, i) not in self._partials:
            function = FUNCTIONS[node.op].derivative[i]
            self._partials[node.op, i] = self._stage.copied(function)
        given = [scalar(self.graph, self.graph.number(arg)) for arg in node.args]
        return self._partials[node.op, i](*given).only
