"""Conditions at which a run slides: between the equations of both sides, by Filippov.

Where the solutions on both sides of a condition lead back to it, one goes along it, with a convex
combination of what holds on both sides.  Of rates f- below it and f+ above it that is

    x' = (f+ + f-) / 2 + v (f+ - f-) / 2

with the v of [-1, 1] that keeps the condition's switching function s at 0.  What an ideal relay
does with its input s is just that: one without signals stands for the condition, and v is what it
outputs while it slides.  Everywhere else the equations are what they were.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import CompileError
from ...expressions.arrays import Tracer, as_array
from ...expressions.conditions import switching_functions
from ...expressions.graph import COMPARISONS, LOGIC, ORDERS, Expr, Graph, deduce, needed
from ..diagram.nodes import Node
from ..diagram.program import count_switching_functions, memory
from ..diagram.schedule import Schedule
from ..sliding.rates import OUTPUTS, Motion, SlidingInput, SlidingRate, sliding_rates
from .located import Conditions, sign_key
from .reader import Reader
from .relays import array_of, kept_of, limits_of, relay_places

_Results = dict[str, list[tuple[int, Tracer]]]
_EQUAL = {"eq": False, "ne": True}  # next to a place at which two numbers are equal
_JUMPING = (*ORDERS, *_EQUAL, "sign", "heaviside")
_BLENDED = ("dx", "g", "y")


def changing_at(graph: Graph, exprs: Iterable[Expr], functions: Iterable[Expr]) -> tuple[Expr, ...]:
    """Return the comparisons in expressions that change where switching functions are 0."""
    keys = {sign_key(function) for function in functions}
    return tuple(
        node
        for node in needed(exprs)
        if node.op in _JUMPING and node.size is None and node.varies
        and not keys.isdisjoint(map(sign_key, _functions(graph, node)))
    )  # fmt: skip


def _functions(graph: Graph, node: Expr) -> tuple[Expr, ...]:
    if node.op in _EQUAL:
        node = graph.op("lt", *node.args)
    return switching_functions(graph, node) if node.varies else ()


def of_both_sides(
    graph: Graph, exprs: Sequence[Expr], changing: Sequence[Expr], sides: Sequence[Sequence[float]],
    beyond: Expr | None = None,
) -> tuple[list[Expr], list[Expr]]:  # fmt: skip
    """Return expressions as they are below and above, next to where a switching function is 0."""
    # With the function (`beyond`) also farther away, and each continued on the other side.
    both = [
        _continued(graph, node, values, beyond)
        for node, values in zip(changing, sides, strict=True)
    ]
    below, above = (
        _folded(graph, exprs, {node: one[k] for node, one in zip(changing, both, strict=True)})
        for k in range(2)
    )
    return below, above


def _continued(
    graph: Graph, node: Expr, values: Sequence[float], beyond: Expr | None
) -> tuple[Expr, Expr]:
    """Return what a comparison is below and above."""
    if beyond is None or node.op in _EQUAL or len(_functions(graph, node)) == 1:
        low, high = (graph.const(bool(v) if node.kind == "b" else float(v)) for v in values)
        return low, high
    if values[0] == values[1]:
        return node, node
    # It switches elsewhere, too: on the other side it is the opposite of what it would be here.
    opposite = graph.op("not" if node.kind == "b" else "neg", node)
    ways = (graph.op(side, beyond, graph.const(0.0)) for side in ("gt", "lt"))
    low, high = (_either(graph, way, opposite, node) for way in ways)
    return low, high


def _either(graph: Graph, condition: Expr, one: Expr, other: Expr) -> Expr:
    if one.kind != "b":
        return graph.op("select", condition, one, other)
    return graph.op("xor", condition, other)


def _folded(graph: Graph, exprs: Sequence[Expr], values: Mapping[Expr, Expr]) -> list[Expr]:
    """Return expressions with values of some parts: choices that these make are gone."""
    new = dict(values)
    for node in needed(exprs, values):
        args = tuple(new.get(a, a) for a in node.args)
        if args == node.args:
            continue
        if node.op == "select" and args[0].op == "const":
            new[node] = graph.number(args[1 if args[0].data else 2])
        elif node.op in COMPARISONS or node.op in LOGIC:
            new[node] = graph.op(node.op, *args)
        else:
            new[node] = graph.like(node, *args)
    return [new.get(e, e) for e in exprs]


@dataclass(frozen=True, kw_only=True)
class _Between:
    """A slide among equations: what it changes there, and the relay's output that blends them."""

    graph: Graph
    node: Node
    place: int  # of the node among the blocks
    leaf: Expr  # what stands for the relay's output, from -1 to 1
    kept: Expr  # its mode: 1 or -1 on a side, 0 where it slides
    function: Expr  # the switching function, the relay's input
    changing: tuple[Expr, ...]

    def blended(self, exprs: Sequence[Expr], v: Expr) -> list[Expr]:
        """Return expressions as they are at a `v` between both sides, next to these."""
        op, half = self.graph.op, self.graph.const(0.5)
        blended = []
        for a, b in zip(*self._sides(exprs, None), strict=True):
            mean, apart = op("mul", half, op("add", a, b)), op("mul", half, op("sub", b, a))
            blended.append(a if a is b else op("add", mean, op("mul", v, apart)))
        return blended

    def by_mode(self, exprs: Sequence[Expr], v: Expr) -> list[Expr]:
        """Return expressions as they are on the side that the relay's memory says, or between."""
        op, const = self.graph.op, self.graph.const
        below, above = op("lt", self.kept, const(0.0)), op("gt", self.kept, const(0.0))
        sides, chosen = self._sides(exprs, self.function), []
        for a, b, between in zip(*sides, self.blended(exprs, v), strict=True):
            inner = op("select", above, b, between)
            chosen.append(a if a is b is between else op("select", below, a, inner))
        return chosen

    def _sides(self, exprs: Sequence[Expr], beyond: Expr | None) -> tuple[list[Expr], list[Expr]]:
        sides = self.node.slide.sides if self.node.slide else ()
        return of_both_sides(self.graph, exprs, self.changing, sides, beyond)


