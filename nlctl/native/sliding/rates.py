"""The rate that a diagram gives the input of an ideal relay, as a function of the relay's output.

The relay's output v is a leaf, read as if it came from outside.  Along x' the relay's input has the
derivative u' = a + b v, where b is its derivative by v, and a its value at v = 0; or one that is so
piece by piece, see `pieces`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from ...errors import CompileError
from ...expressions.bends import replaced_parts
from ...expressions.dependence import affine
from ...expressions.derivatives import tangents
from ...expressions.graph import Expr, Graph, Untraceable, needed
from .pieces import LeafDerivative, bend_places, slope_of, unreadable, zero_between
from .second import Limits, second_order
from .together import Coupled, own_rates

OUTPUTS = "relays"  # the array of leaves that stand for the relays' outputs
_SMOOTH = "smooth the jump over a small width, or give it hysteresis (nlctl.Relay)"


@dataclass(frozen=True, kw_only=True)
class SlidingInput:
    """The input of an ideal relay of a diagram."""

    name: str  # of the relay's block
    leaf: Expr  # what stands for the relay's output
    given: Expr  # the input, an expression
    kept: Expr  # its mode: 1 or -1 on a side, 0 where it slides
    limits: Limits  # its parameters


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How a diagram moves within a step."""

    rates: Sequence[Expr]  # the derivative of each state; of memories 0
    # as `fixed_points` of `nlctl.expressions.derivatives.tangents`
    solutions: Mapping[str, Sequence[Expr]]
    inputs: int = 0  # number of the diagram's inputs
    products: bool = False  # whether relays may multiply each other, see `together`
    behind: int = 0  # place, among the program's inputs, from which on their rates follow


@dataclass(frozen=True, kw_only=True)
class SlidingRate:
    """Drift a and gain b of the rate u' = a + b v of a relay's input, and the relay's output v."""

    # of a rate in several pieces those of the straight line through both ends, v = +-height
    drift: Expr
    gain: Expr
    output: Expr


def sliding_rates(
    graph: Graph,
    relays: Sequence[SlidingInput],
    motion: Motion,
    output: Callable[[int, tuple[Expr, Expr, Expr]], Expr],
) -> list[SlidingRate]:
    """Return a and b of every relay's u' = a + b v, and its output."""
    rates = [_rate(graph, relay, motion) for relay in relays]
    leaves = [relay.leaf for relay in relays]
    read = [set(leaves).intersection(needed([rate.whole])) for rate in rates]
    solved: dict[int, SlidingRate] = {}
    while len(solved) < len(relays):
        outputs = {leaves[i]: one.output for i, one in solved.items()}
        left = [i for i in range(len(relays)) if i not in solved]
        ready = [i for i in left if read[i] <= {leaves[i], *outputs}]
        lines = {i: [*rates[i].line, *rates[i].piece] for i in ready}
        if not ready:
            wholes = replaced_parts(graph, [rates[i].whole for i in left], outputs)
            lines = _together(graph, dict(zip(left, wholes, strict=True)), relays, motion, output)
        for i, line in lines.items():
            drift, gain, *here = replaced_parts(graph, line, outputs)
            v = output(i, (relays[i].given, here[0], here[1]))
            solved[i] = SlidingRate(drift=drift, gain=gain, output=v)
    return [solved[i] for i in range(len(relays))]


def _together(
    graph: Graph,
    rates: Mapping[int, Expr],
    relays: Sequence[SlidingInput],
    motion: Motion,
    output: Callable[[int, tuple[Expr, Expr, Expr]], Expr],
) -> dict[int, list[Expr]]:
    """Return a and b, twice, of relays that act on each other's rates."""
    op, zero, one = graph.op, graph.const(0.0), graph.const(1.0)
    coupled = [
        Coupled(
            leaf=relays[i].leaf, rate=rate, slides=op("eq", relays[i].kept, zero),
            held=output(i, (relays[i].given, zero, one)),
            decays=op("mul", relays[i].limits.rate, relays[i].given),
        )
        for i, rate in rates.items()
    ]  # fmt: skip
    slopes = partial(slope_of, graph, solutions=motion.solutions)
    own = own_rates(graph, coupled, slopes, motion.products)
    if own is None:
        names = ", ".join(f"'{relays[i].name}'" for i in rates)
        raise CompileError(
            f"the ideal relays {names} act on the rates of each other's inputs, and not as a + B v "
            f"that can be read off: what slides where several inputs are 0 has no one answer; of "
            f"one {_SMOOTH}"
        )
    return {i: [*line, *line] for i, line in zip(rates, own, strict=True)}


@dataclass(frozen=True, kw_only=True)
class _Rate:
    """u' of a relay; a and b of it between its ends, and where it vanishes."""

    whole: Expr
    line: Sequence[Expr]
    piece: Sequence[Expr]


