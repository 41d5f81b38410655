"""Conditions that may have been met, and how the time of the one that was moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..expressions.graph import Expr, Graph

_AGREE = 1e-6  # derivatives of a time by two conditions that are one
_AT_REST = 1e2  # times what is passed at once: a time that moves by less stands still


@dataclass(frozen=True, kw_only=True)
class When:
    """How the time at which something happens moves."""

    moves: list[Expr]  # its derivative by each quantity
    grazes: Expr  # whether what it depends on is there at a rate of 0
    apart: list[Expr]  # by each quantity, whether two conditions say different things
    happens: Expr  # whether anything happens at a time that moves
    met: Expr  # whether anything has been met at a rate

    def unless(self, condition: Expr, other: When, graph: Graph) -> When:
        """Return this, or another if a condition holds."""

        def either(one: Expr, two: Expr) -> Expr:
            return graph.op("select", condition, two, one)

        def each(ones: Sequence[Expr], twos: Sequence[Expr]) -> list[Expr]:
            return [either(*pair) for pair in zip(ones, twos, strict=True)]

        return When(
            moves=each(self.moves, other.moves), apart=each(self.apart, other.apart),
            grazes=either(self.grazes, other.grazes), happens=either(self.happens, other.happens),
            met=either(self.met, other.met),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A condition that may have been met."""

    met: Expr  # whether it was
    moves: list[Expr]  # the derivative by each quantity of the time at which it was
    grazes: Expr  # whether it was at a rate of 0


def when_of(graph: Graph, causes: Sequence[Cause], by: int, rounding: Expr) -> When:
    """Return how a time moves by `by` quantities, by the first condition that was met at a rate."""
    # What is left of a state at rest, such as a velocity that sticks, may change its sign where
    # something else sets it in motion. That is met at no rate, and says nothing.
    no, zero = graph.const(False), graph.const(0.0)
    moves, grazes, moving = [zero] * by, no, no
    for cause in reversed(causes):
        met = graph.op("and", cause.met, graph.op("not", cause.grazes))
        pairs = zip(cause.moves, moves, strict=True)
        moves = [graph.op("select", met, a, b) for a, b in pairs]
        moving = graph.op("or", moving, met)
        grazes = graph.op("or", grazes, graph.op("and", cause.met, cause.grazes))
    grazes = graph.op("and", grazes, graph.op("not", moving))
    apart, happens = [no] * by, no
    for cause in causes:
        met = graph.op("and", cause.met, graph.op("not", cause.grazes))
        for j, move in enumerate(cause.moves):
            differs = differ(graph, move, moves[j], rounding)
            apart[j] = graph.op("or", apart[j], graph.op("and", met, differs))
    for move in moves:
        happens = graph.op("or", happens, graph.op("ne", move, zero))
    return When(moves=moves, grazes=grazes, apart=apart, happens=happens, met=moving)


def at_once(graph: Graph, one: When, other: When, rounding: Expr) -> list[Expr]:
    """Return by each quantity whether what is met at one instant says different things."""
    rows = zip(one.moves, other.moves, other.apart, strict=True)
    differing = [graph.op("or", apart, differ(graph, a, b, rounding)) for a, b, apart in rows]
    return [graph.op("and", other.met, differs) for differs in differing]


def differ(graph: Graph, one: Expr, other: Expr, rounding: Expr) -> Expr:
    """Return whether two times move by different derivatives."""
    gap = graph.op("absolute", graph.op("sub", one, other))
    size = graph.op("add", graph.op("absolute", one), graph.op("absolute", other))
    still = graph.op("mul", graph.const(_AT_REST), rounding)
    least = graph.op("add", still, graph.op("mul", graph.const(_AGREE), size))
    return graph.op("gt", gap, least)
