"""What switches in the equations of a diagram, and what is a function of time alone there."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...blocks import Block, memory_states
from ...expressions.arrays import Tracer
from ...expressions.bends import Bending, replaced_parts
from ...expressions.conditions import (
    conditions,
    is_of_places,
    sign_factors,
    switching_functions,
)
from ...expressions.dependence import affine, reads
from ...expressions.derivatives import tangents
from ...expressions.edges import have_edges
from ...expressions.functions import COUNTING
from ...expressions.graph import ORDERS, Expr, Graph, deduce, needed
from ...expressions.sharp import SharpArgument, sharp_arguments
from ..diagram.nodes import Node
from ..diagram.parameters import length
from ..diagram.program import count_switching_functions, memory
from .reader import Reader

_MOST = 256  # switching functions of one diagram; more cost more than they are worth
_MOST_FREQUENCIES = 64  # in a product: of more it is a train of pulses rather than a wave
_SIZES = 3  # in a comparison of t alone: absolute values, each of which has two signs
_BENDS = ("absolute", "minimum", "maximum")
_STEEP = ("sqrt", "power", "cbrt", "hypot")  # a rate that has no derivative where it is 0


@dataclass(frozen=True, kw_only=True)
class Located:
    """One condition of the equations that is located."""

    function: Expr  # its switching function: a change of sign is an event
    block: str  # the block in whose equations it stands
    what: str  # the operation
    bends: bool  # whether nothing jumps there: the equations have a kink, of `abs`, `min` and `max`
    # 1 and -1 for the functions of even and of odd integers, one behind the other
    integers: int = 0

    @property
    def rows(self) -> int:
        """Numbers that the switching function is."""
        return self.function.size or 1

    @property
    def counted(self) -> int:
        """As how many conditions it counts: of integers there are two functions."""
        return self.rows if self.integers >= 0 else 0


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """What the right-hand side of a diagram switches at, beyond what its blocks declare."""

    # first those that only bend, then those at which something may jump
    located: tuple[Located, ...] = ()
    # conditions of t alone, which are solved before a run, and with what each switches
    of_time: Mapping[Expr, Sequence[Expr]] = field(default_factory=dict)
    # switching functions that blocks declare and that are straight lines of t, by their rows:
    # faults' beginnings and ends
    declared_of_time: Mapping[int, Expr] = field(default_factory=dict)
    # of products of sines of t the angular frequencies of the factors
    waves: tuple[tuple[Expr, ...], ...] = ()
    pulses: tuple[Expr, ...] = ()  # other functions of t alone that drive the equations
    beyond: int = 0  # conditions that are too many to be located
    shown: int = 0  # conditions that move an output of the diagram alone: none of these is located
    # by what functions are measured that are flat but for a narrow range of their argument
    sharp: tuple[SharpArgument, ...] = ()
    # of slides along integers, which conditions locate: at what their relays switch, by their rows
    levels: Mapping[int, Expr] = field(default_factory=dict)

    @property
    def switches_of_time(self) -> bool:
        """Whether anything of t alone switches, as far as that is solved before a run."""
        return bool(self.of_time or self.declared_of_time)

    @property
    def rows(self) -> int:
        """Numbers that the switching functions are."""
        return sum(condition.rows for condition in self.located)

    @property
    def kinds(self) -> list[int]:
        """How each of the numbers is by which sharp functions are measured."""
        return [one.kind for one in self.sharp for _ in range(one.expr.size or 1)]

    @property
    def count(self) -> int:
        """How many conditions that is."""
        return sum(condition.counted for condition in self.located)

    @property
    def partners(self) -> list[int]:
        """How many rows behind it, or with a sign before, each row's partner is; 0 for none."""
        # Where the function of even integers is 0, it rises with what is counted if the other one
        # is below 0; where that one is 0, if the first is above.
        return [one.integers * one.rows for one in self.located for _ in range(one.rows)]

    @property
    def bending(self) -> int:
        """How many of these are of conditions that only bend."""
        return sum(condition.rows for condition in self.located if condition.bends)


