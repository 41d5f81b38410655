"""Steep roots: sqrt(abs(x)) where x passes 0, as what flows through an orifice.

The derivative of a run through that is finite, as is the integral of 1 / sqrt(abs(x)), but no step
of finite length integrates it.  So derivatives are those of equations in which what stands below
the root is bent over the distance that x goes in a very small part of the run.  Both ends of the
bend are as far apart as before, and so is what it adds.  Where x comes to rest at 0 its rate, and
with it the bend, vanishes: nothing changes there.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..expressions.arrays import scalar
from ..expressions.conditions import number_rooted
from ..expressions.graph import ORDERS, Expr, Graph, needed
from ..expressions.library.table import on_expressions

_STILL = "still"  # an operation that is what it is made of, and has no derivative


def bent_roots(
    graph: Graph, steep: Mapping[Expr, Expr], rates: Sequence[Expr], short: Expr
) -> dict[Expr, Expr]:
    """Return what stands for what is below steep roots, bent for a short time by its rates."""
    bent = {}
    for (below, level), rate in zip(steep.items(), rates, strict=True):
        if rate.op != "const" or rate.data != 0.0:
            width = graph.op("mul", graph.op("absolute", rate), short)
            still = graph.node(_STILL, width, size=width.size, varies=True)
            bent[below] = _bent(graph, below, level, still)
    return bent


def steep_levels(graph: Graph, exprs: Sequence[Expr], levels: Iterable[Expr]) -> dict[Expr, Expr]:
    """Return what passes 0 below steep roots: of kinks, and of what is chosen by its own level."""
    chosen, passed = with_their_opposites(graph, levels), {}
    for below in _below_roots(needed(exprs)):
        kink = _kink(below)
        if kink is not None or below in chosen:
            passed[below] = below if kink is None else kink[1]
    return passed


def with_their_opposites(graph: Graph, levels: Iterable[Expr]) -> set[Expr]:
    """Return levels as others may write them, who take their signs or compare their parts."""
    both = set()
    for level in levels:
        both |= {level, graph.op("neg", level)}
        if level.op == "sub":
            both.add(graph.op("sub", *level.args[::-1]))
    return both


def without_stills(graph: Graph, exprs: Sequence[Expr], instead: Expr | None = None) -> list[Expr]:
    """Return expressions of which no more derivatives are taken, or with `instead` for widths."""
    new: dict[Expr, Expr] = {}
    for node in needed(exprs):
        args = tuple(new.get(a, a) for a in node.args)
        if node.op == _STILL:
            new[node] = instead or args[0]
        elif args != node.args:
            new[node] = graph.like(node, *args)
    return [new.get(e, e) for e in exprs]


def _below_roots(nodes: Iterable[Expr]) -> list[Expr]:
    """Return what stands below roots, in each way that it is chosen from; and cube roots."""
    below, ways = [], []
    for node in nodes:
        below += [node.args[0]] if _is_root(node) else [node] if node.op == "cbrt" else []
    while below:
        expr = below.pop()
        if expr.op == "select" and _kink(expr) is None:
            below += expr.args[1:]
        elif expr.varies:
            ways.append(expr)
    return ways


def _is_root(root: Expr) -> bool:
    """Whether something is infinitely steep at 0, or may be: a root, or a logarithm."""
    if root.op != "power":
        return root.op in ("sqrt", "log", "log2", "log10")
    exponent = root.args[1]
    return 0.0 < exponent.data < 1.0 if exponent.op == "const" else not exponent.varies


def _kink(below: Expr) -> tuple[str, Expr] | None:
    """Return what kind of kink or cube root is 0 at a level, and this; None of anything else."""
    if below.op in ("absolute", "cbrt"):
        return below.op, below.args[0]
    if (rooted := number_rooted(below)) is not None:
        return "absolute", rooted
    if below.op == "maximum":
        return next((("maximum", a) for a, b in _both_ways(below.args) if _is_zero(b)), None)
    if below.op != "select" or below.args[0].op not in ORDERS:
        return None
    comparison, *ways = below.args
    above, beneath = ways if comparison.op in ("gt", "ge") else ways[::-1]
    if _is_zero(comparison.args[0]):
        above, beneath = beneath, above
    level = next((a for a, b in _both_ways(comparison.args) if _is_zero(b)), None)
    if level is None or above is not level:
        return None
    opposite = beneath.op == "neg" and beneath.args[0] is level
    kind = "maximum" if _is_zero(beneath) else "absolute" if opposite else None
    return (kind, level) if kind else None


def _both_ways(pair: Sequence[Expr]) -> tuple[Sequence[Expr], Sequence[Expr]]:
    return pair, pair[::-1]


def _is_zero(expr: Expr) -> bool:
    return expr.op == "const" and expr.data == 0.0


def _bent(graph: Graph, below: Expr, level: Expr, width: Expr) -> Expr:
    """Return what stands below a root, bent within a width of its level."""
    kink = _kink(below)
    function = _kept_up if kink is None else _BENT[kink[0]]
    return on_expressions(graph, function)(scalar(graph, level), scalar(graph, width)).only


def _kept_up(x: Any, width: Any) -> Any:
    return np.maximum(x, width)


def _bent_abs(x: Any, width: Any) -> Any:
    return np.where(np.abs(x) < width, (x * x + width * width) / (2.0 * width), np.abs(x))


def _bent_maximum(x: Any, width: Any) -> Any:
    above = np.where(x < width, (x + width) * (x + width) / (4.0 * width), x)
    return np.where(x + width <= 0.0, 0.0, above)  # outside: below it a root stands still


def _bent_cube_root(x: Any, width: Any) -> Any:
    q = x / width
    return np.where(np.abs(q) < 1.0, np.cbrt(width) * q * (4.0 - q * q) / 3.0, np.cbrt(x))


_BENT = {"absolute": _bent_abs, "maximum": _bent_maximum, "cbrt": _bent_cube_root}
