"""Corners of what drives a memory: where its rate jumps, such as those of a triangular wave.

A memory that reverses at one keeps what it was driven to there, at a time t* that moves: its
derivative becomes S- + f- t*', with the derivative S- and the rate f- of what has driven it until
then.  At a smooth turn f- is 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..expressions.bends import replaced_parts
from ..expressions.conditions import conditions, number_rooted
from ..expressions.graph import ORDERS, Expr, Graph
from .directions import Direction
from .source import EquationParts

_BETWEEN = 1e-3  # of how late a turn may be seen: on either side of a corner


@dataclass(frozen=True, kw_only=True)
class Corner:
    """A corner that may be here."""

    here: Expr  # whether it is
    moves: list[Expr]  # the derivative by each quantity of the time at which it is passed
    node: Expr  # the operation in what drives a memory
    before: Expr  # what stands for that before it


def corners_of(
    source: EquationParts, become: Expr, seeds: Sequence[Direction], longest: Expr
) -> list[Corner]:
    """Return the corners of what drives a memory but for those where the memory is met."""
    graph, jumps, corners = source.graph, set(source.jumps), []
    for node in conditions([become]):
        if node in jumps or node.size is not None:
            continue
        level, above, below = _sides(graph, node)
        if level is None or source.leaves([level], source.driven):
            continue
        (rate,) = source.slopes([level], source.time(source.flow, delays_move=False))
        if rate is None:
            continue
        little = graph.op("mul", graph.const(_BETWEEN), longest)
        little = graph.op("mul", little, source.with_bounded_inputs(rate))
        was, is_then = (
            graph.op("gt", graph.op(op, level, little), graph.const(0.0)) for op in ("sub", "add")
        )
        here = graph.op("ne", graph.number(was), graph.number(is_then))
        side = graph.op("select", was, above, below)
        changes = [source.changes([level], seed)[0] for seed in seeds]
        corners.append(Corner(
            here=here, node=node, before=graph.op("select", here, side, node),
            moves=[graph.op("neg", graph.op("div", change, rate)) for change in changes],
        ))  # fmt: skip
    return corners


def at_corner(
    source: EquationParts, become: Expr, corners: Sequence[Corner], seeds: Sequence[Direction]
) -> tuple[Expr, list[Expr]]:
    """Return whether there is a corner now, and the derivatives that a memory keeps then."""
    graph = source.graph
    here, zero = graph.const(False), graph.const(0.0)
    moves = [zero] * len(seeds)
    for corner in reversed(corners):
        here = graph.op("or", here, corner.here)
        pairs = zip(corner.moves, moves, strict=True)
        moves = [graph.op("select", corner.here, a, b) for a, b in pairs]
    before = {corner.node: corner.before for corner in corners}
    (driving,) = replaced_parts(graph, [become], before)
    (rate,) = source.changes([driving], source.time(source.flow, delays_move=False))
    kept = [
        graph.op("add", source.changes([driving], seed)[0], graph.op("mul", rate, move))
        for seed, move in zip(seeds, moves, strict=True)
    ]
    return here, kept


def _sides(graph: Graph, node: Expr) -> tuple[Expr | None, Expr, Expr]:
    """Return what is 0 at a corner, and what an operation is above that and below."""
    op, args = node.op, [graph.number(arg) for arg in node.args]
    one, yes, no = graph.const(1.0), graph.const(True), graph.const(False)
    square = number_rooted(node)
    if square is not None:
        return square, square, graph.op("neg", square)
    if op in ORDERS or op in ("minimum", "maximum"):
        level = graph.op("sub", *args)
        sides = {"minimum": args[::-1], "maximum": args}.get(op)
        sides = sides or ([yes, no] if op in ("gt", "ge") else [no, yes])
        return level, sides[0], sides[1]
    if op == "absolute":
        return args[0], args[0], graph.op("neg", args[0])
    if op == "sign":
        return args[0], one, graph.op("neg", one)
    if op == "heaviside":
        return args[0], one, graph.const(0.0)
    if op == "copysign":
        size = graph.op("absolute", args[0])
        return args[1], size, graph.op("neg", size)
    return None, one, one
