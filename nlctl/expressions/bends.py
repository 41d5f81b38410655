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
    one, other = _compared(graph, condition)
    on_it = {one: other} if one.varies else {other: one}
    tied = [n for n in needed(roots) if _is_tied(graph, n, (one, other))]
    there = {**on_it, **_free(graph, roots, tied, on_it, p)}
    sides = [
        replaced_parts(graph, roots, {**there, **_on_side(graph, tied, there, one, above)})
        for above in (True, False)
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
    graph: Graph, tied: Sequence[Expr], there: Mapping[Expr, Expr], one: Expr, above: bool
) -> dict[Expr, Expr]:
    """Return what conditions on the same two numbers are where `one` is above the other."""
    values = {}
    for node in tied:
        larger = above == (_compared(graph, node)[0] is one)
        if node.op == "copysign":
            (given,) = replaced_parts(graph, node.args[:1], there)
            size = graph.op("absolute", graph.number(given))
            values[node] = size if larger else graph.op("neg", size)
        elif node.op in _SIDES:
            values[node] = graph.const(_SIDES[node.op][0 if larger else 1])
        else:
            values[node] = graph.const(larger == (node.op in ("gt", "ge")))
    return values


def _free(
    graph: Graph,
    roots: Sequence[Expr],
    tied: Sequence[Expr],
    on_it: Mapping[Expr, Expr],
    p: np.ndarray,
) -> dict[Expr, Expr]:
    """Return what stands for the other conditions: true or false, whatever they ask for."""
    # What is met only rarely would not be met by values at random. Only those that parameters alone
    # decide, where this condition switches, are what they are; unless they switch there, too.
    others = [n for n in needed(roots) if n.op in COMPARISONS and n not in tied]
    truths: dict[Expr, Expr] = {}
    row = 0
    placed = replaced_parts(graph, others, on_it)
    moving = _moving(placed)
    for node, there in zip(others, placed, strict=True):
        if there in moving or _is_met(there, p):
            where = (_TRUTHS, row, 1 if node.size else 0)
            truth = graph.node("leaf", data=where, size=node.size, varies=True)
            truths[node], row = graph.op("gt", truth, graph.const(0.0)), row + (node.size or 1)
    return truths


def _is_met(comparison: Expr, p: np.ndarray) -> bool:
    """Return whether a comparison of parameters is of equal ones, whatever they are."""
    if comparison.op not in ORDERS:
        return False
    a, b = evaluate_expressions(list(comparison.args), _at_random([comparison], p))
    with np.errstate(invalid="ignore"):
        return bool(np.all(abs(a - b) <= _SAME * (abs(a) + abs(b))))


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
