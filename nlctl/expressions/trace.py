"""Tracing: what a plain Python function computes, as expressions.

What is known of a comparison with a number from comparisons of the same thing before.

``if t < 3`` and then ``if t < 7``: where the first holds the second does, and a function with many
thresholds in a row has few paths through it.  NaN is on no side of any number, so that what did not
hold before says nothing of where a thing is that may be NaN.
"""

from __future__ import annotations

import functools
import math
import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import Special, Tracer, concatenated, scalar, traced
from .graph import (
    BUDGET,
    UNLIMITED,
    Ambiguous,
    Expr,
    Graph,
    MessageWritten,
    Namespace,
    Untraceable,
    catchable,
)
from .operators import elementwise
from .registers import Kept, Register
from .rewritten import Unfollowed, is_raised
from .stage import Stage
from .staged import LIBRARIES
from .staircases import Staircase, check_slopes

PATHS = 128  # paths through one function that are followed
_STRAIGHT = 10_000  # expressions of a function with few ways through it: equations of robots
_UNLIKELY = 1e-3  # probability below which something is taken not to be so
_FEW, _DEEP = 6, 8  # paths, and decisions on one, up to which no branch becomes a choice


def trace(
    graph: Graph, function: object, arguments: Callable[[], tuple[Any, ...]],
    registers: Sequence[Register] = (),
) -> Tracer:  # fmt: skip
    """Run a function on tracers and return its result in one dimension."""
    try:
        return _in_few_ways(graph, function, arguments, registers)
    except Untraceable as error:
        if not isinstance(error.__cause__, MessageWritten):
            raise
    graph.settles = True  # ``if params["verbose"]``: traced again where that is another value
    try:
        return _in_few_ways(graph, function, arguments, registers)
    finally:
        graph.settles = False


def _in_few_ways(
    graph: Graph, function: object, arguments: Callable[[], tuple[Any, ...]],
    registers: Sequence[Register],
) -> Tracer:  # fmt: skip
    """Follow every way, or choices of numbers where there are too many."""
    # A condition that depends on tracers is followed both ways: the function runs again for every
    # way through it, and the results are combined by ``select``, which takes the branch that Python
    # takes, also for NaN.
    left = [_FEW, _DEEP]
    try:
        return _traced(graph, function, arguments, registers, left)
    except Untraceable:
        if left[0] >= 0:
            raise
    try:
        return _traced(graph, function, arguments, registers, [PATHS, PATHS], merging=True)
    except Untraceable as error:
        if isinstance(error.__cause__, Staircase):
            raise
    return _traced(graph, function, arguments, registers, [PATHS, PATHS])


def _traced(
    graph: Graph, function: object, arguments: Callable[[], tuple[Any, ...]],
    registers: Sequence[Register], left: list[int], *, merging: bool = False,
) -> Tracer:  # fmt: skip
    """Follow every way; with `merging`, branches that only compute numbers are one."""
    budget = _STRAIGHT if left[0] == _FEW else BUDGET * (1 + merging)  # passes of loops are alike
    graph.limit = len(graph.nodes) + budget
    assumptions, graph.merges = dict(graph.assumptions), merging
    try:
        kept, stages = Kept(graph, registers), list[Stage]()

        def run() -> Tracer:
            kept.begin()
            if registers or not stages:  # nothing of what another way has written is left
                stages[:] = [Stage(graph, kept, merging=merging)]
            stage = stages[0]
            return _flat(graph, stage.copied(function)(*map(stage.instead, arguments())))

        result = _followed(graph, run, {}, left)
        if result is None:
            raise Untraceable("it raises an error on every path")
        graph.limit = UNLIMITED
        kept.check(_numbers([result]))
        check_slopes(graph, _numbers([result]), _numbers(arguments()))
        return result
    except Ambiguous:
        raise
    except Exception as error:  # a traced function may raise whatever it likes
        graph.assumptions = assumptions
        text = str(error) or f"an error of type {type(error).__name__}"
        raise Untraceable(f"{text}{_place(error)}") from error
    finally:
        graph.decisions, graph.implied, graph.guards, graph.attempts = {}, {}, [], 0
        graph.branches = 0
        graph.limit, graph.merges, graph.answers = UNLIMITED, False, None


def _followed(
    graph: Graph, run: Callable[[], Tracer], known: dict[Expr, bool], left: list[int]
) -> Tracer | None:
    """Follow a function from where decisions have led; None where it raises an error."""
    asked: list[Expr] = []

    def yes(condition: Expr) -> bool:
        asked.append(condition)
        return True

    result = _counted(left, _one_way(graph, run, known, left, yes))
    way = list(graph.decisions.items())
    if not known and left[1] == PATHS and 2.0 ** len(asked) > PATHS:
        _check_few(graph, run)
    for condition in reversed(asked):  # and the other way, from each place where there is one
        while way[-1][0] is not condition:
            way.pop()
        way.pop()
        other = _followed(graph, run, {**dict(way), condition: False}, left)
        result = _either(graph, condition, result, other)
    return result


