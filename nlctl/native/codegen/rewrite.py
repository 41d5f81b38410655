"""The same results in words that cost a processor less.

What is rewritten changes a result by rounding and no more.  Rounding matters where a value decides
about a jump: floor(t / T) at t = 3 T, a comparison with a limit that is met exactly.  What gets
there by arithmetic alone is therefore left as it is, and is computed operation by operation.
"""

import math
from collections.abc import Collection, Mapping, Sequence

from ...expressions.functions import COUNTING
from ...expressions.graph import COMPARISONS, LOGIC, Expr, Graph, needed
from .plan import Store

_JUMPS = (*COMPARISONS, *COUNTING, "sign", "remainder", "fmod", "copysign")
ALGEBRAIC = ("add", "sub", "mul", "div", "neg", "select", "absolute", "minimum", "maximum")
_PARTS = ("item", "slice", "concat")  # they compute nothing
_LOG2_E = 1.4426950408889634


def rewritten(
    graph: Graph, stores: Mapping[str, Sequence[Store]]
) -> tuple[dict[str, list[Store]], frozenset[Expr], Graph]:
    """Return the same results in other words."""
    nodes = needed([s.expr for part in stores.values() for s in part], ())
    decisive = _decisive(nodes)
    fresh, new = Graph(graph.lengths), {}
    for node in nodes:
        args = tuple(new[a] for a in node.args)
        other = None if node in decisive else _reworded(fresh, node, args)
        new[node] = other or fresh.like(node, *args)
    new_stores = {
        name: [Store(array=s.array, row=s.row, expr=new[s.expr], size=s.size) for s in part]
        for name, part in stores.items()
    }
    return new_stores, frozenset(new[node] for node in decisive), fresh


def _decisive(nodes: Sequence[Expr], jumps: Collection[Expr] = ()) -> set[Expr]:
    """Return what reaches a jump, or one of `jumps`, by arithmetic alone; parts come first."""
    decisive = set(jumps)
    for node in reversed(nodes):
        passes = node in decisive and node.op in (*ALGEBRAIC, *_PARTS)
        if node.op in _JUMPS or passes or node in jumps:
            decisive.update(node.args)
        elif node.op == "select":
            decisive.add(node.args[0])
    return decisive


def computed_as_written(nodes: Sequence[Expr], jump: Expr) -> set[Expr]:
    """Return what a jump is computed of that is rounded as NumPy rounds it; parts come first."""
    alike = (*ALGEBRAIC, *_PARTS, *_JUMPS, *LOGIC, jump.op)
    return {node for node in _decisive(nodes, [jump]) if node.op in alike or not node.args}


def _reworded(graph: Graph, node: Expr, args: tuple[Expr, ...]) -> Expr | None:
    if node.op == "div" and node.varies and not args[1].varies:
        return _by_reciprocal(graph, *args)
    if node.op in ("sin", "cos") and args[0].op == "add":
        return _shifted(graph, node, *args[0].args)
    if node.op == "exp" and args[0].op == "mul" and node.varies:
        factor, other = args[0].args
        if other.varies:
            factor, other = other, factor
        if not other.varies:  # the power of e is one of 2
            power = graph.op("mul", factor, graph.op("mul", other, graph.const(_LOG2_E)))
            return graph.node("exp2", power, size=node.size)
    return None


def _by_reciprocal(graph: Graph, over: Expr, under: Expr) -> Expr:
    """Divide by what depends on parameters alone: its reciprocal is computed once."""
    by = graph.op("div", graph.const(1.0), under)
    while over.op == "neg":
        over, by = over.args[0], graph.op("neg", by)
    return graph.op("mul", over, by)


def _shifted(graph: Graph, node: Expr, angle: Expr, shift: Expr) -> Expr | None:
    """Return sin or cos of an angle plus a multiple of pi / 2 without that."""
    if shift.op != "const":
        return None
    k = round(shift.data / (math.pi / 2)) if math.isfinite(shift.data) else 0
    if not 0 < abs(k) <= 8 or shift.data != k * (math.pi / 2):
        return None
    quarter = (k + (node.op == "cos")) % 4
    shifted = graph.node("cos" if quarter % 2 else "sin", angle, size=node.size)
    return graph.op("neg", shifted) if quarter >= 2 else shifted