def found_conditions(
    reader: Reader,
    rates: Sequence[Tracer],
    declared: Iterable[Tracer],
    guards: Mapping[int, Tracer],
    others: Iterable[Expr],
    watched: Iterable[Expr] = (),
    shown: Iterable[Expr] = (),
) -> Conditions:
    """Return what switches in a diagram whose blocks have been read."""
    # Where it moves rates, declared switching functions, guards, by their blocks' places, what
    # arrives at delays and memories become (`others`), or an event function (`watched`). What
    # moves nothing but an output (`shown`) is counted.
    declared, others = tuple(declared), tuple(others)
    watched = [_with_levels(reader.graph, function) for function in watched]
    falls = {
        i: [_with_levels(reader.graph, function) for function in _pieces([guard])]
        for i, guard in guards.items()
    }
    solved = [e for located in reader.fixed_points.values() for e in located]
    guarded = [function for functions in falls.values() for function in functions]
    roots = [*others, *_pieces([*rates, *declared]), *guarded, *solved]
    moving = needed(roots)
    nodes = needed([*roots, *watched]) if watched else moving
    timed, inside = of_time_alone(nodes), set(nodes)
    known = {sign_key(e) for e in _pieces(declared)}
    located: dict[object, Located] = {}
    of_time: dict[Expr, tuple[Expr, ...]] = {}
    rows, count, beyond = 0, 0, sum(n.op in ORDERS for n in inside & reader.graph.of_passes)
    only_shown = set(needed(list(shown))) - inside
    # values of parameters: 1 for those that are not known
    p = np.ones(length(reader.layout)) if reader.p is None else reader.p
    # Towards rest in a finite time, x' = -sign(x) sqrt(|x|), nothing jumps within tolerances of 0.
    bending = Bending(reader.graph, roots, p) if any(map(_is_steep, moving)) else None
    for condition, node in _undeclared(reader, rates, falls, others, watched):
        if condition in timed and condition in inside:
            of_time[condition] = _factors_of_time(reader.graph, condition)
        if condition in timed or condition not in inside:
            count += condition in only_shown
            continue
        bends = condition.op in _BENDS or (bending is not None and bending.only_bends(condition))
        path, functions = "" if node is None else node.path, _with_sides(reader.graph, condition)
        one = Located(function=condition, block=path, what=condition.op, bends=bends)
        rows, left = _entered(located, known, functions, one, node, rows)
        beyond += left
    # What a watched function is NaN behind is found by that, and moves without end before.
    whole = [function for function in watched if not have_edges(needed([function]))]
    terms = _terms(needed([*roots, *whole]) if whole else moving, timed)
    waves, pulses = _moving(reader.graph, terms, timed)
    ordered = tuple(sorted(located.values(), key=lambda one: not one.bends))
    return Conditions(
        located=ordered, of_time=of_time,
        declared_of_time=_declared_of_time(reader.graph, declared, timed), waves=waves,
        pulses=pulses, beyond=beyond, shown=count,
        sharp=_sharp(reader, rates, falls, watched, inside - timed),
    )  # fmt: skip


def _is_steep(node: Expr) -> bool:
    """Whether a rate may have no derivative where an expression is 0."""
    if node.op == "power" and any(arg.op == "const" for arg in node.args):
        base, exponent = node.args  # 10^z is smooth, and z^1.5 has a derivative
        return base.op != "const" and exponent.data < 1.0
    return node.op in _STEEP and node.varies


def _factors_of_time(graph: Graph, condition: Expr) -> tuple[Expr, ...]:
    """Return with what a comparison of t alone switches, if that says more than a difference."""
    if condition.op not in ORDERS or condition.size is not None:
        return ()
    difference = graph.op("sub", *map(graph.number, condition.args))
    functions = [difference]
    for _ in range(_SIZES):  # |z| - r is z - r or -z - r
        for size in [n for n in needed(functions) if n.op == "absolute" and n.varies][:1]:
            sides = size.args[0], graph.op("neg", size.args[0])
            instead = (replaced_parts(graph, functions, {size: side}) for side in sides)
            functions = [function for every in instead for function in every]
    functions += switching_functions(graph, condition)
    factors = [factor for function in functions for factor in sign_factors(graph, function)]
    return tuple(factor for factor in dict.fromkeys(factors) if factor is not difference)


def _with_levels(graph: Graph, function: Expr) -> Expr:
    """Return whether a guard, or what is watched, is above 0, if more than itself says so."""
    # Between two roots close by a product is hardly below 0, and a peak may be narrow.
    if len(sign_factors(graph, function)) == 1 or function in of_time_alone(needed([function])):
        return function
    return graph.op("gt", function, graph.const(0.0))


def _declared_of_time(
    graph: Graph, declared: Sequence[Tracer], timed: set[Expr]
) -> dict[int, Expr]:
    """Return the declared switching functions that are straight lines of t, by their rows."""
    functions, row, t = dict[int, Expr](), 0, graph.leaf("t", 0, None)
    for expr, size in (piece for array in declared for piece in array.pieces()):
        if expr in timed and size == 1 and affine(expr, t):
            functions[row] = expr
        row += size
    return functions


