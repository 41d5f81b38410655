"""Expressions of every operation there is, drawn at random; and boxes for them."""

import numpy as np
from flint import arb

from nlctl.analysis.intervals.arithmetic import Ball, as_ball
from nlctl.analysis.intervals.paths import Undecided, every_way
from nlctl.expressions.functions import FUNCTIONS
from nlctl.expressions.graph import COMPARISONS, Graph, needed, numpy_function

ONE = [name for name, row in FUNCTIONS.items() if row.count == 1]
TWO = [name for name, row in FUNCTIONS.items() if row.count == 2]
CONSTANTS = (0.0, 1.0, -1.0, 2.0, 0.5, -0.3, 3.7, 10.0, 1e-3)
SHARES = {"leaf": 0.1, "arithmetic": 0.45, "one": 0.25, "two": 0.1, "choice": 0.1}


def random_expression(graph, rng, depth, sides):
    """An expression of the sides, as deep as that at the most."""
    kind = rng.choice([*SHARES], p=[*SHARES.values()]) if depth else "leaf"
    part = lambda: random_expression(graph, rng, depth - 1, sides)  # noqa: E731
    if kind == "leaf":
        if rng.random() < 0.75:
            return graph.leaf("x", int(rng.integers(sides)), None)
        return graph.const(float(rng.choice(CONSTANTS)))
    if kind == "arithmetic":
        name = str(rng.choice(["add", "sub", "mul", "div", "neg"]))
        return graph.op(name, *(part() for _ in range(1 if name == "neg" else 2)))
    if kind == "choice":
        condition = graph.op(str(rng.choice([*COMPARISONS])), part(), part())
        return graph.op("select", condition, part(), part())
    names = ONE if kind == "one" else TWO
    return graph.op(str(rng.choice(names)), *(part() for _ in range(1 if kind == "one" else 2)))


def random_graph(rng, count=4, depth=4):
    """Several expressions and the number of their sides."""
    graph, sides = Graph(), int(rng.integers(1, 4))
    with np.errstate(all="ignore"):
        found = [
            random_expression(graph, rng, int(rng.integers(1, depth + 1)), sides)
            for _ in range(count)
        ]
    return [graph.number(e) for e in found], sides


def random_boxes(rng, count, sides, unbounded=0.0):
    """Boxes of all sizes around all numbers, some of them points, some with ends at 0 or none."""
    shape = (count, sides)
    low = rng.normal(size=shape) * rng.choice([0.1, 1, 10, 1e3], size=(count, 1))
    low[rng.random(shape) < 0.2] = 0.0
    low = np.where(rng.random(shape) < 0.2, np.round(low), low)
    high = low + rng.exponential(size=shape) * rng.choice([0, 1e-9, 1e-2, 1, 10], size=shape)
    turned = rng.random(shape) < 0.5
    low, high = np.where(turned, -high, low), np.where(turned, -low, high)
    open_ = rng.random(shape) < unbounded
    return np.where(open_ & (rng.random(shape) < 0.6), -np.inf, low), np.where(open_, np.inf, high)


def random_points(rng, low, high, count):
    """Points of boxes, many of them at ends; shape (count, boxes, sides)."""
    first = np.where(np.isinf(low), np.minimum(high, 0) - 30, low)
    first = np.where(np.isinf(first), -30.0, first)
    last = np.where(np.isinf(high), np.maximum(first, 0) + 30, high)
    share = rng.random((count, *low.shape))
    share = np.where(rng.random(share.shape) < 0.15, np.round(share), share)
    return np.clip(first + share * (last - first), low, high)


def ball_of(expr, box):
    """The value of an expression on balls: everything, where it may have none."""
    try:
        ways = list(every_way(lambda: _on_balls(expr, box)))
    except Undecided:
        return arb.nan()
    found = ways[0]
    for way in ways[1:]:
        found = found.union(way)
    return found


def _on_balls(expr, box):
    values = {}
    for node in needed([expr]):
        args = [values[arg] for arg in node.args]
        if node.op == "leaf":
            values[node] = box[node.data[1]]
        elif node.op == "const":
            values[node] = bool(node.data) if node.kind == "b" else Ball(arb(node.data))
        elif node.op == "select":
            values[node] = args[1] if args[0] else args[2]
        else:
            values[node] = numpy_function(node.op)(*args)
    return as_ball(values[expr]).value
