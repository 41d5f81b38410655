"""Derivatives of what has none: opaque functions, by differences that are expressions, too.

A call y = f(z) has the derivative (f(z + h z') - f(z - h z')) / (2 h) along z'.  These are two
more calls, so all that reads expressions reads them.  The step h moves z by a fixed part of its
size: what z' is otherwise, such as the unit of a direction, does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .graph import Expr, Graph

RELATIVE_STEP = float(
    np.cbrt(np.finfo(float).eps)
)  # errors of rounding and of the formula are alike


def opaque_difference(graph: Graph, call: Expr, tangents: Sequence[Expr | None]) -> Expr:
    """Return the derivative of an opaque call along the derivatives of its arguments."""
    op, const = graph.op, graph.const
    sizes = call.data[1]
    speed = op("sqrt", _squares(graph, call.args, tangents, sizes))
    moves = op("gt", speed, const(0.0))
    h = op("select", moves, op("div", const(RELATIVE_STEP), speed), const(0.0))
    ahead, behind = (_moved(graph, call, tangents, step) for step in (h, op("neg", h)))
    factor = op("select", moves, op("div", speed, const(2.0 * RELATIVE_STEP)), const(0.0))
    if call.size == 1:  # a number, not a loop of one element
        ahead, behind = graph.item(ahead, 0), graph.item(behind, 0)
    return op("mul", op("sub", ahead, behind), factor)


def _squares(
    graph: Graph, args: Sequence[Expr], tangents: Sequence[Expr | None], sizes: Sequence[int]
) -> Expr:
    """Return the sum of squares of all changes, each relative to the size of what changes."""
    total = graph.const(0.0)
    for arg, tangent, size in zip(args, tangents, sizes, strict=True):
        if tangent is None:
            continue
        around = graph.op("maximum", graph.const(1.0), graph.op("absolute", graph.number(arg)))
        part = graph.op("div", tangent, around)
        square = graph.op("mul", part, part)
        whole = graph.sum(square, size) if square.size or size > 1 else square
        total = graph.op("add", total, whole)
    return total


def _moved(graph: Graph, call: Expr, tangents: Sequence[Expr | None], h: Expr) -> Expr:
    """Return the call with its arguments moved along their derivatives."""
    args = [
        arg if tangent is None else graph.op("add", arg, graph.op("mul", h, tangent))
        for arg, tangent in zip(call.args, tangents, strict=True)
    ]
    return graph.node("call", *args, data=call.data, size=call.size, varies=True)