def _entered(
    located: dict[object, Located],
    known: set[object],
    functions: Sequence[tuple[Expr, int]],
    condition: Located,
    node: Node | None,
    rows: int,
) -> tuple[int, int]:
    """Enter a condition by its switching functions; return all rows, and how many are too many."""
    beyond = 0
    for function, side in functions:
        key, size = sign_key(function), function.size or 1
        if key in located:
            located[key] = replace(located[key], bends=condition.bends and located[key].bends)
            continue
        if key in known or not function.varies or _remembers(function, node):
            continue
        size *= side >= 0  # of two functions of integers one counts
        if rows + size > _MOST:
            beyond += size
        elif size or sign_key(functions[0][0]) in located:
            located[key] = replace(condition, function=function, integers=side)
            rows += size
    return rows, beyond


def _sharp(
    reader: Reader,
    rates: Sequence[Tracer],
    guards: Mapping[int, list[Expr]],
    watched: Sequence[Expr],
    moving: set[Expr],
) -> tuple[SharpArgument, ...]:
    """Return by what sharp functions of the users' blocks, and of the run, are measured."""
    # Those of nlctl's own blocks are as smooth as their parameters have them.
    nodes = dict.fromkeys(part for part in needed(watched) if part in moving)
    for i, node in enumerate(reader.blocks):
        if node.sampled or _is_of_nlctl(node):
            continue
        given = _given(reader, i, node)
        parts = needed([*_pieces([reader.signals[i], rates[i]]), *guards.get(i, [])], given)
        nodes |= dict.fromkeys(part for part in parts if part in moving)
    arguments, rows = [], 0
    # What a search has chosen moves by that as well, and comes to rest at what it searches for.
    chosen = {part for part in reader.graph.of_passes if part.op in ORDERS}
    for argument in sharp_arguments(reader.graph, nodes):
        parts = needed([argument.expr])
        if any(part.op == "call" or part in chosen for part in parts):
            continue
        rows += argument.expr.size or 1
        if rows <= _MOST:
            arguments.append(argument)
    return tuple(arguments)


def _with_sides(graph: Graph, condition: Expr) -> list[tuple[Expr, int]]:
    """Return switching functions, each with what `Located.integers` says of it."""
    functions = switching_functions(graph, condition)
    sides = (1, -1) if is_of_places(condition) else (0,) * len(functions)
    return list(zip(functions, sides, strict=True))


def _pieces(arrays: Iterable[Tracer]) -> list[Expr]:
    """Return the expressions that arrays are made of."""
    return [e for array in arrays for e, _ in array.pieces()]


def _undeclared(
    reader: Reader,
    rates: Sequence[Tracer],
    guards: Mapping[int, list[Expr]],
    others: Sequence[Expr],
    watched: Sequence[Expr],
) -> Iterable[tuple[Expr, Node | None]]:
    """Yield the conditions of blocks that do not declare theirs, each with its block."""
    # And those of the run's own event functions.
    for i, node in enumerate(reader.blocks):
        if node.sampled or _declares(node):
            continue
        given = _given(reader, i, node)
        parts = [*_pieces([reader.signals[i], rates[i]]), *guards.get(i, [])]
        for condition in conditions(parts, given, reader.graph.of_passes):
            yield condition, node
    # What signals are, and memories become, is of blocks.
    for condition in conditions(watched, {*_pieces(reader.signals.values()), *others}):
        yield condition, None


def _given(reader: Reader, i: int, node: Node) -> set[Expr]:
    """Return what a block is given by others: in a loop of its own it is given its outputs."""
    return set(_pieces([reader.wired(node.inputs)])) - set(_pieces([reader.signals[i]]))


def _remembers(function: Expr, node: Node | None) -> bool:
    """Whether a condition asks for a memory of its own block, which stands aside within a step."""
    return node is not None and reads([function], "x", memory(node))


def _declares(node: Node) -> bool:
    """Whether a block is one of nlctl's that say where they switch: their tests hold that."""
    if not _is_of_nlctl(node):
        return False
    return bool(count_switching_functions(node) or memory_states(node.system.spec))


def _is_of_nlctl(node: Node) -> bool:
    system = node.system
    return isinstance(system, Block) and type(system.spec).__module__.startswith("nlctl.")