def _along(graph: Graph, motion: Motion) -> Callable[[Expr], Expr | None]:
    """Return what gives the derivatives of what is read, along the motion of the diagram."""
    states = graph.joined([(rate, 1) for rate in motion.rates]) if motion.rates else None

    def along(leaf: Expr) -> Expr | None:
        array, start, step = leaf.data
        if array == "t":
            return graph.const(1.0)
        if array == "u":
            if start >= motion.inputs:
                return None  # a rate, which is constant between the times of a run
            where = (array, motion.behind + start, step)
            return graph.node("leaf", data=where, size=leaf.size, varies=True)
        if array != "x" or states is None:
            return None
        if leaf.size is None:
            return motion.rates[start]
        return graph.part(states, start, step, leaf.size)

    return along


def _rate(graph: Graph, relay: SlidingInput, motion: Motion) -> _Rate:
    """Return u' of a relay as a function of its output."""
    who = f"the ideal relay '{relay.name}'"
    _check_input(who, relay, motion)
    try:
        (rate,) = tangents(graph, [relay.given], _along(graph, motion), motion.solutions)
        rate = rate or graph.const(0.0)
        found = _read(graph, who, relay, rate, motion)
    except Untraceable as error:
        raise CompileError(f"the input of {who} has no rate: {error}; {_SMOOTH}") from None
    return found


def _read(graph: Graph, who: str, relay: SlidingInput, rate: Expr, motion: Motion) -> _Rate:
    """Return u' as a + b v, or in such pieces, read off an expression."""
    if any(e.op == "solve" and _reads(e, OUTPUTS) for e in needed([rate])):
        raise CompileError(
            f"the input of {who} has a rate in which the output of an ideal relay is in an "
            f"algebraic loop: put a state into the loop, or {_SMOOTH}"
        )
    slope = slope_of(graph, relay.leaf, motion.solutions)
    gain = slope(rate) or graph.const(0.0)  # what is called unchanged has none: refused
    acts = gain.op != "const" or gain.data != 0.0
    beyond = None if acts else _second(graph, relay, rate, motion, slope)
    if beyond is not None:
        line, piece = beyond
        whole = graph.joined([(e, 1) for e in (*line, *piece)])
        return _Rate(whole=whole, line=line, piece=piece)
    if affine(rate, relay.leaf):
        (drift,) = replaced_parts(graph, [rate], {relay.leaf: graph.const(0.0)})
        return _Rate(whole=rate, line=(drift, gain), piece=(drift, gain))
    why = unreadable(graph, rate, relay.leaf, slope)
    if why:
        raise CompileError(
            f"the output v of {who} does not enter the rate u' of its input as a + b v that can be "
            f"read off, nor in such pieces (min, max, clip, abs) that u' only falls or only rises "
            f"with v, but {why}: what slides depends on how the jump is made; {_SMOOTH}"
        )
    breaks = bend_places(graph, rate, relay.leaf, slope)
    line, piece = zero_between(graph, rate, relay.leaf, relay.limits.height, breaks)
    return _Rate(whole=rate, line=line, piece=piece)


def _second(
    graph: Graph, relay: SlidingInput, rate: Expr, motion: Motion, slope: LeafDerivative
) -> tuple[tuple[Expr, Expr], tuple[Expr, Expr]] | None:
    """Return the second-order sliding of one relay alone, without what nobody knows the rate of."""
    (rate,) = replaced_parts(graph, [rate], {relay.leaf: graph.const(0.0)})
    found = second_order(
        graph, relay.given, rate, relay.leaf, relay.limits, _along(graph, motion), slope
    )
    if found is None:
        return None
    parts = needed([part for pair in found for part in pair])
    known = not any(
        (e.op == "leaf" and e.data[0] == OUTPUTS)
        or e.op in ("call", "solve")
        or (_is_delayed(e, motion.inputs) and e.data[1] < motion.behind)
        for e in parts
    )
    return found if known else None


def _check_input(who: str, relay: SlidingInput, motion: Motion) -> None:
    """Refuse a relay's input that jumps, or whose rate nobody knows."""
    parts = needed([relay.given])
    for call in (e for e in parts if e.op == "call"):
        raise CompileError(
            f"the input of {who} has no rate: {call.data[0]} is called unchanged, and has no "
            f"derivative; {_SMOOTH}"
        )
    if _reads(relay.given, OUTPUTS):
        raise CompileError(
            f"the input of {who} depends on the output of an ideal relay at the same instant, and "
            f"jumps with it: put a state between them, or {_SMOOTH}"
        )
    if any(_is_delayed(e, motion.inputs) for e in needed([relay.given])):
        raise CompileError(
            f"the input of {who} depends on a delayed signal at the same instant, whose rate is "
            f"not known: put a lag before it, or {_SMOOTH}"
        )


def _is_delayed(leaf: Expr, inputs: int) -> bool:
    """Whether a leaf has what leaves a transport delay, among the program's inputs."""
    if leaf.op != "leaf" or leaf.data[0] != "u":
        return False
    _, start, step = leaf.data
    return start + step * ((leaf.size or 1) - 1) >= inputs


def _reads(expr: Expr, array: str) -> bool:
    return any(e.op == "leaf" and e.data[0] == array for e in needed([expr]))
