"""Algebraic loops: Newton's method with the exact Jacobian matrix of the loop's own expressions.

A loop is solved for its guessed ("torn") signals z: with what the blocks make of a guess, F(z), a
solution has F(z) = z.  One step of the search is written here once, as functions of numbers
without a branch; it is traced like a block's equation and becomes part of the program.

A step that does not bring F(z) and z closer together is halved.  The search begins at 0, then at
1 and -1; of several solutions the one is found that it reaches first.  Where it ends without a
solution the result is NaN.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...expressions.arrays import Tracer, scalar
from ...expressions.derivatives import tangents
from ...expressions.elimination import largest_magnitude, linear_solution
from ...expressions.graph import Expr, Graph, Untraceable, needed
from ...expressions.stage import Stage
from .plan import Function, Store, plan_function
from .rewrite import rewritten
from .solver import DONE, GUESS, PASS, Solver

BASE, _TRIAL = 0.0, 1.0  # phases of a search besides DONE
STARTS = (0.0, 1.0, -1.0)
_MOST = 16  # signals of one loop; elimination is written out, and grows with their third power
_STEPS = 60.0  # trials from one start, halvings included
SMALL_STEP = 1e-9  # relative; the next one, of about its square, would not be seen
_ROUNDING = 4 * 2.0**-52


def solver(
    name: str, guesses: Sequence[Expr], outputs: Sequence[Expr]
) -> tuple[Solver, list[Expr]]:
    """Return what solves for guesses, and the expressions from outside that it is given."""
    if len(guesses) > _MOST:
        raise Untraceable(f"{len(guesses)} signals have to be found together, {_MOST} can be")
    nodes = needed(outputs)
    within = inside(nodes, guesses)
    outside = dict.fromkeys(
        arg
        for node in nodes  # in an order that is the same in every process
        if node in within
        for arg in node.args
        if arg not in within and _is_given(arg)
    )
    outside |= dict.fromkeys(e for e in outputs if e not in within and _is_given(e))
    places: dict[Expr, int] = {}
    for expr in outside:
        places[expr] = sum(e.size or 1 for e in places)
    graph, new = _within(nodes, guesses, places)
    function, exact = _pass(graph, [new[e] for e in outputs], [new[g] for g in guesses])
    search = Solver(
        name=name, given=sum(e.size or 1 for e in places), count=len(guesses), function=function,
        exact=exact, initial=(BASE, 0.0, 0.0, np.inf, *[STARTS[0]] * len(guesses),
                              *[0.0] * len(guesses)),
    )  # fmt: skip
    return search, list(places)


def inside(nodes: Sequence[Expr], guesses: Sequence[Expr]) -> set[Expr]:
    """Return what depends on a guess, and the truth values next to it: no array holds these."""
    within = set(guesses)
    for node in nodes:
        if any(arg in within for arg in node.args):
            within.add(node)
    for node in reversed(nodes):
        if node in within:
            within.update(arg for arg in node.args if arg.kind == "b")
    return within


def _within(
    nodes: Sequence[Expr], guesses: Sequence[Expr], places: Mapping[Expr, int]
) -> tuple[Graph, dict[Expr, Expr]]:
    """Return a graph of what is inside a loop, and each expression's place in it."""
    graph, new = Graph(), {}
    for node in nodes:
        if node in guesses:
            new[node] = graph.leaf("s", GUESS + guesses.index(node), None)
        elif node in places:
            where = ("w", places[node], 1 if node.size else 0)
            new[node] = graph.node("leaf", data=where, size=node.size, varies=True)
        elif all(arg in new for arg in node.args):
            new[node] = graph.like(node, *(new[a] for a in node.args))
    return graph, new


def _is_given(expr: Expr) -> bool:
    return expr.op not in ("const", "table")


def _pass(
    graph: Graph, results: Sequence[Expr], guesses: Sequence[Expr]
) -> tuple[Function, frozenset[Expr]]:
    """Return the plan of one step of the search."""
    n = len(guesses)
    columns = [
        tangents(graph, results, lambda leaf, g=g: graph.const(1.0) if leaf is g else None)
        for g in guesses
    ]
    zero = graph.const(0.0)
    jacobian = [[scalar(graph, columns[j][i] or zero) for j in range(n)] for i in range(n)]
    state = [scalar(graph, graph.leaf("s", i, None)) for i in range(GUESS + 2 * n)]
    values = [scalar(graph, graph.number(e)) for e in results]
    following = Stage(graph).copied(improved)(n, state, values, jacobian)
    exprs = [e.only if isinstance(e, Tracer) else graph.const(float(e)) for e in following]
    stores = [Store(array="n", row=i, expr=e, size=1) for i, e in enumerate(exprs)]
    written, exact, _ = rewritten(graph, {"n": stores})
    return Function(arguments=PASS, plan=plan_function(written["n"], {}, 0)), exact


def improved(
    n: int, state: Sequence[Any], results: Sequence[Any], jacobian: Sequence[Sequence[Any]]
) -> list[Any]:
    """Return the next state of a search."""
    phase, count, start, best = state[:4]
    guess, base = state[4 : 4 + n], state[4 + n : 4 + 2 * n]
    apart = largest_magnitude([results[i] - guess[i] for i in range(n)])
    count = count + 1.0
    solved = np.logical_and(phase == _TRIAL, apart <= _ROUNDING * largest_magnitude(results))
    better = apart < best  # NaN is not; the first one is infinite
    step, is_regular = linear_solution(
        [[jacobian[i][j] - (1.0 if i == j else 0.0) for j in range(n)] for i in range(n)],
        [guess[i] - results[i] for i in range(n)],
    )
    moved = [guess[i] + step[i] for i in range(n)]
    is_short = largest_magnitude(step) <= SMALL_STEP * largest_magnitude(moved)
    again = np.where(
        better, np.logical_not(is_regular), np.logical_or(phase == BASE, count > _STEPS)
    )
    again = np.logical_and(np.logical_not(solved), again)
    is_last = start >= len(STARTS) - 1.0
    fresh = np.where(is_last, np.nan, np.where(start < 1.0, STARTS[1], STARTS[2]))
    further = np.where(np.logical_and(better, is_short), DONE, _TRIAL)
    phase = np.where(again, np.where(is_last, DONE, BASE), np.where(solved, DONE, further))
    new_guess, new_base = [], []
    for i in range(n):
        tried = np.where(better, moved[i], 0.5 * (guess[i] + base[i]))
        tried = np.where(again, fresh, tried)
        new_guess.append(np.where(solved, guess[i], tried))
        new_base.append(np.where(better, guess[i], base[i]))
    best = np.where(again, np.inf, np.where(better, apart, best))
    return [
        phase, np.where(again, 0.0, count), np.where(again, start + 1.0, start), best,
        *new_guess, *new_base,
    ]  # fmt: skip
