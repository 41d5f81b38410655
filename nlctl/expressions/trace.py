"""Tracing: what a plain Python function computes, as expressions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .arrays import Tracer, concatenated, scalar, traced
from .graph import BUDGET, UNLIMITED, Ambiguous, Expr, Graph, OpenCondition, Untraceable
from .operators import elementwise
from .stage import Stage

PATHS = 32  # ways through one function that are followed


def trace(graph: Graph, function: Any, arguments: Callable[[], tuple[Any, ...]]) -> Tracer:
    """Run a function on tracers and return its result in one dimension.

    A condition that depends on tracers is followed both ways: the function runs again for every
    way through it, and the results are combined by ``select``, which takes the branch that Python
    takes, also for NaN.

    Parameters
    ----------
    graph : Graph
        Where the expressions are kept.
    function : callable
        A block's function of plain Python; its code runs as it stands.
    arguments : callable
        Makes the arguments, anew for every run, since a function may change them.

    Raises
    ------
    Untraceable
        If the function does what expressions cannot say, fails, or has too many ways through it.
    Ambiguous
        If it does what machine code would understand in another way than Python.
    """
    graph.limit = len(graph.nodes) + BUDGET
    assumptions = dict(graph.assumptions)
    try:
        stage = Stage(graph)
        copy = stage.copied(function)
        run = lambda: copy(*map(stage.instead, arguments()))  # noqa: E731
        return _followed(graph, lambda: _flat(graph, run()), {}, [PATHS])
    except Ambiguous:
        raise
    except Exception as error:  # a traced function may raise whatever it likes
        graph.assumptions = assumptions
        raise Untraceable(str(error)) from error
    finally:
        graph.decisions, graph.guards = {}, []
        graph.limit = UNLIMITED


def _followed(
    graph: Graph, run: Callable[[], Tracer], decisions: dict[Expr, bool], left: list[int]
) -> Tracer:
    """Follow a function from where the decisions have led."""
    graph.decisions, graph.guards = decisions, []
    try:
        result = _guarded(graph, run())
    except OpenCondition as question:
        condition = question.condition
    else:
        left[0] -= 1
        if left[0] < 0:
            raise Untraceable(f"more than {PATHS} ways through it")
        return result
    if len(decisions) >= PATHS:
        raise Untraceable("a loop whose end depends on what is computed")
    yes = _followed(graph, run, {**decisions, condition: True}, left)
    no = _followed(graph, run, {**decisions, condition: False}, left)
    if yes.shape != no.shape:
        raise Untraceable("results of different sizes")
    return elementwise(graph, "select", scalar(graph, condition), yes, no)


def _guarded(graph: Graph, result: Tracer) -> Tracer:
    """Return a result, NaN where Python would have raised an error on the way."""
    for condition in graph.guards:
        result = elementwise(graph, "select", scalar(graph, condition), result, np.nan)
    return result


def _flat(graph: Graph, value: Any) -> Tracer:
    """Return a function's result, an array, tuple, list or number, in one dimension."""
    if isinstance(value, tuple | list):
        return concatenated(graph, [traced(graph, v).reshape(-1) for v in value])
    return traced(graph, value).reshape(-1)
