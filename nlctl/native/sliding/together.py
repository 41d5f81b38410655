"""Ideal relays that act on the rates of each other's inputs, where all of these are affine.

With u' = a + B v of several relays, those that slide have the outputs that keep their inputs where
they are, given those of the others.  Filippov's field is one there: every convex combination of the
fields on all sides is a + B v, with a v between the heights, and u' = 0 says which.  What a relay's
own output v does to the rate of its own input follows by elimination of all others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...expressions.bends import replaced_parts
from ...expressions.dependence import affine
from ...expressions.graph import Expr, Graph, needed
from .pieces import LeafDerivative

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
    return [_alone(graph, relays, list(a), [list(row) for row in b], k) for k in range(len(relays))]


def _alone(
    graph: Graph, relays: Sequence[Coupled], a: list[Expr], b: list[list[Expr]], k: int
) -> tuple[Expr, Expr]:
    """Return a and b of relay `k`, with all others eliminated."""
    op, left = graph.op, list(range(len(relays)))
    for j, relay in enumerate(relays):
        if j == k:
            continue
        left.remove(j)
        rest = op("add", a[j], relay.decays)
        for i in left:
            part = op("div", b[i][j], b[j][j])
            sliding, held = op("neg", op("mul", part, rest)), op("mul", b[i][j], relay.held)
            a[i] = op("add", a[i], op("select", relay.slides, sliding, held))
            for m in left:
                through = op("select", relay.slides, op("mul", part, b[j][m]), graph.const(0.0))
                b[i][m] = op("sub", b[i][m], through)
    return a[k], b[k][k]
