"""Choices that do not jump: both ways have the same value where the condition switches.

A dead zone that is written with `np.where` has kinks and no jumps.  What both ways are on the
condition is seen from values at random, with parameters near those of the run: what is the same
for all of these is the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..expressions.evaluate import evaluate_expressions
from ..expressions.graph import Expr, Graph, Untraceable, needed
from ..native.sliding.pieces import replaced_parts

__all__ = ["only_bends"]

_ORDERS = ("lt", "le", "gt", "ge")
_POINTS = 32
_NEAR = 0.1  # of a parameter
_SAME = 1e-12


def only_bends(graph: Graph, roots: Sequence[Expr], condition: Expr, p: np.ndarray) -> bool:
    """Return whether nothing that expressions are made of jumps at a condition.

    Parameters
    ----------
    graph : Graph
    roots : sequence of Expr
        The expressions.
    condition : Expr
        A comparison.
    p : ndarray
        Parameters.
    """
    if condition.op not in _ORDERS or condition.size is not None:
        return False
    users = [node for node in needed(roots) if condition in node.args]
    choices = [node for node in users if node.op == "select" and node.args[0] is condition]
    plain = all(condition not in node.args[1:] for node in choices)
    if not users or len(choices) < len(users) or not plain:
        return False
    one, other = map(graph.number, condition.args)
    instead = {one: other} if one.varies else {other: one}
    ways = [e for node in choices for e in replaced_parts(graph, node.args[1:], instead)]
    try:
        values = evaluate_expressions(ways, _at_random(ways, p))
    except Untraceable:
        return False
    pairs = zip(values[::2], values[1::2], strict=True)
    return all(np.all(abs(a - b) <= _SAME * (1 + abs(a) + abs(b))) for a, b in pairs)


def _at_random(exprs: Sequence[Expr], p: np.ndarray) -> dict[str, np.ndarray]:
    """Return values for all that expressions read."""
    rng, rows = np.random.default_rng(1), dict.fromkeys("txu", 1)
    for node in needed(exprs):
        if node.op == "leaf" and node.data[0] in rows:
            array, start, step = node.data
            rows[array] = max(rows[array], start + step * ((node.size or 1) - 1) + 1)
    found = {name: rng.normal(size=(n, _POINTS)) for name, n in rows.items()}
    size = np.where(p == 0.0, 1.0, np.abs(p))[:, None]
    found["p"] = p[:, None] + _NEAR * size * rng.normal(size=(p.size, _POINTS))
    return found