def _one_way(
    graph: Graph, run: Callable[[], Tracer], known: dict[Expr, bool], left: list[int],
    answer: Callable[[Expr], bool],
) -> Tracer | None:  # fmt: skip
    """Follow one way through a function, as decisions say and answers to what is asked beyond."""
    decisions = dict(known)

    def decided(condition: Expr) -> bool:
        implied = implied_by(condition, decisions)
        if implied is not None:
            return implied
        if len(decisions) >= left[1]:
            left[0] = -1
            raise Unfollowed from Untraceable("a loop whose end depends on what is computed")
        return answer(condition)

    graph.decisions, graph.implied, graph.guards, graph.passing = decisions, {}, [], []
    graph.attempts, graph.answers = 0, decided
    try:
        return _guarded(graph, run())
    except Unfollowed as end:
        raise end.__cause__ or end from end
    except Exception as error:
        if not decisions or not is_raised(error):
            raise
        return None


def _check_few(graph: Graph, run: Callable[[], Tracer]) -> None:
    """Stop early where ways at random have so many turns that there are too many ways."""
    chance, turns, likely = random.Random(0), [], 1.0

    def tossed(condition: Expr) -> bool:
        turns.append(condition)
        return chance.random() < 0.5

    while likely > _UNLIKELY:  # that there are so few ways, and those taken have so many turns
        turns.clear()
        _one_way(graph, run, {}, [PATHS, PATHS], tossed)
        if 2.0 ** len(turns) <= PATHS:
            return
        likely *= PATHS / 2.0 ** len(turns)
    raise Untraceable(f"more than {PATHS} paths through it")


def _either(graph: Graph, condition: Expr, yes: Tracer | None, no: Tracer | None) -> Tracer | None:
    """Return what comes out of two ways, NaN where one of them raises an error."""
    if yes is None or no is None:
        result = no if yes is None else yes
        if result is None:
            return None
        nan = elementwise(graph, "mul", np.nan, result)
        yes, no = (nan, result) if yes is None else (result, nan)
    if yes.shape != no.shape:
        raise Untraceable("results of different sizes")
    return elementwise(graph, "select", scalar(graph, condition), yes, no)


def _counted(left: list[int], result: Tracer | None) -> Tracer | None:
    """Return the result of a way; there are so many left."""
    left[0] -= 1
    if left[0] < 0:
        raise Untraceable(f"more than {PATHS} paths through it")
    return result


def _numbers(values: Iterable[object]) -> list[Expr]:
    """Return the expressions that arrays are made of."""
    return [e for array in values if isinstance(array, Tracer) for e, _ in array.pieces()]


def _place(error: BaseException) -> str:
    """Return at which line of somebody's function an error was raised, in brackets."""
    where, frame = "", error.__traceback__
    while frame is not None:
        code, names = frame.tb_frame.f_code, frame.tb_frame.f_globals
        module = str(names.get("__name__")).partition(".")[0]
        if isinstance(names.get("__builtins__"), Namespace) and module not in LIBRARIES:
            where = f" ({Path(code.co_filename).name}, line {frame.tb_lineno})"
        frame = frame.tb_next
    return where


def _guarded(graph: Graph, result: Tracer) -> Tracer:
    """Return a result, NaN where Python would have raised an error on the way."""
    guards = graph.guards
    if len(guards) > _FEW:  # all at once: ways that begin alike have the same beginning
        guards = [functools.reduce(functools.partial(graph.op, "and"), guards)]
    for condition in guards:
        result = elementwise(graph, "select", scalar(graph, condition), result, np.nan)
    return result


def _flat(graph: Graph, value: object) -> Tracer:
    """Return a function's result, an array, tuple, list or number, in one dimension."""
    # what no case is for: python-control raises an error
    if value is None and graph.decisions and graph.nothing_fails:
        raise catchable(TypeError)
    value = value.as_array() if isinstance(value, Special) else value
    if isinstance(value, tuple | list):
        return concatenated(graph, [traced(graph, v).there().reshape(-1) for v in value])
    return traced(graph, value).there().reshape(-1)


_TURNED = {"lt": "gt", "le": "ge", "gt": "lt", "ge": "le"}
_OPPOSITE = {"lt": "ge", "le": "gt", "gt": "le", "ge": "lt"}


def implied_by(condition: Expr, decisions: Mapping[Expr, bool]) -> bool | None:
    """Return whether a condition holds where others do or do not; None if that is not known."""
    comparison = _with_number(condition)
    if comparison is None:
        return None
    thing, order, number = comparison
    is_number = thing.op == "leaf" and thing.data[0] == "t"
    facts = []
    for other, holds in decisions.items():
        decided = _with_number(other)
        if decided is not None and decided[0] is thing:
            facts.append((decided[1] if holds else _OPPOSITE[decided[1]], decided[2]))
            is_number |= holds
    if any(_implies(fact, (_OPPOSITE[order], number)) for fact in facts):
        return False
    if is_number and any(_implies(fact, (order, number)) for fact in facts):
        return True
    return None


def _with_number(condition: Expr) -> tuple[Expr, str, float] | None:
    """Return what is compared with which number, and how; None of other conditions."""
    if condition.op not in _TURNED:
        return None
    left, right = condition.args
    if right.op == "const" and left.op != "const" and not left.size:
        return left, condition.op, float(right.data)
    if left.op == "const" and right.op != "const" and not right.size:
        return right, _TURNED[condition.op], float(left.data)
    return None


def _implies(fact: tuple[str, float], question: tuple[str, float]) -> bool:
    """Whether one comparison of a thing that is not NaN implies another."""
    (order, number), (relation, limit) = fact, question
    if order[0] != relation[0] or math.isnan(number) or math.isnan(limit):
        return False
    if number == limit:
        return order == relation or relation.endswith("e")
    return number < limit if order[0] == "l" else number > limit
