"""Searches by halves that are written as loops of so many passes.

``for _ in range(40): mid = (lo + hi) / 2; if f(mid) > 0: hi = mid`` asks in each pass for what
those before have chosen.  Where one answer changes, the later ones change with it, and what comes
out hardly does: a staircase of 2^40 steps, none of which is a jump.  Its derivative would be 0.
"""

from __future__ import annotations

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
    depths: dict[Expr, int] = {}
    flows: dict[Expr, bool] = {}  # whether it moves while all answers are what they are
    for node in needed(computed):
        asks = node.op in ORDERS and node.varies and node in computed
        depths[node] = max((depths[arg] for arg in node.args), default=0) + asks
        chosen = node.args[1:] if node.op == "select" else node.args
        moves = node.op == "leaf" or any(flows[arg] for arg in chosen)
        flows[node] = moves and node.varies and node.kind != "b"
    if max(depths.values(), default=0) < _HALVINGS:
        return set()
    if _narrowed(computed) >= _HALVINGS:
        raise Staircase("a search by halves, of whose derivative no pass knows")
    deep = {node for node in computed if depths[node] > (node.op in ORDERS)}
    stands = (n for n in deep if n.op in _MADE and n.varies and n.kind == "f" and not flows[n])
    if any(depths[node] >= _HALVINGS - 1 for node in stands):
        raise Staircase("a search by halves, of whose derivative no pass knows")
    return deep


def _narrowed(computed: set[Expr]) -> int:
    """Return how often at most a bracket is narrowed in turn: one end becomes what is between."""
    # `if above: high = middle`, `else: low = middle`; where two are exchanged they are sorted
    choices: dict[Expr, list[Expr]] = {}
    nodes = needed(computed)
    for node in nodes:
        if node.op == "select":
            choices.setdefault(node.args[0], []).append(node)
    narrowing = {
        condition
        for condition, chosen in choices.items()
        for one, other in permutations(chosen, 2)
        if one.args[1] is other.args[2]
        and one.args[2] is not other.args[1]
        and one.args[1].op in _MADE
        and _is_between(one.args[1])
    }
    depths: dict[Expr, int] = {}
    for node in nodes:
        depths[node] = max((depths[arg] for arg in node.args), default=0) + (node in narrowing)
    return max(depths.values(), default=0)


def _is_between(middle: Expr) -> bool:
    """Whether something is an affine combination of what was chosen, as secants are not."""
    if middle.op in ("const", "select"):
        return True
    parts = middle.args
    if middle.op in ("mul", "div") and any(arg.op == "const" for arg in parts):
        return all(map(_is_between, parts))
    return middle.op in ("add", "sub", "neg") and all(map(_is_between, parts))
