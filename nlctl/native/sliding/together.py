"""Ideal relays that act on the rates of each other's inputs, where all of these are affine.

With u' = a + B v of several relays, those that slide have the outputs that keep their inputs where
they are, given those of the others.  Filippov's field is one there: every convex combination of the
fields on all sides is a + B v, with a v between the heights, and u' = 0 says which.  What a relay's
own output v does to the rate of its own input follows by elimination of all others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

from ...expressions.bends import replaced_parts
from ...expressions.dependence import affine
from ...expressions.graph import Expr, Graph, needed
from .pieces import LeafDerivative

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
    graph: Graph, relays: Sequence[Coupled], slope: Slopes
) -> list[tuple[Expr, Expr]] | None:
    """Return a and b of each relay's u' = a + b v, others sliding or not; None if not affine."""
    leaves = [relay.leaf for relay in relays]
    if any(relay.rate.size or not affine(relay.rate, leaf) for relay in relays for leaf in leaves):
        return None
    zero = graph.const(0.0)
    a = replaced_parts(graph, [relay.rate for relay in relays], dict.fromkeys(leaves, zero))
    b = [[slope(leaf)(relay.rate) or zero for leaf in leaves] for relay in relays]
    if not set(leaves).isdisjoint(needed([e for row in b for e in row])):
        return None
    system = _System(graph=graph, relays=tuple(relays), a=tuple(a), b=tuple(map(tuple, b)))
    return [system.alone(k) for k in range(len(relays))]


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
