"""Conditions at which a run slides: between the equations of both sides, by Filippov.

Where the solutions on both sides of a condition lead back to it, one goes along it, with a convex
combination of what holds on both sides.  Of rates f- below it and f+ above it that is

    x' = (f+ + f-) / 2 + v (f+ - f-) / 2

with the v of [-1, 1] that keeps the condition's switching function s at 0.  What an ideal relay
does with its input s is just that: one without signals stands for the condition, and v is what it
outputs while it slides.  Everywhere else the equations are what they were.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from ...errors import CompileError
from ...expressions.arrays import Tracer, as_array
from ...expressions.conditions import of_zigzag, switching_functions, zigzag
from ...expressions.dependence import ADDITIVE
from ...expressions.functions import COUNTING
from ...expressions.graph import COMPARISONS, LOGIC, ORDERS, Expr, Graph, deduce, needed
from ...wording import counted
from ..diagram.nodes import Slide
from ..diagram.program import count_switching_functions, memory
from ..diagram.schedule import Schedule
from ..sliding.rates import OUTPUTS, Motion, SlidingInput, SlidingRate, sliding_rates
from .located import Conditions, Located, sign_key
from .reader import Reader
from .relays import array_of, kept_of, limits_of, relay_places

_Results = dict[str, list[tuple[int, Tracer]]]
Pairs = Mapping[Expr, tuple[Expr, Expr]]  # of comparisons what they are below, and above
_EQUAL = {"eq": False, "ne": True}  # next to a place at which two numbers are equal
_JUMPING = (*ORDERS, *_EQUAL, "sign", "heaviside", *COUNTING, "remainder", "fmod")
_BLENDED = ("dx", "g", "y")
_SEVERAL = 8  # conditions on which one number may depend otherwise: it has 2^8 sides


def changing_at(graph: Graph, exprs: Iterable[Expr], functions: Iterable[Expr]) -> tuple[Expr, ...]:
    """Return the comparisons in expressions that change where switching functions are 0."""
    # What blocks declare may be a product, of which comparisons have the factors.
    zero, functions = graph.const(0.0), [*functions]
    factors = (_functions(graph, graph.op("gt", function, zero)) for function in functions)
    keys = {sign_key(part) for parts in (functions, *factors) for part in parts}
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


def of_both_sides(graph: Graph, exprs: Sequence[Expr], pairs: Pairs) -> list[list[Expr]]:
    """Return expressions as they are below and above, where comparisons are what is said."""
    ways = ({node: pair[k] for node, pair in pairs.items()} for k in range(2))
    return [_folded(graph, exprs, way) for way in ways]


def on_sides(
    graph: Graph, node: Expr, values: Sequence[float], functions: Sequence[Expr]
) -> tuple[Expr, Expr]:
    """Return what a comparison is below and above; `values` where `others_of` is not < 0."""
    low, high = (graph.const(bool(v) if node.kind == "b" else float(v)) for v in values)
    if node.op in _EQUAL:
        return low, high
    if values[0] == values[1]:  # it has a factor that changes here, and does not change itself
        return node, node
    if zigzag(graph, node) is not None:
        return of_zigzag(graph, node)
    others = others_of(graph, node, functions)
    if others is None:
        return low, high
    way = graph.op("ge", others, graph.const(0.0))  # edges of a domain are 0 at least
    if node.kind == "b":
        return graph.op("xor", way, high), graph.op("xor", way, low)
    return graph.op("select", way, low, high), graph.op("select", way, high, low)


def others_of(graph: Graph, node: Expr, functions: Sequence[Expr]) -> Expr | None:
    """Return what exchanges the sides of a comparison with its own sign; None of nothing."""
    # A product compares otherwise behind a zero of its other factor.
    here, first = {sign_key(function) for function in functions}, functions[0]
    of_node = {sign_key(part): part for part in _functions(graph, node)}
    of_first = {sign_key(first): first}
    if of_node.keys().isdisjoint(of_first):
        size = graph.op("gt", first, graph.const(0.0))
        of_first = {sign_key(part): part for part in _functions(graph, size)}
    apart = of_node.keys() ^ of_first.keys()
    every = of_node | of_first
    others = [part for key, part in every.items() if key in apart and key not in here]
    return reduce(lambda a, b: graph.op("mul", a, b), others) if others else None


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
    slide: Slide
    place: int  # of its node among the blocks
    leaf: Expr  # what stands for the relay's output, from -1 to 1
    kept: Expr  # its mode: 1 or -1 on a side, 0 where it slides
    function: Expr  # the switching function, the relay's input
    pairs: Pairs  # what changes there

    def blended(self, exprs: Sequence[Expr], v: Expr) -> list[Expr]:
        """Return expressions as they are at a `v` between both sides, next to these."""
        sides = of_both_sides(self.graph, exprs, self.pairs)
        return [self._between(a, b, v) for a, b in zip(*sides, strict=True)]

    def _between(self, a: Expr, b: Expr, v: Expr) -> Expr:
        op, half = self.graph.op, self.graph.const(0.5)
        mean, apart = op("mul", half, op("add", a, b)), op("mul", half, op("sub", b, a))
        return a if a is b else op("add", mean, op("mul", v, apart))

    def by_mode(self, exprs: Sequence[Expr], v: Expr) -> list[Expr]:
        """Return expressions as they are on the side that the relay's memory says, or between."""
        op, const = self.graph.op, self.graph.const
        below, above = op("lt", self.kept, const(0.0)), op("gt", self.kept, const(0.0))
        chosen = []
        for a, b in zip(*of_both_sides(self.graph, exprs, self.pairs), strict=True):
            inner = op("select", above, b, self._between(a, b, v))
            chosen.append(a if a is b else op("select", below, a, inner))
        return chosen

    def if_it_slides(self, one: Expr, other: Expr) -> Expr:
        """Return an expression while it slides, and else another."""
        slides = self.graph.op("eq", self.kept, self.graph.const(0.0))
        return self.graph.op("select", slides, one, other)


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
        depends[node] = _changing(slides, node).union(*(depends[arg] for arg in node.args))

    def terms(node: Expr) -> tuple[Expr, ...]:
        by = [depends[arg] for arg in node.args]
        apart = (node.op == "mul" and by[0].isdisjoint(by[1])) or (node.op == "div" and not by[1])
        apart |= node.op == "select" and not by[0]  # as math.sin has one: it is NaN of infinity
        return node.args if len(depends[node]) > 1 and (node.op in ADDITIVE or apart) else ()

    def changed(node: Expr) -> Expr:
        if terms(node):
            return graph.like(node, *(new[arg] for arg in node.args))
        if len(depends[node]) > _SEVERAL:
            conditions = counted(len(depends[node]), "condition")
            raise CompileError(f"a number has too many sides: it depends on {conditions}")
        one = [node]
        for k in sorted(depends[node]):
            one = change(k, one)
        return one[0]

    new: dict[Expr, Expr] = {}
    return [deduce(new, expr, terms, changed) for expr in exprs]


