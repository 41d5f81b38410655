"""Ideal relays that act on the rates of each other's inputs, where all of these are affine in each.

With u' = a + B v of several relays, those that slide have the outputs that keep their inputs where
they are, given those of the others.  Filippov's field is one there: every convex combination of the
fields on all sides is a + B v, with a v between the heights, and u' = 0 says which.  What a relay's
own output v does to the rate of its own input follows by elimination of all others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce

from ...expressions.bends import replaced_parts
from ...expressions.dependence import affine
from ...expressions.graph import Expr, Graph, needed
from .pieces import LeafDerivative

_MOST = 6  # of which rates have products: each is read for itself
_ROUNDING = 1e-9  # of what a relay does to its input, when others have been eliminated
Slopes = Callable[[Expr], LeafDerivative]


@dataclass(frozen=True, kw_only=True)
class Coupled:
    """A relay among others."""

    leaf: Expr  # what stands for its output
    rate: Expr  # of its input, made of all leaves
    decays: Expr  # what is left of the input, times the rate at which that decays
    slides: Expr  # whether it does
    held: Expr  # what it outputs if it does not


def own_rates(
    graph: Graph, relays: Sequence[Coupled], slope: Slopes, products: bool
) -> list[tuple[Expr, Expr]] | None:
    """Return a and b of each relay's u' = a + b v, others sliding or not; None if not affine."""
    # With `products` rates may be made of products of what some do, of which one slides at a time.
    leaves = [relay.leaf for relay in relays]
    if any(relay.rate.size or not affine(relay.rate, leaf) for relay in relays for leaf in leaves):
        return None
    system = _system(graph, relays, slope)
    if set(leaves).isdisjoint(needed([e for row in system.b for e in row])):
        return [system.alone(k) for k in range(len(relays))]
    if not products or len(relays) > _MOST:
        return None
    return [_one_by_one(graph, relays, slope, k) for k in range(len(relays))]


def _system(graph: Graph, relays: Sequence[Coupled], slope: Slopes) -> _System:
    """Return the rates of the inputs of several relays, read off as a + B v."""
    leaves, zero = [relay.leaf for relay in relays], graph.const(0.0)
    a = replaced_parts(graph, [relay.rate for relay in relays], dict.fromkeys(leaves, zero))
    b = [[slope(leaf)(relay.rate) or zero for leaf in leaves] for relay in relays]
    return _System(graph=graph, relays=tuple(relays), a=tuple(a), b=tuple(map(tuple, b)))


def _one_by_one(
    graph: Graph, relays: Sequence[Coupled], slope: Slopes, k: int
) -> tuple[Expr, Expr]:
    """Return a and b of relay `k`, where rates are made of products of what two do."""
    # They are a + b v for each of them while the other does not slide.  Where both did, no one v
    # would be Filippov's: one that meets another that slides passes, by the sign of its input.
    op, zero, relay = graph.op, graph.const(0.0), relays[k]
    instead = {
        other.leaf: op("select", other.slides, other.leaf, other.held)
        for other in relays if other is not relay
    }  # fmt: skip
    rates = replaced_parts(graph, [other.rate for other in relays], instead)
    pairs = zip(relays, rates, strict=True)
    system = _system(graph, [replace(other, rate=rate) for other, rate in pairs], slope)
    partners = [_multiplies(system, k, j) for j in range(len(relays))]
    none = dict.fromkeys((other.leaf for other in relays), zero)
    b = tuple(tuple(replaced_parts(graph, row, none)) for row in system.b)
    drift, gain = replace(system, b=b).alone(k)
    stays = graph.const(False)
    for j, other in enumerate(relays):
        if partners[j]:
            first = other.slides if j < k else op("and", other.slides, op("not", relay.slides))
            stays = op("or", stays, first)
    return op("select", stays, zero, drift), op("select", stays, graph.const(1.0), gain)


def _multiplies(system: _System, k: int, j: int) -> bool:
    """Whether a rate has a product of what relays `k` and `j` do."""
    leaf = system.relays[j].leaf
    return j != k and leaf in needed([row[k] for row in system.b])


@dataclass(frozen=True, kw_only=True)
class _System:
    """The rates a + B v of several relays' inputs."""

    graph: Graph
    relays: tuple[Coupled, ...]
    a: tuple[Expr, ...]
    b: tuple[tuple[Expr, ...], ...]

    @cached_property
    def counts(self) -> list[Expr]:
        """Whether each slides, and its input is not at rest because those before it are."""
        # Two masses that stick to each other and to the ground: one of three forces is free.
        op, counts = self.graph.op, list[Expr]()
        a, b = list(self.a), [list(row) for row in self.b]
        for j, relay in enumerate(self.relays):
            counts.append(op("and", relay.slides, op("not", self._is_gone(b[j][j], j))))
            self._eliminate(a, b, j, counts[j], range(j + 1, len(self.relays)))
        return counts

    def _is_gone(self, gain: Expr, k: int) -> Expr:
        """Whether nothing but rounding is left of what a relay does to its own input."""
        op = self.graph.op
        size = op("mul", self.graph.const(_ROUNDING), op("absolute", self.b[k][k]))
        return op("le", op("absolute", gain), size)

    def _eliminate(
        self, a: list[Expr], b: list[list[Expr]], j: int, counts: Expr, left: Sequence[int]
    ) -> None:
        """Put what relay `j` outputs into the rates of those that are left."""
        op, zero, relay = self.graph.op, self.graph.const(0.0), self.relays[j]
        rest = op("add", a[j], relay.decays)
        held = op("select", relay.slides, zero, relay.held)
        for i in left:
            part = op("div", b[i][j], b[j][j])
            keeping, constant = op("neg", op("mul", part, rest)), op("mul", b[i][j], held)
            a[i] = op("add", a[i], op("select", counts, keeping, constant))
            for m in left:
                through = op("select", counts, op("mul", part, b[j][m]), zero)
                b[i][m] = op("sub", b[i][m], through)

    def alone(self, k: int) -> tuple[Expr, Expr]:
        """Return a and b of relay `k`, with all others eliminated."""
        op, zero, left = self.graph.op, self.graph.const(0.0), list(range(len(self.relays)))
        a, b = list(self.a), [list(row) for row in self.b]
        for j in range(len(self.relays)):
            if j != k:
                left.remove(j)
                self._eliminate(a, b, j, self.counts[j], left)
        gone = self._is_gone(b[k][k], k)
        sizes = [op("absolute", e) for e in (self.a[k], *self.b[k])]
        size = reduce(lambda one, other: op("add", one, other), sizes)
        small = op("le", op("absolute", a[k]), op("mul", self.graph.const(_ROUNDING), size))
        at_rest = op("and", gone, small)
        return op("select", at_rest, zero, a[k]), op("select", gone, zero, b[k][k])
