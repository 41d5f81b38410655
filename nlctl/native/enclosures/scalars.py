"""Expressions without vectors: what intervals are computed of, element by element.

A graph whose constants are numbers, not what floats round them to.

A graph evaluates what is made of constants, rounded as any float.  Within a function that is what
a run computes; but the derivative of 0.1 (0.3 x) is the product of both floats, and an enclosure of
it has to hold that.
"""

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import reduce

from ...expressions.arrays import scalar
from ...expressions.graph import (
    COMPARISONS,
    LINEAR,
    LOGIC,
    OF_FACTORS,
    Expr,
    Graph,
    Untraceable,
    needed,
)
from ...expressions.library.linear_algebra import entries_written_out

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

    nothing_fails = False  # a proof is of functions that return numbers

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


MOST_NUMBERS = 3_000  # numbers, beyond which code would take too long to make


def scalar_expressions(results: Sequence[Expr]) -> tuple[Graph, list[Expr]]:
    """Return expressions in a graph of their own, in which everything is a number."""
    graph, new = UnroundedGraph(), {}
    for node in needed(results):
        if node.op in ("call", "solve"):
            raise Untraceable(f"{node.data[0]} is not an expression: it has no enclosure")
        new[node] = _elements(graph, node, new)
        if len(graph.nodes) > MOST_NUMBERS:
            raise Untraceable(f"more than {MOST_NUMBERS} numbers are computed")
    return graph, [new[expr][0] for expr in results]


def _elements(graph: Graph, node: Expr, elements: Mapping[Expr, list[Expr]]) -> list[Expr]:
    """Return the elements of a vector, or a number as the only one."""
    size = node.size or 1
    parts = [elements[arg] for arg in node.args]
    if node.op == "const":
        return [graph.const(bool(node.data) if node.kind == "b" else float(node.data))]
    if node.op == "table":
        return [graph.const(value) for value in node.data]
    if node.op == "leaf":
        array, start, step = node.data
        return [graph.leaf(array, start + step * i, None) for i in range(size)]
    if node.op == "item":
        return [parts[0][node.data]]
    if node.op == "slice":
        start, step = node.data
        return [parts[0][start + step * i] for i in range(size)]
    if node.op == "concat":
        widths = zip(parts, node.data, strict=True)
        return [part[i if len(part) > 1 else 0] for part, n in widths for i in range(n)]
    if node.op == "sum":
        return [reduce(lambda a, b: graph.op("add", a, b), parts[0])]
    if node.op in (*LINEAR, *OF_FACTORS):
        return _of_linear_system(graph, node, parts)
    return [
        _of_numbers(graph, node, [p[i if len(p) > 1 else 0] for p in parts]) for i in range(size)
    ]


def _of_linear_system(graph: Graph, node: Expr, parts: Sequence[list[Expr]]) -> list[Expr]:
    """Return what is computed of a matrix, written out; its entries stand for its factors."""
    later = node.data[1][1:] if node.op in LINEAR else ()
    lengths = node.data[1] if node.op == "lu" else (len(parts[0]), *later)
    given = [p[i if len(p) > 1 else 0] for p, n in zip(parts, lengths, strict=True)
             for i in range(n)]  # fmt: skip
    if node.op == "lu":
        return given
    n = node.args[0].data[0]
    entries = [scalar(graph, graph.number(e)) for e in given]
    rows = [entries[i * n : (i + 1) * n] for i in range(n)]
    if node.op == "lu_solve":
        m = node.data[0][1]
        right = [entries[n * n + i * m : n * n + (i + 1) * m] for i in range(n)]
        rows = [[*row, *more] for row, more in zip(rows, right, strict=True)]
    return [graph.number(v.only) for v in entries_written_out(graph, rows, node.op)]


def _of_numbers(graph: Graph, node: Expr, args: list[Expr]) -> Expr:
    """Return an operation, which is a float's even of integers: none is larger than 2^53."""
    floats = [
        graph.number(a) if node.op not in ("select",) and node.kind != "b" else a for a in args
    ]
    return graph.op(node.op, *floats)
