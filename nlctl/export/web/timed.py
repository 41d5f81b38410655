"""What a run must know of functions of time alone, as a program: it changes with parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...expressions.graph import Expr, Graph
from ...native.codegen.ir.program import program_text
from ...native.codegen.plan import Store, split
from ...native.codegen.rewrite import rewritten
from ...native.diagram.parameters import length
from ...native.equations.blocks import Equations
from ...native.lower import SAMPLE, planned

_STEADY = ("floor", "ceil", "trunc", "rint", "sign", "heaviside")  # they are their own levels


@dataclass(frozen=True, kw_only=True)
class TimedProgram:
    """Functions of time alone as ``timed(t, x, u, c, s)`` and ``timed.prepare(p, c)``."""

    text: str  # LLVM's IR
    rows: int  # of `c`
    # so many first entries of `s` are constant between the times at which conditions switch
    levels: int
    # of products of sines where the angular frequencies of the factors are, begin and end
    waves: tuple[tuple[tuple[int, int], ...], ...]
    # where functions are that drive the equations, begin and end
    pulses: tuple[tuple[int, int], ...]
    size: int  # of `s`


def timed_program(equations: Equations, layout: Any) -> TimedProgram:
    """Return what a diagram has of functions of time alone."""
    conditions, graph = equations.conditions, equations.graph
    stores: list[Store] = []

    def stored(expr: Expr) -> tuple[int, int]:
        begin = sum(store.size for store in stores)
        size = expr.size or 1
        stores.extend(split(Store(array="s", row=begin, expr=graph.number(expr), size=size)))
        return begin, begin + size

    levels = [_level(graph, condition) for condition in conditions.of_time]
    zero = graph.const(0.0)
    for line in conditions.declared_of_time.values():  # at 0 a block may be on either side
        levels += [graph.op(order, line, zero) for order in ("lt", "le")]
    ends = [stored(level)[1] for level in levels]
    waves = tuple(tuple(stored(slope) for slope in wave) for wave in conditions.waves)
    pulses = tuple(stored(term) for term in conditions.pulses)
    values, exact, _ = rewritten(graph, {"timed": stores})
    functions, rows = planned(values, {"timed": SAMPLE}, length(layout))
    named = {"timed.prepare": functions["prepare"], "timed": functions["timed"]}
    return TimedProgram(
        text=program_text(named, 1, exact), rows=max(rows, 1), levels=max(ends, default=0),
        waves=waves, pulses=pulses, size=max(sum(store.size for store in stores), 1),
    )  # fmt: skip


def _level(graph: Graph, condition: Expr) -> Expr:
    """Return a number that is constant between the switches of a condition."""
    op, args = condition.op, condition.args
    if condition.kind == "b" or op in _STEADY:
        return condition
    if op in ("remainder", "fmod"):
        half = graph.op("mul", graph.const(0.5), graph.op("absolute", args[1]))
        return graph.op("gt", graph.op("absolute", condition), half)
    if op in ("minimum", "maximum"):
        return graph.op("lt", *args)
    return graph.op("lt", args[1] if op == "copysign" else args[0], graph.const(0.0))
