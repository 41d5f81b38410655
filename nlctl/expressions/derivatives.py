"""Derivatives of expressions along a direction: forward mode, as expressions again.

Derivatives of what has none: opaque functions, by differences that are expressions, too.

A call y = f(z) has the derivative (f(z + h z') - f(z - h z')) / (2 h) along z'.  These are two
more calls, so all that reads expressions reads them.  The step h moves z by a fixed part of its
size: what z' is otherwise, such as the unit of a direction, does not matter.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .arrays import scalar
from .elimination import linear_solution
from .functions import FUNCTIONS
from .graph import COMPARISONS, LOGIC, Expr, Graph, Untraceable, needed
from .library.table import on_expressions
from .linear_systems import changed_solution, solution
from .operators import elementwise


def tangents(
    graph: Graph,
    results: Iterable[Expr],
    seed: Callable[[Expr], Expr | None],
    fixed_points: Mapping[str, Sequence[Expr]] | None = None,
    differences: bool = False,
) -> list[Expr | None]:
    """Return the derivatives of expressions along a direction in what they are made of."""
    reader = _Reader(graph, seed, fixed_points or {}, differences=differences)
    return reader.read(list(results))


def partials(graph: Graph) -> Callable[[Expr, int], Expr]:
    """Return what gives the partial derivatives of a function of the table, by argument."""
    return _Reader(graph, lambda _: None, {}).partial


def slope(
    graph: Graph,
    result: Expr,
    number: Expr,
    fixed_points: Mapping[str, Sequence[Expr]] | None = None,
) -> Expr | None:
    """Return the derivative of an expression by one that it is made of, all else fixed."""
    # NaN that it may be is fixed, too: it is there in the expression itself.
    fixed = {part: None for part in needed([result]) if _is_nan(part)}
    known = {**fixed, number: graph.const(1.0)}
    return _Reader(graph, lambda _: None, fixed_points or {}, known).read([result])[0]


def _is_nan(expr: Expr) -> bool:
    return expr.op == "const" and expr.kind == "f" and math.isnan(expr.data)


def linear(graph: Graph, node: Expr, parts: Sequence[Expr | None]) -> Expr | None:
    """Return what a linear operation makes of parts, None for one that is 0."""
    a, b, zero = parts[0], parts[-1], graph.const(0.0)
    if node.op in ("concat", "lu"):  # as derivative of factors stands that of the matrix
        sizes = node.data if node.op == "concat" else node.data[1]
        return graph.joined([(p or zero, n) for p, n in zip(parts, sizes, strict=True)])
    if node.op == "add":
        return _sum(graph, a, b)
    if node.op == "sub":
        return _difference(graph, a, b)
    if a is None:
        return None
    if node.op == "item":
        return graph.item(a, node.data)
    if node.op == "slice":
        start, step = node.data
        return graph.part(a, start, step, node.size or 1)
    return graph.sum(a, node.args[0].size or 1) if node.op == "sum" else graph.op("neg", a)


def _sum(graph: Graph, a: Expr | None, b: Expr | None) -> Expr | None:
    return graph.op("add", a, b) if a and b else a or b


def _difference(graph: Graph, a: Expr | None, b: Expr | None) -> Expr:
    return graph.op("sub", a, b) if a and b else a or graph.op("neg", b or graph.const(0.0))


def _times(graph: Graph, a: Expr, b: Expr) -> Expr:
    """Return a product; where a factor is chosen to be 0 it is 0, however large the other is."""
    # sqrt(max(x, 0)) stands still where x is below 0, as steep as the root is there.
    product = lambda p: _unless_zero(graph, b, lambda q: graph.op("mul", p, q))  # noqa: E731
    return _unless_zero(graph, a, product)


def _unless_zero(graph: Graph, part: Expr, of: Callable[[Expr], Expr]) -> Expr:
    """Return what is made of a part, 0 where that is chosen to be 0."""
    if part.op != "select" or not any(map(_is_zero, part.args[1:])):
        return of(part)
    condition, *ways = part.args
    results = (way if _is_zero(way) else _unless_zero(graph, way, of) for way in ways)
    return graph.op("select", condition, *results)


def _is_zero(expr: Expr) -> bool:
    return expr.op == "const" and expr.data == 0.0


_LINEAR = ("add", "sub", "neg", "item", "slice", "concat", "sum", "lu")


class _Reader:
    """Goes through a graph once; `known` are the derivatives so far."""

    def __init__(
        self,
        graph: Graph,
        seed: Callable[[Expr], Expr | None],
        fixed_points: Mapping[str, Sequence[Expr]],
        known: Mapping[Expr, Expr | None] | None = None,
        differences: bool = False,
    ) -> None:
        self.differences = differences
        self.graph, self.seed, self.fixed_points = graph, seed, fixed_points
        self.known: dict[Expr, Expr | None] = dict(known or {})
        self._partials: dict[tuple[str, int], Any] = {}

    def read(self, results: list[Expr]) -> list[Expr | None]:
        """Return the derivatives of results."""
        for node in needed(results):
            if node not in self.known:
                self.known[node] = self.tangent(node)
        return [self.known[expr] for expr in results]

    def tangent(self, node: Expr) -> Expr | None:
        """Return the derivative of an expression whose parts have theirs."""
        if node.op == "leaf":
            return self.seed(node)
        if _is_nan(node):
            return node
        parts = [self.known[arg] for arg in node.args]
        if node.op == "solve" and node.data[0] in self.fixed_points:
            return self._of_solution(node) if any(parts) else None
        if node.op == "call" and self.differences:
            return opaque_difference(self.graph, node, parts) if any(parts) else None
        if node.op in ("call", "solve"):
            raise Untraceable(f"{node.data[0]} is not an expression: it has no derivative")
        if all(part is None for part in parts) or node.op in COMPARISONS or node.op in LOGIC:
            return None
        if node.op in FUNCTIONS:
            return self._function(node, parts)
        if node.op in _LINEAR:
            return linear(self.graph, node, parts)
        return getattr(self, f"_{node.op}")(node, *parts)

    def _of_solution(self, node: Expr) -> Expr:
        """Differentiate z = F(z, w): z' = F_z z' + F_w w'; NaN where I - F_z is singular."""
        points, n = list(self.fixed_points[node.data[0]]), node.size or 1

        def read(seed: Callable[[Expr], Expr | None], of_solution: Expr | None) -> list[Any]:
            solution = {node: of_solution}
            reader = _Reader(self.graph, seed, self.fixed_points, solution, self.differences)
            return [scalar(self.graph, e or self._zero) for e in reader.read(points)]

        units = [self.graph.table(row) for row in np.eye(n).tolist()]
        columns = [read(lambda _: None, unit) for unit in units]
        matrix = [[float(i == j) - columns[j][i] for j in range(n)] for i in range(n)]
        solve = on_expressions(self.graph, linear_solution)
        changes, is_regular = solve(matrix, read(self.seed, None))
        where = functools.partial(elementwise, self.graph, "select", is_regular)
        parts = [where(change, np.nan) for change in changes]
        return self.graph.joined([(part.only, 1) for part in parts])

    @property
    def _zero(self) -> Expr:
        return self.graph.const(0.0)

    def _mul(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr | None:
        left = _times(self.graph, a, node.args[1]) if a else None
        right = _times(self.graph, node.args[0], b) if b else None
        return _sum(self.graph, left, right)

    def _div(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr:
        """(a / b)' = (a' - (a / b) b') / b."""
        change = _difference(self.graph, a, self.graph.op("mul", node, b) if b else None)
        return _unless_zero(self.graph, change, lambda p: self.graph.op("div", p, node.args[1]))

    def _select(self, node: Expr, _: Expr | None, a: Expr | None, b: Expr | None) -> Expr:
        return self.graph.op("select", node.args[0], a or self._zero, b or self._zero)

    def _lu_solve(self, node: Expr, matrix: Expr | None, *right: Expr | None) -> Expr:
        """X' = A^-1 (B' - A' X)."""
        sizes = node.data[1][1:]
        pieces = [(part or self._zero, n) for part, n in zip(right, sizes, strict=True)]
        return changed_solution(self.graph, node, matrix, pieces)

    def _lu_det(self, node: Expr, matrix: Expr) -> Expr:
        """det' = det tr(A^-1 A'), Jacobi's formula; NaN where A is singular."""
        graph, lu = self.graph, node.args[0]
        n = lu.data[0]
        whole = solution(graph, lu, n, [(graph.item(matrix, k), 1) for k in range(n * n)])
        diagonal = (graph.item(whole, k) for k in range(0, n * n, n + 1))
        return graph.op("mul", node, functools.reduce(lambda a, b: graph.op("add", a, b), diagonal))

    def _still(self, node: Expr, part: Expr) -> None:
        """It counts as fixed, whatever it is made of."""

    def _lu_regular(self, node: Expr, matrix: Expr) -> None:
        """It is the same almost everywhere."""

    def _function(self, node: Expr, parts: list[Expr | None]) -> Expr | None:
        change: Expr | None = None
        for i, part in enumerate(parts):
            if part is not None:
                term = _times(self.graph, self.partial(node, i), part)
                change = self.graph.op("add", change, term) if change else term
        return change

    def partial(self, node: Expr, i: int) -> Expr:
        """Return a partial derivative of a function of the table; its row is traced for that."""
        if (node.op, i) not in self._partials:
            function = FUNCTIONS[node.op].derivative[i]
            self._partials[node.op, i] = on_expressions(self.graph, function)
        given = [scalar(self.graph, self.graph.number(arg)) for arg in node.args]
        return self._partials[node.op, i](*given).only


RELATIVE_STEP = float(
    np.cbrt(np.finfo(float).eps)
)  # errors of rounding and of the formula are alike


def opaque_difference(graph: Graph, call: Expr, tangents: Sequence[Expr | None]) -> Expr:
    """Return the derivative of an opaque call along the derivatives of its arguments."""
    op, const = graph.op, graph.const
    sizes = call.data[1]
    speed = op("sqrt", _squares(graph, call.args, tangents, sizes))
    moves = op("gt", speed, const(0.0))
    h = op("select", moves, op("div", const(RELATIVE_STEP), speed), const(0.0))
    ahead, behind = (_moved(graph, call, tangents, step) for step in (h, op("neg", h)))
    factor = op("select", moves, op("div", speed, const(2.0 * RELATIVE_STEP)), const(0.0))
    if call.size == 1:  # a number, not a loop of one element
        ahead, behind = graph.item(ahead, 0), graph.item(behind, 0)
    return op("mul", op("sub", ahead, behind), factor)


def _squares(
    graph: Graph, args: Sequence[Expr], tangents: Sequence[Expr | None], sizes: Sequence[int]
) -> Expr:
    """Return the sum of squares of all changes, each relative to the size of what changes."""
    total = graph.const(0.0)
    for arg, tangent, size in zip(args, tangents, sizes, strict=True):
        if tangent is None:
            continue
        around = graph.op("maximum", graph.const(1.0), graph.op("absolute", graph.number(arg)))
        part = graph.op("div", tangent, around)
        square = graph.op("mul", part, part)
        whole = graph.sum(square, size) if square.size or size > 1 else square
        total = graph.op("add", total, whole)
    return total


def _moved(graph: Graph, call: Expr, tangents: Sequence[Expr | None], h: Expr) -> Expr:
    """Return the call with its arguments moved along their derivatives."""
    args = [
        arg if tangent is None else graph.op("add", arg, graph.op("mul", h, tangent))
        for arg, tangent in zip(call.args, tangents, strict=True)
    ]
    return graph.node("call", *args, data=call.data, size=call.size, varies=True)
