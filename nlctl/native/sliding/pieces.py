"""Rates that are piecewise affine in a relay's output: behind min, max, clip, abs and choices.

A rate u' = R(v) that falls with v, in straight pieces, leads back to u = 0 from both sides where
R(height) < 0 < R(-height), and vanishes at one v between (or on one flat piece).  Every piece ends
where one of the bends of R turns, and so do all candidates, whichever way the bends inside of it
go: between the last candidate with R >= 0 and the first with R <= 0 R is straight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from ...expressions.bends import replaced_parts
from ...expressions.dependence import affine, dependent_nodes
from ...expressions.derivatives import slope
from ...expressions.evaluate import evaluate_expressions
from ...expressions.graph import Expr, Graph, Untraceable, needed

_BENDS = ("maximum", "minimum", "absolute", "select")
_ORDERS = ("lt", "le", "gt", "ge")
_POSITIVE = ("exp", "absolute", "sqrt", "cosh")
_MOST = 6  # bends: each has two ways, and every combination is read
_POINTS = 16  # values for which a choice is seen not to jump
_EQUAL = 1e-9

LeafDerivative = Callable[[Expr], Expr | None]


def unreadable(graph: Graph, rate: Expr, leaf: Expr, tangent: LeafDerivative) -> str:
    """Return why a rate is not piecewise affine and monotone in a leaf, "" if it is."""
    bends = _bends(rate, leaf)
    if len(bends) > _MOST:
        return f"through {len(bends)} bends, of which {_MOST} are read"
    pieces = list(_pieces(graph, rate, bends))
    if any(bend.size is not None for bend in bends) or not all(affine(e, leaf) for e in pieces):
        return "otherwise than as a + b v, also piece by piece"
    for bend in bends:
        if bend.op == "select" and _jumps(graph, bend, leaf, tangent):
            return "through a choice that jumps or cannot be seen not to"
    slopes = (tangent(piece) for piece in pieces)
    if len({_sign(slope) for slope in slopes if slope is not None} - {None}) > 1:
        return "with slopes that have different signs, or signs that are not known to agree"
    return ""


def bend_places(graph: Graph, rate: Expr, leaf: Expr, tangent: LeafDerivative) -> list[Expr]:
    """Return where a rate may bend, as values of the leaf; some of them may be of no bend."""
    bends = _bends(rate, leaf)
    turning = [g for bend in bends for g in _turning(graph, bend, leaf)]
    return list(dict.fromkeys(z for g in turning for z in _zeros(graph, g, leaf, tangent)))


def zero_between(
    graph: Graph, rate: Expr, leaf: Expr, height: Expr, breaks: Sequence[Expr]
) -> tuple[list[Expr], list[Expr]]:
    """Return a and b of the straight line through both ends, and of the piece with the zero."""
    # The first has the values of the rate R at v = height and -height.  The second is 0 where R is,
    # or at the end that is nearer to it where no v of [-height, height] makes R vanish.
    op, const = graph.op, graph.const
    least = op("neg", height)
    inner = [op("maximum", op("minimum", z, height), least) for z in breaks]
    places = [least, height, *inner]
    values = [replaced_parts(graph, [rate], {leaf: place})[0] for place in places]
    low, high = (least, values[0]), (height, values[1])
    for z, value in zip(inner, values[2:], strict=True):
        later = op("and", op("ge", value, const(0.0)), op("gt", z, low[0]))
        sooner = op("and", op("le", value, const(0.0)), op("lt", z, high[0]))
        low = _chosen(graph, later, (z, value), low)
        high = _chosen(graph, sooner, (z, value), high)
    two = const(2.0)
    total, fall = op("add", values[0], values[1]), op("sub", values[1], values[0])
    line = [op("div", total, two), op("div", fall, op("mul", two, height))]
    flat = op("eq", low[1], high[1])
    part = op("select", flat, const(0.5), op("div", low[1], op("sub", low[1], high[1])))
    part = op("maximum", op("minimum", part, const(1.0)), const(0.0))  # the nearer end
    way = op("sub", high[0], low[0])
    zero = op("add", low[0], op("mul", way, part))
    slope = op("select", flat, const(-1.0), op("div", op("sub", high[1], low[1]), way))
    return line, [op("neg", op("mul", slope, zero)), slope]


def _chosen(graph: Graph, condition: Expr, one: Any, other: Any) -> tuple[Expr, Expr]:
    first, second = (graph.op("select", condition, a, b) for a, b in zip(one, other, strict=True))
    return first, second


def _bends(expr: Expr, leaf: Expr) -> list[Expr]:
    """Return the parts at which an expression may bend as the leaf changes, inner ones first."""
    return [
        node
        for node, by in dependent_nodes(expr, leaf)
        if node.op in _BENDS and (node.op != "select" or by[0])
    ]


def _ways(graph: Graph, bend: Expr) -> tuple[Expr, Expr]:
    """Return what a bend is on either side."""
    if bend.op == "absolute":
        return bend.args[0], graph.op("neg", bend.args[0])
    return bend.args[-2], bend.args[-1]


def _pieces(graph: Graph, expr: Expr, bends: Sequence[Expr]) -> Iterator[Expr]:
    """Yield an expression with all bends taken one way or the other."""
    found: dict[Expr, None] = {}
    for choice in product((0, 1), repeat=len(bends)):
        instead: dict[Expr, Expr] = {}
        for bend, way in zip(bends, choice, strict=True):
            instead[bend] = replaced_parts(graph, [_ways(graph, bend)[way]], instead)[0]
        found[replaced_parts(graph, [expr], instead)[0]] = None
    yield from found


def _turning(graph: Graph, bend: Expr, leaf: Expr) -> list[Expr]:
    """Return the numbers at whose zeros a bend takes the other way."""
    if bend.op == "absolute":
        return [bend.args[0]]
    if bend.op != "select":
        return [graph.op("sub", *bend.args)]
    parts = needed(bend.args[:1])
    return [graph.op("sub", *e.args) for e in parts if e.op in _ORDERS and leaf in needed([e])]


def _zeros(graph: Graph, expr: Expr, leaf: Expr, tangent: LeafDerivative) -> Iterator[Expr]:
    """Yield where the pieces of an expression vanish, as values of the leaf."""
    for piece in _pieces(graph, expr, _bends(expr, leaf)):
        slope = tangent(piece)
        if slope is None or _sign(slope) is None:
            continue
        (start,) = replaced_parts(graph, [piece], {leaf: graph.const(0.0)})
        none = graph.op("eq", slope, graph.const(0.0))
        zero = graph.op("neg", graph.op("div", start, slope))
        yield graph.op("select", none, graph.const(0.0), zero)


def _jumps(graph: Graph, choice: Expr, leaf: Expr, tangent: LeafDerivative) -> bool:
    """Whether a choice may jump where it goes the other way: seen from values at random."""
    orders = [e for e in needed(choice.args[:1]) if leaf in needed([e])]
    if any(e.op not in (*_ORDERS, "and", "or", "not") and e.kind == "b" for e in orders):
        return True
    apart = graph.op("sub", *choice.args[1:])
    for turning in _turning(graph, choice, leaf):
        for zero in _zeros(graph, turning, leaf, tangent):
            values = _at_random(
                replaced_parts(graph, [turning, apart, *choice.args[1:]], {leaf: zero})
            )
            if values is None:
                return True
            g, gap, one, other = values
            scale = 1.0 + np.abs(one) + np.abs(other)
            if np.any((np.abs(g) <= _EQUAL * scale) & ~(np.abs(gap) <= _EQUAL * scale)):
                return True
    return False


def _at_random(exprs: Sequence[Expr]) -> list[np.ndarray] | None:
    """Return values of expressions for random values of all that they read, if they have any."""
    rng, rows = np.random.default_rng(1), dict.fromkeys("txup", 0)
    for node in needed(exprs):
        if node.op == "leaf":
            array, start, step = node.data
            end = start + step * ((node.size or 1) - 1) + 1
            rows[array] = max(rows.get(array, 0), end)
    arrays = {name: rng.normal(size=(n, _POINTS)) for name, n in rows.items()}
    arrays["p"] = 0.5 + np.abs(arrays["p"])  # bounds of a symmetric dead zone stand in order
    try:
        found = evaluate_expressions(exprs, arrays)
    except (Untraceable, KeyError):
        return None
    return [np.broadcast_to(value, (_POINTS,)) for value in found]


def _sign(expr: Expr) -> tuple[float, frozenset[Expr]] | None:
    """Return the sign of an expression and the factors that may turn it; None if it is 0."""
    if expr.op == "const":
        return (float(np.sign(expr.data)), frozenset()) if expr.data != 0 else None
    if expr.op in _POSITIVE:
        return 1.0, frozenset()
    if expr.op == "neg":
        inner = _sign(expr.args[0])
        return inner and (-inner[0], inner[1])
    if expr.op in ("mul", "div"):
        one, other = (_sign(arg) for arg in expr.args)
        if one is None or other is None:
            return None
        return one[0] * other[0], one[1] ^ other[1]
    return 1.0, frozenset([expr])


def slope_of(graph: Graph, leaf: Expr, solutions: Mapping[str, Sequence[Expr]]) -> LeafDerivative:
    """Return what gives the derivative of an expression by a leaf, None where it is 0."""

    return lambda expr: slope(graph, expr, leaf, solutions)
