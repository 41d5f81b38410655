"""Whether a choice only bends what expressions are, or they jump where it switches."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from operator import attrgetter

import numpy as np

from .evaluate import value_of
from .graph import COMPARISONS, ORDERS, Expr, Graph, Untraceable, deduce, needed, parts_first

_SIDES = {"sign": (1.0, -1.0), "heaviside": (1.0, 0.0)}  # values above 0 and below
_POINTS = 256
_FAR = 256  # parts that differ on both sides, one made of the other: so far on, it is a jump
_NEAR = 0.1  # of a parameter
_SAME = 1e-12
_ROUNDED = 1e-14  # relative difference of what is equal but for rounding


class Bending:
    """Which conditions only bend what some expressions are made of, with such parameters."""

    def __init__(self, graph: Graph, roots: Sequence[Expr], p: np.ndarray) -> None:
        self.graph, self.roots = graph, roots
        self.nodes = needed(roots)
        self.readers: dict[Expr, list[Expr]] = {}
        for node in self.nodes:
            for arg in dict.fromkeys(node.args):
                self.readers.setdefault(arg, []).append(node)
        self.arrays = _at_random(graph.nodes, p)

    def only_bends(self, condition: Expr) -> bool:
        """Return whether nothing that the expressions are made of jumps at a condition."""
        if condition.op not in (*ORDERS, *_SIDES, "copysign") or condition.size is not None:
            return False
        one, other = _compared(self.graph, condition)
        tied = [n for n in self.nodes if _is_tied(self.graph, n, (one, other))]
        sides = [_on_side(self.graph, tied, one, above) for above in (True, False)]
        pair = (one, other) if one.varies else (other, one)
        try:
            with np.errstate(all="ignore"):  # infinite on both sides is not known to agree
                return self._agree(_Point(self.arrays, tied, pair), sides)
        except Untraceable:
            return False

    def _agree(self, point: _Point, sides: Sequence[Mapping[Expr, bool | float]]) -> bool:
        """Return whether roots are the same on both sides; what agrees on the way goes no further.

        Where a condition chooses one of two pieces of a table these have the same value there, and
        so has whatever is made of them.
        """
        apart: dict[Expr, list[np.ndarray]] = {}
        waiting = [n.index for n in point.tied]
        heapq.heapify(waiting)
        done: set[Expr] = {point.moved}
        while waiting:
            node = self.graph.nodes[heapq.heappop(waiting)]
            if node in done or point.is_free(node):
                continue
            done.add(node)
            a, b = (point.on_side(node, apart, side, k) for k, side in enumerate(sides))
            alike = np.all(abs(_less(a, b)) <= _ROUNDED * (abs(a) + abs(b)))
            if alike and node not in point.tied:
                point.values[node] = a
                continue
            apart[node] = [a, b]
            if len(apart) > _FAR:
                return False
            for reader in self.readers.get(node, ()):
                heapq.heappush(waiting, reader.index)
        return all(
            np.all(abs(_less(a, b)) <= _SAME * (1 + abs(a) + abs(b)))
            for a, b in (apart[root] for root in dict.fromkeys(self.roots) if root in apart)
        )


def _compared(graph: Graph, condition: Expr) -> tuple[Expr, Expr]:
    """Return the two numbers of which a condition asks which is larger."""
    numbers = [graph.number(arg) for arg in condition.args]
    one = numbers[1 if condition.op == "copysign" else 0]
    return one, numbers[1] if condition.op in ORDERS else graph.const(0.0)


def _is_tied(graph: Graph, node: Expr, numbers: tuple[Expr, Expr]) -> bool:
    """Return whether a condition asks which of these two numbers is larger."""
    if node.op not in (*ORDERS, *_SIDES, "copysign"):
        return False
    return _compared(graph, node) in (numbers, numbers[::-1])


def _on_side(
    graph: Graph, tied: Sequence[Expr], one: Expr, above: bool
) -> dict[Expr, bool | float]:
    """Return what conditions on the same two numbers are where `one` is above the other."""
    values: dict[Expr, bool | float] = {}
    for node in tied:
        larger = above == (_compared(graph, node)[0] is one)
        if node.op in ORDERS:
            values[node] = larger == (node.op in ("gt", "ge"))
        else:  # of copysign it is the sign
            values[node] = _SIDES.get(node.op, _SIDES["sign"])[0 if larger else 1]
    return values


def _less(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.subtract(a, b, dtype=float)  # of truth values as well, of guards


class _Point:
    """Values at random where a condition switches, as far as they are asked for."""

    # What is met only rarely would not be met by values at random: so other conditions are true or
    # false, whatever they ask for. Only those that parameters alone decide, where this condition
    # switches, are what they are; unless they switch there, too.

    def __init__(
        self, arrays: Mapping[str, np.ndarray], tied: Sequence[Expr], pair: tuple[Expr, Expr]
    ) -> None:
        self.moved, place = pair
        self.arrays, self.tied = arrays, set(tied)
        self.values: dict[Expr, np.ndarray] = {}
        self.moving: dict[Expr, bool] = {}
        self.free: dict[Expr, bool] = {}
        (at_place,) = self.of([place])
        moves = self._moves(place)
        self.values, self.moving, self.free = {self.moved: at_place}, {self.moved: moves}, {}

    def of(self, exprs: Sequence[Expr]) -> list[np.ndarray]:
        """Return the values of expressions."""
        for node in parts_first(exprs, self._parts):
            if node not in self.values:
                self.values[node] = self._value(node)
        return [self.values[expr] for expr in exprs]

    def on_side(
        self, node: Expr, apart: Mapping[Expr, Sequence[np.ndarray]],
        sides: Mapping[Expr, bool | float], k: int,
    ) -> np.ndarray:  # fmt: skip
        """Return the value of an expression on one side, of parts some of which differ there."""
        if node in sides and node.op != "copysign":
            return np.asarray(sides[node])
        values = self.values
        if unknown := [arg for arg in node.args if arg not in values and arg not in apart]:
            self.of(unknown)
        parts = [apart[a][k] if a in apart else values[a] for a in node.args]
        if node in sides:
            return abs(parts[0]) * np.asarray(sides[node])
        return value_of(node, parts, self.arrays)

    def _parts(self, node: Expr) -> tuple[Expr, ...]:
        return () if node in self.values or self.is_free(node) else node.args

    def _value(self, node: Expr) -> np.ndarray:
        if self.is_free(node):
            rng = np.random.default_rng((2, node.index))
            return rng.random((node.size, _POINTS) if node.size else _POINTS) < 0.5
        return value_of(node, [self.values[arg] for arg in node.args], self.arrays)

    def is_free(self, node: Expr) -> bool:
        if node.op not in COMPARISONS or node in self.tied:
            return False
        if node not in self.free:
            self.free[node] = self._moves(node) or (node.op in ORDERS and self._is_met(node))
        return self.free[node]

    def _is_met(self, node: Expr) -> bool:
        """Whether a comparison that parameters decide switches here, too."""
        a, b = self.of(node.args)
        return bool(np.all(abs(_less(a, b)) <= _SAME * (abs(a) + abs(b))))

    def _moves(self, node: Expr) -> bool:
        """Whether an expression depends on more than parameters."""
        moving = self.moving

        def of_parts(part: Expr) -> bool:
            is_read = part.op == "leaf" and part.data[0] != "p"
            return is_read or part.op in ("call", "solve") or any(moving[a] for a in part.args)

        return deduce(moving, node, attrgetter("args"), of_parts)


def _at_random(nodes: Iterable[Expr], p: np.ndarray) -> dict[str, np.ndarray]:
    """Return values for all that expressions read."""
    rng, rows = np.random.default_rng(1), dict.fromkeys(("t", "x", "u"), 1)
    for node in nodes:
        if node.op == "leaf" and node.data[0] in rows:
            array, start, step = node.data
            rows[array] = max(rows[array], start + step * ((node.size or 1) - 1) + 1)
    arrays = {name: rng.normal(size=(n, _POINTS)) for name, n in rows.items()}
    size = np.where((p == 0.0) | ~np.isfinite(p), 1.0, np.abs(p))[:, None]
    arrays["p"] = p[:, None] + _NEAR * size * rng.normal(size=(p.size, _POINTS))
    arrays["p"][:, ::2] = p[:, None]  # what asks whether one is 0 has another answer next to it
    return arrays


def replaced_parts(graph: Graph, exprs: Sequence[Expr], instead: Mapping[Expr, Expr]) -> list[Expr]:
    """Return expressions with others in the places of some of their parts."""
    new: dict[Expr, Expr] = {}
    for node in needed(exprs, instead):
        args = tuple(new.get(a, a) for a in node.args)
        if node in instead:
            new[node] = instead[node]
        elif args != node.args:
            new[node] = graph.like(node, *args)
    return [new.get(e, e) for e in exprs]