def _by_terms(
    graph: Graph,
    exprs: Sequence[Expr],
    slides: Sequence[_Between],
    change: Callable[[int, Sequence[Expr]], list[Expr]],
) -> list[Expr]:
    """Return expressions with all slides, of a sum each term with those that it depends on."""
    # A product of what two do would not be a + B v, though their sum is.
    if len(slides) == 1:
        return change(0, exprs)
    depends: dict[Expr, frozenset[int]] = {}
    for node in needed(exprs):
        here = {k for k, slide in enumerate(slides) if node in slide.changing}
        depends[node] = frozenset(here).union(*(depends[arg] for arg in node.args))

    def terms(node: Expr) -> tuple[Expr, ...]:
        by = [bool(depends[arg]) for arg in node.args]
        scaled = (node.op == "mul" and sum(by) == 1) or (node.op == "div" and not by[1])
        several = len(depends[node]) > 1 and (node.op in ("add", "sub", "neg") or scaled)
        return node.args if several else ()

    def changed(node: Expr) -> Expr:
        if terms(node):
            return graph.op(node.op, *(new[arg] for arg in node.args))
        one = [node]
        for k in sorted(depends[node]):
            one = change(k, one)
        return one[0]

    new: dict[Expr, Expr] = {}
    return [deduce(new, expr, terms, changed) for expr in exprs]


def with_slides(
    reader: Reader, schedule: Schedule, results: _Results, conditions: Conditions
) -> tuple[_Results, Conditions]:
    """Return results and conditions of equations that have been read, with what slides."""
    slides = _slides(reader, results, conditions)
    if not slides:
        return results, conditions
    derived = _derived(reader, schedule, results, slides)
    outputs = [one.output for one in derived]

    def by_mode(k: int, exprs: Sequence[Expr]) -> list[Expr]:
        return slides[k].by_mode(exprs, outputs[k])

    def changed(exprs: Sequence[Expr]) -> list[Expr]:
        return _by_terms(reader.graph, exprs, slides, by_mode)

    _check_apart(reader, schedule, results, changed)
    slid = results | {name: _changed(reader.graph, results[name], changed) for name in _BLENDED}
    return _with_relays(reader, slid, conditions, slides, derived)


def _slides(reader: Reader, results: _Results, conditions: Conditions) -> list[_Between]:
    """Return what slides stand for, of those nodes that are slides."""
    graph, first = reader.graph, len(relay_places(reader.blocks))
    every = [*_pieces(results), *(e for part in reader.fixed_points.values() for e in part)]
    slides: list[_Between] = []
    for i, node in enumerate(reader.blocks):
        if node.slide is None:
            continue
        functions = [conditions.located[place].function for place in node.slide.places]
        changing = changing_at(graph, every, functions)
        if len(changing) != len(node.slide.sides):
            raise CompileError(f"{_who(node)} compares otherwise than where it was seen to jump")
        leaf = graph.leaf(OUTPUTS, first + len(slides), None)
        slides.append(
            _Between(
                graph=graph, node=node, place=i, leaf=leaf, kept=kept_of(reader, i),
                function=functions[0], changing=changing,
            )
        )  # fmt: skip
    return slides


