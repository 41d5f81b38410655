"""Whether a choice only bends what expressions are, or they jump where it switches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .evaluate import evaluate_expressions, value_of
from .graph import COMPARISONS, ORDERS, Expr, Graph, Untraceable, needed

_SIDES = {"sign": (1.0, -1.0), "heaviside": (1.0, 0.0)}  # values above 0 and below
_POINTS = 256
_NEAR = 0.1  # of a parameter
_SAME = 1e-12


def only_bends(graph: Graph, roots: Sequence[Expr], condition: Expr, p: np.ndarray) -> bool:
    """Return whether nothing that expressions are made of jumps at a condition, with such p."""
    if condition.op not in (*ORDERS, *_SIDES, "copysign") or condition.size is not None:
        return False
    one, other = _compared(graph, condition)
    moved, place = (one, other) if one.varies else (other, one)
    nodes = needed(roots)
    tied = [n for n in nodes if _is_tied(graph, n, (one, other))]
    asking = _made_of(nodes, set(tied))
    try:
        arrays = _at_random((*nodes, *needed([place])), p)
        there = {moved: evaluate_expressions([place], arrays)[0]}
        there |= _free(nodes, tied, there, (moved, place), arrays)
        jumping = [root for root in dict.fromkeys(roots) if root in asking]
        sides = [
            _values(jumping, arrays, there, _on_side(graph, tied, one, above))
            for above in (True, False)
        ]
    except Untraceable:
        return False
    with np.errstate(invalid="ignore"):  # what is infinite on both sides is not known to agree
        return all(
            np.all(abs(np.subtract(a, b, dtype=float)) <= _SAME * (1 + abs(a) + abs(b)))
            for a, b in zip(*sides, strict=True)  # truth values as well, of guards
        )


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
    graph: Graph, tied: Sequence[Expr], one: Expr, above: bool
) -> dict[Expr, bool | float]:
    """Return what conditions on the same two numbers are where `one` is above the other."""
    values: dict[Expr, bool | float] = {}
    for node in tied:
        larger = above == (_compared(graph, node)[0] is one)
        if node.op in ORDERS:
            values[node] = larger == (node.op in ("gt", "ge"))
        else:  # of copysign it is the sign
            values[node] = _SIDES.get(node.op, _SIDES["sign"])[0 if larger else 1]
    return values


_Arrays = Mapping[str, np.ndarray]


def _values(
    exprs: Sequence[Expr],
    arrays: _Arrays,
    instead: Mapping[Expr, np.ndarray],
    sides: Mapping[Expr, bool | float],
) -> list[np.ndarray]:
    """Return the values of expressions, with other values or signs for some of their parts."""
    values = dict(instead)
    with np.errstate(all="ignore"):
        for node in needed(exprs, instead.keys() | {n for n in sides if n.op != "copysign"}):
            if node in sides:
                side = np.asarray(sides[node])
                values[node] = abs(values[node.args[0]]) * side if node.op == "copysign" else side
            elif node not in values:
                values[node] = value_of(node, [values[arg] for arg in node.args], arrays)
    return [values[expr] for expr in exprs]


def _free(
    nodes: Sequence[Expr],
    tied: Sequence[Expr],
    there: Mapping[Expr, np.ndarray],
    pair: tuple[Expr, Expr],
    arrays: dict[str, np.ndarray],
) -> dict[Expr, np.ndarray]:
    """Return what stands for the other conditions: true or false, whatever they ask for."""
    # What is met only rarely would not be met by values at random. Only those that parameters alone
    # decide, where this condition switches, are what they are; unless they switch there, too.
    moved, place = pair
    moving = _moving(nodes, moved, _moving(needed([place]))[place])
    others = [n for n in nodes if n.op in COMPARISONS and n not in tied]
    ordered = [n for n in others if not moving[n] and n.op in ORDERS]
    numbers = [arg for comparison in ordered for arg in comparison.args]
    values = _values(numbers, arrays, there, {})
    with np.errstate(invalid="ignore"):
        met = {
            n for n, a, b in zip(ordered, values[::2], values[1::2], strict=True)
            if np.all(abs(a - b) <= _SAME * (abs(a) + abs(b)))
        }  # fmt: skip
    rng = np.random.default_rng(2)
    free = [n for n in others if moving[n] or n in met]
    return {n: rng.random((n.size, _POINTS) if n.size else _POINTS) < 0.5 for n in free}


def _made_of(nodes: Sequence[Expr], parts: set[Expr]) -> set[Expr]:
    """Return which expressions, parts first, are among some or made of these."""
    for node in nodes:
        if not parts.isdisjoint(node.args):
            parts.add(node)
    return parts


def _moving(
    nodes: Sequence[Expr], moved: Expr | None = None, moves: bool = False
) -> dict[Expr, bool]:
    """Return which expressions depend on more than parameters; of one it is known."""
    moving: dict[Expr, bool] = {}
    for node in nodes:
        is_read = node.op == "leaf" and node.data[0] != "p"
        is_moving = is_read or node.op in ("call", "solve") or any(moving[a] for a in node.args)
        moving[node] = moves if node is moved else is_moving
    return moving


def _at_random(exprs: Sequence[Expr], p: np.ndarray) -> dict[str, np.ndarray]:
    """Return values for all that expressions read."""
    rng, rows = np.random.default_rng(1), dict.fromkeys(("t", "x", "u"), 1)
    for node in needed(exprs):
        if node.op == "leaf" and node.data[0] in rows:
            array, start, step = node.data
            rows[array] = max(rows[array], start + step * ((node.size or 1) - 1) + 1)
    arrays = {name: rng.normal(size=(n, _POINTS)) for name, n in rows.items()}
    size = np.where((p == 0.0) | ~np.isfinite(p), 1.0, np.abs(p))[:, None]
    arrays["p"] = p[:, None] + _NEAR * size * rng.normal(size=(p.size, _POINTS))
    arrays["p"][:, ::2] = p[:, None]  # what asks whether one is 0 has another answer next to it
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