def sign_key(function: Expr) -> object:
    """Return what is the same for functions that change their signs together."""
    while function.op == "neg":
        function = function.args[0]
    if function.op == "sub":
        return frozenset(function.args)
    return function


def of_time_alone(nodes: Sequence[Expr]) -> set[Expr]:
    """Return which expressions vary with t and with nothing else."""
    moved: set[Expr] = set()  # by states, inputs, or what nobody knows
    timed: set[Expr] = set()
    for node in nodes:
        if node.op == "leaf" and node.varies:
            (timed if node.data[0] == "t" else moved).add(node)
        elif node.op in ("call", "solve") or any(arg in moved for arg in node.args):
            moved.add(node)
        elif any(arg in timed for arg in node.args):
            timed.add(node)
    return timed


def _terms(nodes: Sequence[Expr], timed: set[Expr]) -> list[Expr]:
    """Return the largest functions of t alone, sums of them divided into what they add."""
    inner = {arg for node in nodes if node in timed for arg in node.args}
    used = {arg for node in nodes if node not in timed for arg in node.args if arg in timed}
    outer = [node for node in nodes if node in timed and (node in used or node not in inner)]
    terms: dict[Expr, None] = {}
    while outer:
        node = outer.pop()
        if node.op in ("add", "sub", "neg", "concat") and node in timed:
            outer += [arg for arg in node.args if arg in timed]
        elif node.kind == "f" and node.op != "leaf":
            terms[node] = None
    return list(terms)


def _moving(
    graph: Graph, terms: Sequence[Expr], timed: set[Expr]
) -> tuple[tuple[tuple[Expr, ...], ...], tuple[Expr, ...]]:
    """Return the angular frequencies of products of sines, and the terms that are none."""
    waves: dict[tuple[Expr, ...], None] = {}
    pulses: dict[Expr, None] = {}
    for term in terms:
        frequencies = _frequencies(graph, term, timed)
        if frequencies is None:
            pulses |= dict.fromkeys(_pulses(graph, term, timed))
        elif frequencies:
            waves[frequencies] = None
    return tuple(waves), tuple(pulses)


def _pulses(graph: Graph, term: Expr, timed: set[Expr]) -> list[Expr]:
    """Return a function of t with the factors in it that are no waves.

    In a train of pulses that a wave modulates, one may be low; as a factor it is as high as others.
    """
    pulses, left = {term: None}, [term]
    while left and len(pulses) < _MOST_FREQUENCIES:
        node = left.pop()
        factors = dict.fromkeys(node.args if node.op == "mul" else ())
        alone = [f for f in factors if f in timed and f.op != "leaf" and f not in pulses]
        sought = [factor for factor in alone if _frequencies(graph, factor, timed) is None]
        pulses |= dict.fromkeys(sought)
        left += sought
    return list(pulses)


def _frequencies(graph: Graph, term: Expr, timed: set[Expr]) -> tuple[Expr, ...] | None:
    """Return the angular frequencies in a function of t; None if it has no highest one."""
    # Of pieces that are put together at conditions those of the pieces: where one switches, a step
    # ends anyway.
    frequencies: dict[Expr, tuple[Expr, ...] | None] = {}

    def is_combined(node: Expr) -> bool:
        is_product = node.op in _PRODUCTS or (node.op == "div" and node.args[1] not in timed)
        return is_product and node in timed and node.kind != "b"

    def those_of(node: Expr) -> tuple[Expr, ...] | None:
        if node not in timed or node.op == "leaf" or node.kind == "b":
            return ()
        if not is_combined(node):
            return _frequency(graph, node)
        parts = [frequencies[arg] for arg in node.args]
        several = tuple(slope for part in parts for slope in part or ())
        return several if None not in parts and len(several) <= _MOST_FREQUENCIES else None

    return deduce(frequencies, term, lambda e: e.args if is_combined(e) else (), those_of)


def _frequency(graph: Graph, node: Expr) -> tuple[Expr, ...] | None:
    """Return the angular frequency of a sine or cosine; None if it is not constant."""
    if node.op not in ("sin", "cos"):
        return None
    one = graph.const(1.0)
    (slope,) = tangents(graph, node.args, lambda e: one if e.data[0] == "t" else None)
    return None if slope is None or slope.varies else (slope,)


_PRODUCTS = (
    *("mul", "add", "sub", "neg", "select", "item", "slice", "concat", "sum"),
    *("minimum", "maximum", "absolute", "sign", *COUNTING),
    *("remainder", "fmod", "heaviside", "copysign"),
)
