"""Second-order sliding: an ideal relay that acts on the second derivative of its input alone.

Where u' = a does not depend on the relay's output v and u'' = A(v) does, a relay with
A(height) < 0 < A(-height) throws u back and forth through 0.  From one passage with the rate z to
the next |z| changes by -+2/3 J z^2 / A^2 with v = +-height, up to z^3, where J = u''' with v held:
y = z t + A t^2 / 2 + J t^3 / 6 is 0 again at t = -2 z / A + ..., and y' is there -z + J t^2 / 6.
Over both ways |z| falls where

    J(height) / A(height)^2 > J(-height) / A(-height)^2

whatever other states do, as these are in J.  So the motion on u = u' = 0 is the limit, locally.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...expressions.bends import replaced_parts
from ...expressions.dependence import affine
from ...expressions.derivatives import tangents
from ...expressions.graph import Expr, Graph, Untraceable, needed
from .pieces import LeafDerivative, bend_places, unreadable, zero_between


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Parameters of an ideal relay, as expressions; see there."""

    height: Expr
    rest: Expr
    rate: Expr
    rest_rate: Expr


def second_order(
    graph: Graph,
    given: Expr,
    rate: Expr,
    leaf: Expr,
    limits: Limits,
    along: Callable[[Expr], Expr | None],
    slope: LeafDerivative,
) -> tuple[tuple[Expr, Expr], tuple[Expr, Expr]] | None:
    """Return what a relay is given instead of a and b of its input's rate, and outputs by."""
    # The first leads to u = 0 from both sides where it slides, and is u' elsewhere.  The second is
    # such that the output is, within the height, the one with u'' = -2 r u' - r^2 u: r is
    # rest_rate / (2 rest), so that from u = 0 it comes no further than `rest`.
    # None where there is no second-order sliding to be read off.
    try:
        (force,) = tangents(graph, [rate], along)
        (jerk,) = tangents(graph, [force], along) if force is not None else (None,)
    except Untraceable:
        return None
    if force is None or leaf not in needed([force]):
        return None
    if not affine(force, leaf) and unreadable(graph, force, leaf, slope):
        return None
    breaks = bend_places(graph, force, leaf, slope)
    line, piece = zero_between(graph, force, leaf, limits.height, breaks)
    ready = _ready(graph, rate, (force, jerk or graph.const(0.0)), leaf, limits)
    held = (
        graph.op("select", ready, line[0], rate),
        graph.op("select", ready, line[1], graph.const(0.0)),
    )
    return held, _output(graph, given, rate, piece, limits)


def _ready(graph: Graph, rate: Expr, forces: tuple[Expr, Expr], leaf: Expr, limits: Limits) -> Expr:
    """Return whether passages through u = 0 become slower, and are slow: within what is at rest."""
    op = graph.op
    slow, square = op("lt", op("absolute", rate), limits.rest_rate), op("mul", rate, rate)
    sides = []
    for v in (limits.height, op("neg", limits.height)):
        A, J = replaced_parts(graph, forces, {leaf: v})
        sides.append(op("div", J, op("mul", A, A)))
        slow = op("and", slow, op("lt", square, op("mul", limits.rest, op("absolute", A))))
    return op("and", op("gt", *sides), slow)


def _output(
    graph: Graph, given: Expr, rate: Expr, piece: list[Expr], limits: Limits
) -> tuple[Expr, Expr]:
    """Return a and b from which a relay with this input finds its output."""
    op = graph.op
    r = op("div", limits.rest_rate, op("mul", graph.const(2.0), limits.rest))
    back = op(
        "add", op("mul", op("mul", graph.const(2.0), r), rate), op("mul", op("mul", r, r), given)
    )
    v = op("neg", op("div", op("add", piece[0], back), piece[1]))
    v = op("maximum", op("minimum", v, limits.height), op("neg", limits.height))
    return op("sub", v, op("mul", limits.rate, given)), graph.const(-1.0)
