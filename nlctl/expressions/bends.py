"""Whether a choice only bends what expressions are, or they jump where it switches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .evaluate import evaluate_expressions
from .graph import COMPARISONS, ORDERS, Expr, Graph, Untraceable, needed

_SIDES = {"sign": (1.0, -1.0), "heaviside": (1.0, 0.0)}  # values above 0 and below
_POINTS = 256
_TRUTHS = "truths"  # the array of values that say whether other conditions hold
_NEAR = 0.1  # of a parameter
_SAME = 1e-12


def only_bends(graph: Graph, roots: Sequence[Expr], condition: Expr, p: np.ndarray) -> bool:
    """Return whether nothing that expressions are made of jumps at a condition, with such p."""
    if condition.op not in (*ORDERS, *_SIDES, "copysign") or condition.size is not None:
        return False
    numbers = [graph.number(arg) for arg in condition.args]
    one = numbers[1 if condition.op == "copysign" else 0]
    other = numbers[1] if condition.op in ORDERS else graph.const(0.0)
    on_it = {one: other} if one.varies else {other: one}
    there = {**on_it, **_free(graph, roots, condition, on_it)}
    sides = [
        replaced_parts(graph, roots, {**there, condition: value})
        for value in _values(graph, condition, there)
    ]
    pairs = [pair for pair in zip(*sides, strict=True) if pair[0] is not pair[1]]
    exprs = [expr for pair in pairs for expr in pair]
    try:
        values = evaluate_expressions(exprs, _at_random(exprs, p))
    except Untraceable:
        return False
    apart = zip(values[::2], values[1::2], strict=True)
    with np.errstate(invalid="ignore"):  # what is infinite on both sides is not known to agree
        return all(np.all(abs(a - b) <= _SAME * (1 + abs(a) + abs(b))) for a, b in apart)


def _values(graph: Graph, condition: Expr, there: Mapping[Expr, Expr]) -> list[Expr]:
    """Return what a condition is on either side of where it switches."""
    if condition.op == "copysign":
        (given,) = replaced_parts(graph, condition.args[:1], there)
        size = graph.op("absolute", graph.number(given))
        return [size, graph.op("neg", size)]
    return [graph.const(side) for side in _SIDES.get(condition.op, (True, False))]


def _free(
    graph: Graph, roots: Sequence[Expr], condition: Expr, on_it: Mapping[Expr, Expr]
) -> dict[Expr, Expr]:
    """Return what stands for the other conditions: true or false, whatever they ask for."""
    # What is met only rarely would not be met by values at random. Only those that parameters alone
    # decide, where this condition switches, are what they are.
    others = [n for n in needed(roots) if n.op in COMPARISONS and n is not condition]
    truths: dict[Expr, Expr] = {}
    row = 0
    placed = replaced_parts(graph, others, on_it)
    moving = _moving(placed)
    for node, there in zip(others, placed, strict=True):
        if there in moving:
            where = (_TRUTHS, row, 1 if node.size else 0)
            truth = graph.node("leaf", data=where, size=node.size, varies=True)
            truths[node], row = graph.op("gt", truth, graph.const(0.0)), row + (node.size or 1)
    return truths


def _moving(exprs: Sequence[Expr]) -> set[Expr]:
    """Return what depends on more than parameters."""
    moving: set[Expr] = set()
    for node in needed(exprs):
        is_read = node.op == "leaf" and node.data[0] != "p"
        if is_read or node.op in ("call", "solve") or any(a in moving for a in node.args):
            moving.add(node)
    return moving


def _at_random(exprs: Sequence[Expr], p: np.ndarray) -> dict[str, np.ndarray]:
    """Return values for all that expressions read."""
    rng, rows = np.random.default_rng(1), dict.fromkeys(("t", "x", "u", _TRUTHS), 1)
    for node in needed(exprs):
        if node.op == "leaf" and node.data[0] in rows:
            array, start, step = node.data
            rows[array] = max(rows[array], start + step * ((node.size or 1) - 1) + 1)
    arrays = {name: rng.normal(size=(n, _POINTS)) for name, n in rows.items()}
    size = np.where((p == 0.0) | ~np.isfinite(p), 1.0, np.abs(p))[:, None]
    arrays["p"] = p[:, None] + _NEAR * size * rng.normal(size=(p.size, _POINTS))
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