def _changing(slides: Sequence[_Between], node: Expr) -> frozenset[int]:
    """Return the slides that change an expression itself, or what others have changed it to."""
    here, ways = set[int](), {node}
    for k, slide in enumerate(slides):
        if not ways.isdisjoint(slide.pairs):
            here.add(k)
            ways.update(needed([e for way in ways for e in slide.pairs.get(way, ())]))
    return frozenset(here)


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
    declared = declared_functions(results, sum(map(count_switching_functions, reader.blocks)))
    slides, gone = list[_Between](), set[Expr]()
    for i, node in enumerate(reader.blocks):
        if (slide := node.slide) is None:
            continue
        functions = [declared[row] for row in slide.declared]
        functions += [conditions.located[place].function for place in slide.places]
        changing = [one for one in changing_at(graph, every, functions) if one not in gone]
        if len(changing) != len(slide.sides):
            raise CompileError(f"{slide.name} compares otherwise than where it was seen to jump")
        pairs = {
            one: on_sides(graph, one, pair, functions)
            for one, pair in zip(changing, slide.sides, strict=True)
        }
        every += [e for pair in pairs.values() for e in pair]  # it may have another zero there
        gone |= {one for one, pair in pairs.items() if one not in pair}
        function = functions[0]
        if slide.integers:
            function = next(filter(None, (zigzag(graph, one) for one in changing)), function)
        leaf = graph.leaf(OUTPUTS, first + len(slides), None)
        slides.append(
            _Between(
                graph=graph, slide=slide, place=i, leaf=leaf, kept=kept_of(reader, i),
                function=function, pairs=pairs,
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
            name=between.slide.name, leaf=between.leaf, kept=between.kept,
            limits=limits_of(reader, between.place),
            given=blended([between.function], [o for o in slides if o is not between])[0],
        )
        for between in slides
    ]  # fmt: skip

    def output(k: int, known: Sequence[Expr]) -> Expr:
        return reader.relay_output(slides[k].place, array_of(graph, known))[0].only

    motion = Motion(
        rates=blended([rates[row] for row in sorted(rates)]), solutions=reader.fixed_points,
        inputs=schedule.system.ninputs or 0, behind=schedule.ninputs - schedule.rates,
        products=True,
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
    declared, kept, levels = dict[int, Tracer](), dict[int, Tracer](), dict[int, Expr]()
    counts = [count_switching_functions(node) for node in reader.blocks]
    memories = [len(memory(node)) for node in reader.blocks]
    for between, rate in zip(slides, derived, strict=True):
        i, given = between.place, [between.function, rate.drift, rate.gain]
        events = reader.events(i, array_of(reader.graph, given))
        row, functions = sum(counts[:i]), events[: counts[i]]
        declared[row] = functions
        if between.slide.integers:  # conditions say where one is met
            first, *others = functions.cells.flat
            silent_first = between.if_it_slides(first, reader.graph.const(1.0))
            declared[row] = array_of(reader.graph, [silent_first, *others])
            levels[row] = first
        kept[sum(memories[:i])] = events[counts[i] :]
    silent = {row for between in slides for row in between.slide.declared}
    begin, rows = sum(counts), results["g"]
    behind = [array for row, array in rows if row >= begin]
    located = _left(slides, conditions)
    g = [(row, _silenced(reader.graph, row, array, silent)) for row, array in rows if row < begin]
    g = [(row, declared.get(row, array)) for row, array in g]
    moved = {k: one.function for k, one in located.items() if one is not conditions.located[k]}
    stay = (array_of(reader.graph, [moved[k]]) if k in moved else behind[k] for k in located)
    for array in (*stay, *behind[len(conditions.located) :]):
        g.append((begin, array))
        begin += array.size
    results = results | {"g": g, "m": [(row, kept.get(row, array)) for row, array in results["m"]]}
    return results, replace(conditions, located=tuple(located.values()), levels=levels)


def _left(slides: Sequence[_Between], conditions: Conditions) -> dict[int, Located]:
    """Return the conditions that are left: those of integers, where nothing slides along them."""
    left = dict(enumerate(conditions.located))
    for between in slides:
        for place in between.slide.places:
            one = left.pop(place)
            if between.slide.integers:
                function = between.if_it_slides(between.graph.const(1.0), one.function)
                left[place] = replace(one, function=function)
    return dict(sorted(left.items()))


def _silenced(graph: Graph, row: int, array: Tracer, silent: set[int]) -> Tracer:
    """Return declared functions, with 1 instead of those at which a run slides."""
    if silent.isdisjoint(range(row, row + array.size)):
        return array
    parts = enumerate(array.short().values.flat, row)
    return array_of(graph, [graph.const(1.0) if k in silent else expr for k, expr in parts])


def declared_functions(results: _Results, count: int) -> dict[int, Expr]:
    """Return the first `count` switching functions, those that are numbers, by their rows."""
    functions = dict[int, Expr]()
    for row, array in results["g"]:
        for expr, size in array.pieces() if row < count else ():
            if size == 1:
                functions[row] = expr
            row += size
    return functions


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
