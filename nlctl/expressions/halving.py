"""Searches by halves that are written as loops of so many passes.

``for _ in range(40): mid = (lo + hi) / 2; if f(mid) > 0: hi = mid`` asks in each pass for what
those before have chosen.  Where one answer changes, the later ones change with it, and what comes
out hardly does: a staircase of 2^40 steps, none of which is a jump.  Its derivative would be 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import permutations

from .graph import ORDERS, Expr, Graph, Untraceable, needed

_MADE = ("add", "sub", "mul", "div")  # no choice among constants, as of a table
_HALVINGS = 16  # comparisons, each of what the one before has chosen


class Staircase(Untraceable):
    """What a function computes has steps smaller than rounding: no expression has its slope."""


class Halving:
    """What the passes of a loop compute."""

    __slots__ = ("computed", "graph", "place")  # one thing for loops inside, whatever it notes

    def __init__(self, graph: Graph) -> None:
        self.graph, self.place, self.computed = graph, len(graph.passing), set[Expr]()
        graph.passing.append(self.computed)

    def end(self) -> None:
        """Note that what is asked of a long chain is not located; a staircase is called instead."""
        del self.graph.passing[self.place :]
        self.graph.of_passes |= asked_in_turn(self.computed)


def asked_in_turn(computed: set[Expr]) -> set[Expr]:
    """Return what is computed of earlier answers where there are many; refuse a staircase."""
    nodes = needed(computed)
    asking = {node for node in nodes if node.op in ORDERS and node.varies and node in computed}
    depths = _depths(nodes, asking)
    if max(depths.values(), default=0) < _HALVINGS:
        return set()
    deep = {node for node in computed if depths[node] > (node.op in ORDERS)}
    flowing = _flowing(nodes)
    stands = [n for n in deep if n.op in _MADE and n.varies and n.kind == "f" and n not in flowing]
    narrowed = _depths(nodes, _narrowing(nodes))
    if max(narrowed.values()) >= _HALVINGS or any(depths[n] >= _HALVINGS - 1 for n in stands):
        raise Staircase("a search by halves, of whose derivative no pass knows")
    return deep


def _depths(nodes: Iterable[Expr], counted: set[Expr]) -> dict[Expr, int]:
    """Return of how many expressions of a set each is computed at most, one of the other."""
    depths: dict[Expr, int] = {}
    for node in nodes:
        depths[node] = max((depths[arg] for arg in node.args), default=0) + (node in counted)
    return depths


def _flowing(nodes: Iterable[Expr]) -> set[Expr]:
    """Return what moves while all answers are what they are."""
    flowing = set[Expr]()
    for node in nodes:
        chosen = node.args[1:] if node.op == "select" else node.args
        moves = node.op == "leaf" or any(arg in flowing for arg in chosen)
        if moves and node.varies and node.kind != "b":
            flowing.add(node)
    return flowing


def _narrowing(nodes: Iterable[Expr]) -> set[Expr]:
    """Return the conditions by which a bracket is narrowed: an end becomes what is between both."""
    # `if above: high = middle`, `else: low = middle`, of golden sections two such places
    choices: dict[Expr, list[Expr]] = {}
    for node in nodes:
        if node.op == "select":
            choices.setdefault(node.args[0], []).append(node)
    return {
        condition
        for condition, chosen in choices.items()
        for (_, new_high, high), (_, low, new_low) in permutations([c.args for c in chosen], 2)
        if {low, high} <= _combined(new_high) and {low, high} <= _combined(new_low)
    }


def _combined(middle: Expr) -> set[Expr]:
    """Return of which choices and numbers something is an affine combination, as no secant is."""
    if middle.op not in _MADE:
        return set()
    combined, waiting = set[Expr](), [middle]
    while waiting:
        node = waiting.pop()
        if node.op in ("const", "select"):
            combined.add(node)
        elif node.op in ("add", "sub", "neg") or (
            node.op in ("mul", "div") and any(arg.op == "const" for arg in node.args)
        ):
            waiting += node.args
        else:
            return set()
    return combined
