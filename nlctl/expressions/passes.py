"""What a loop of so many passes computes, each of what those before have chosen."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from .graph import ORDERS, Expr, Graph, needed

IN_TURN = 16  # comparisons, each of what the one before has chosen, as hardly any jump has them


class Passes:
    """What the passes of a loop compute."""

    __slots__ = ("computed", "graph", "place")  # one thing for loops inside, whatever it notes

    def __init__(self, graph: Graph) -> None:
        self.graph, self.place, self.computed = graph, len(graph.passing), set[Expr]()
        graph.passing.append(self.computed)

    def end(self) -> None:
        """Note that what is asked of a long chain is not located."""
        del self.graph.passing[self.place :]
        self.graph.of_passes |= asked_in_turn(self.computed)


def asked_in_turn(computed: set[Expr]) -> set[Expr]:
    """Return what is computed of earlier answers, where there are many in turn."""
    nodes = needed(computed)
    asking = {node for node in nodes if node.op in ORDERS and node.varies and node in computed}
    depths = depths_of(nodes, asking)
    if max(depths.values(), default=0) < IN_TURN:
        return set()
    return {node for node in computed if depths[node] > (node.op in ORDERS)}


def depths_of(nodes: Iterable[Expr], counted: Collection[Expr]) -> dict[Expr, int]:
    """Return of how many expressions of a set each is computed at most, one of the other."""
    depths: dict[Expr, int] = {}
    for node in nodes:
        depths[node] = max((depths.get(arg, 0) for arg in node.args), default=0) + (node in counted)
    return depths
