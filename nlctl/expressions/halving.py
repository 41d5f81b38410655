"""Searches by halves that are written as loops of so many passes.

``for _ in range(40): mid = (lo + hi) / 2; if f(mid) > 0: hi = mid`` asks in each pass for what
those before have chosen.  Where one answer changes, the later ones change with it, and what comes
out hardly does: a staircase of 2^40 steps, none of which is a jump.
"""

from __future__ import annotations

from .graph import ORDERS, Expr, Graph, needed

_HALVINGS = 16  # comparisons, each of what the one before has chosen


class Halving:
    """What the passes of a loop compute."""

    __slots__ = ("computed", "graph", "place")  # one thing for loops inside, whatever it notes

    def __init__(self, graph: Graph) -> None:
        self.graph, self.place, self.computed = graph, len(graph.passing), set[Expr]()
        graph.passing.append(self.computed)

    def end(self) -> None:
        """Note what is asked of a search by halves: none of it is located but the beginning."""
        del self.graph.passing[self.place :]
        depths: dict[Expr, int] = {}
        for node in needed(self.computed):
            asks = node.op in ORDERS and node.varies and node in self.computed
            depths[node] = max((depths[arg] for arg in node.args), default=0) + asks
        if max(depths.values(), default=0) >= _HALVINGS:
            deep = {node for node in self.computed if depths[node] > (node.op in ORDERS)}
            self.graph.of_passes |= deep
