"""Claims about functions on boxes, decided by their machine code where they have any.

A function that can be traced is enclosed by floats that are rounded outwards, see
`nlctl.native.enclosures`.  Balls stay the reference: before the code is used it is compared with
them at points of the box, and where a claim is refuted they have the last word.
"""

import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from flint import arb

from nlctl.errors import CompileError
from nlctl.expressions.arrays import Tracer
from nlctl.expressions.continuity import is_an_extreme
from nlctl.expressions.graph import Expr, Graph, Untraceable
from nlctl.native.enclosures.boxes import BoxCode, enclosed, numbers_at, side_leaves
from nlctl.native.enclosures.divide import BoxVerdict, decide_claim
from nlctl.native.enclosures.scalars import UnroundedGraph
from nlctl.upstream.numba_internals import is_jit_disabled
from nlctl.wording import counted

from .arithmetic import Ball, as_ball
from .box import Box
from .paths import Undecided, meanwhile

TOO_FEW = 16  # boxes, for which code does not pay
_POINTS = 8  # at which code is compared with balls
_GOLDEN = 0.6180339887498949
_LARGE = 5.0  # scale of points along sides without an end
_ROUNDING = 1e-9  # relative


_ONLY_BALLS: ContextVar[bool] = ContextVar("only_balls", default=False)


def only_balls() -> AbstractContextManager[Any]:
    """Prove by balls alone what is proved meanwhile, whatever machine code there is."""
    return meanwhile(_ONLY_BALLS, True)


@dataclass(frozen=True, kw_only=True)
class Readable:
    """A function of balls that is known as an expression, too."""

    of_balls: Callable[..., Any]  # of a tuple of balls
    # ``expressions(graph, sides)``: the same of symbols, as expressions of the graph.
    # Several are conditions, and the function their least.
    expressions: Callable[[Graph, tuple[Tracer, ...]], Sequence[Expr]]
    # machine code that has been made of it, by sides and sign; None where there is none
    codes: dict[tuple[int, int], BoxCode | None] = field(default_factory=dict, compare=False)
    # the expressions, by sides
    read: dict[int, tuple[Graph, Sequence[Expr]]] = field(default_factory=dict, compare=False)

    def __call__(self, *given: object) -> Any:
        return self.of_balls(*given)


def readable(of_balls: Callable[..., Any], function: Callable[..., Any]) -> Readable:
    """Return a function of a tuple of numbers, with what it does to balls and as an expression."""

    def number(graph: Graph, sides: tuple[Tracer, ...]) -> list[Expr]:
        numbers = numbers_at(graph, function, sides)
        if len(numbers) != 1:
            raise Untraceable(f"it gives {counted(len(numbers), 'number')}, where one is needed")
        return numbers

    return Readable(of_balls=of_balls, expressions=number)


def code_for(function: Readable, box: Box, sign: int) -> BoxCode | None:
    """Return code for the claim sign f <= 0; None where there is none, or on no such machine."""
    if is_jit_disabled() or not box.names or _ONLY_BALLS.get():
        return None
    key = (len(box.names), sign)
    if key not in function.codes:
        code = _generated(function, *key)
        function.codes[key] = code if code and _agrees(code, function, box, sign) else None
    return function.codes[key]


def _generated(function: Readable, sides: int, sign: int) -> BoxCode | None:
    """Return the code of sign f, None if it has none."""
    try:
        if sides not in function.read:
            graph = UnroundedGraph({"x": sides})
            expressions = function.expressions(graph, side_leaves(graph, sides))
            function.read[sides] = graph, expressions
        graph, results = function.read[sides]
        if len(results) > 1:
            return enclosed(results, sides)
        return enclosed(_apart(graph, graph.number(results[0]), sign), sides, all_exist=True)
    except (Untraceable, CompileError):  # the latter where the C library lacks a function
        return None


def _apart(graph: Graph, expr: Expr, sign: int) -> list[Expr]:
    """Return numbers the least of which is sign times an expression."""
    if expr.op == ("minimum" if sign > 0 else "maximum"):
        return [e for arg in expr.args for e in _apart(graph, arg, sign)]
    if expr.op == "select" and is_an_extreme(expr):
        question, first = expr.args[0], expr.args[1]
        is_least = (question.args[0] is first) == (question.op in ("lt", "le"))
        if is_least == (sign > 0):
            return [e for arg in expr.args[1:] for e in _apart(graph, arg, sign)]
    return [expr if sign > 0 else graph.op("neg", expr)]


def _agrees(code: BoxCode, function: Readable, box: Box, sign: int) -> bool:
    """Whether code and balls meet at points of the box."""
    points = np.array([_point(box, k) for k in range(_POINTS)])
    low, high = (v.min(axis=1) for v in code.values(points, points))
    for point, a, b in zip(points, low, high, strict=True):
        try:
            value = sign * as_ball(function(tuple(Ball(arb(float(v))) for v in point))).value
        except Undecided:
            continue
        if value.is_finite() and np.isfinite(b - a):
            room = _ROUNDING * (1 + abs(a) + abs(b))
            if not (float(value.lower()) <= b + room and float(value.upper()) >= a - room):
                return False
    return True


def _point(box: Box, k: int) -> list[float]:
    """Return one of a sequence of points in a box."""
    point = []
    for i, (a, b) in enumerate(box.cell):
        share = (0.5 + (k + 1) * _GOLDEN ** (i + 1)) % 1.0
        low = a if np.isfinite(a) else min(b, 0.0) - _LARGE if np.isfinite(b) else -_LARGE
        high = b if np.isfinite(b) else max(low, 0.0) + _LARGE
        point.append(float(min(max(low + share * (high - low), a), b)))
    return point


def decided_by_code(code: BoxCode, box: Box, bound: float, max_boxes: int) -> BoxVerdict:
    """Return the verdict on a claim; the same whatever the number of processors."""
    threads = os.cpu_count() or 1
    return decide_claim(code, box.low, box.high, bound, max_boxes=max_boxes, threads=threads)