def _derived(
    reader: Reader, schedule: Schedule, results: _Results, slides: Sequence[_Between]
) -> list[SlidingRate]:
    """Return rates and outputs of the relays that stand for conditions."""
    graph = reader.graph

    def blended(exprs: Sequence[Expr], of: Sequence[_Between] = slides) -> list[Expr]:
        def by(k: int, exprs: Sequence[Expr]) -> list[Expr]:
            return of[k].blended(exprs, of[k].leaf)

        return _by_terms(graph, exprs, of, by)

    rates: dict[int, Expr] = {
        row + k: graph.number(array[k].only)
        for row, array in results["dx"]
        for k in range(array.size)
    }
    rates |= {m: graph.const(0.0) for node in reader.blocks for m in memory(node)}
    inputs = [
        SlidingInput(
            name=_who(slide.node), leaf=slide.leaf, kept=slide.kept,
            limits=limits_of(reader, slide.place),
            given=blended([slide.function], [other for other in slides if other is not slide])[0],
        )
        for slide in slides
    ]  # fmt: skip

    def output(k: int, known: Sequence[Expr]) -> Expr:
        return reader.relay_output(slides[k].place, array_of(graph, known))[0].only

    motion = Motion(
        rates=blended([rates[row] for row in sorted(rates)]), solutions=reader.fixed_points,
        inputs=schedule.system.ninputs or 0, behind=schedule.ninputs - schedule.rates,
    )  # fmt: skip
    return sliding_rates(graph, inputs, motion, output)


def _check_apart(
    reader: Reader, schedule: Schedule, results: _Results, changed: Callable[..., list[Expr]]
) -> None:
    """Refuse a slide of which more depends than rates and outputs: these have no mean."""
    others = [e for part in reader.fixed_points.values() for e in part]
    others += _pieces({name: part for name, part in results.items() if name not in _BLENDED})
    arriving = results["y"][0][1][schedule.system.noutputs or 0 :]
    others += [expr for expr, _ in arriving.pieces()]
    if any(a is not b for a, b in zip(others, changed(others), strict=True)):
        raise CompileError("a sample, a reset, a memory or a delay depends on what slides")


def _with_relays(
    reader: Reader, results: _Results, conditions: Conditions, slides: Sequence[_Between],
    derived: Sequence[SlidingRate],
) -> tuple[_Results, Conditions]:  # fmt: skip
    """Return results with what relays declare and remember, and without what they stand for."""
    declared, kept = dict[int, Tracer](), dict[int, Tracer]()
    counts = [count_switching_functions(node) for node in reader.blocks]
    memories = [len(memory(node)) for node in reader.blocks]
    for slide, rate in zip(slides, derived, strict=True):
        i, given = slide.place, [slide.function, rate.drift, rate.gain]
        events = reader.events(i, array_of(reader.graph, given))
        declared[sum(counts[:i])] = events[: counts[i]]
        kept[sum(memories[:i])] = events[counts[i] :]
    gone = {place for slide in slides if slide.node.slide for place in slide.node.slide.places}
    begin, rows = sum(counts), results["g"]
    behind = [array for row, array in rows if row >= begin]
    stay = [k for k in range(len(behind)) if k not in gone]
    g = [(row, declared.get(row, array)) for row, array in rows if row < begin]
    for k in stay:
        g.append((begin, behind[k]))
        begin += behind[k].size
    left = [one for k, one in enumerate(conditions.located) if k not in gone]
    results = results | {"g": g, "m": [(row, kept.get(row, array)) for row, array in results["m"]]}
    return results, replace(conditions, located=tuple(left))


def _changed(
    graph: Graph, rows: Sequence[tuple[int, Tracer]], changed: Callable[..., list[Expr]]
) -> list[tuple[int, Tracer]]:
    """Return arrays with their rows, all expressions of which have been changed."""
    new = []
    for row, array in rows:
        exprs = changed([expr for expr, _ in array.pieces()])
        cells = as_array(exprs[0]) if array.axis is not None else np.empty(len(exprs), dtype=object)
        if array.axis is None:
            cells[:] = exprs
        new.append((row, Tracer(graph, cells, array.axis, array.length)))
    return new


def _pieces(results: _Results) -> list[Expr]:
    return [e for rows in results.values() for _, array in rows for e, _ in array.pieces()]


def _who(node: Node) -> str:
    return f"{node.slide.what[1]} of block '{node.slide.what[0]}'" if node.slide else node.path
