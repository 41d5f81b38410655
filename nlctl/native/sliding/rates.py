"""The rate that a diagram gives the input of an ideal relay, as a function of the relay's output.

The relay's output v is a leaf, read as if it came from outside.  Along x' the relay's input has the
derivative u' = a + b v, where b is its derivative by v, and a its value at v = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ...errors import CompileError
from ...expressions.derivatives import tangents
from ...expressions.graph import Expr, Graph, Untraceable, needed

OUTPUTS = "relays"  # the array of leaves that stand for the relays' outputs
_LINEAR = ("add", "sub", "neg", "sum", "item", "slice", "concat")
_SMOOTH = "smooth the jump over a small width, or give it hysteresis (nlctl.Relay)"


@dataclass(frozen=True, kw_only=True)
class SlidingInput:
    """The input of an ideal relay of a diagram.

    Attributes
    ----------
    name : str
        Of the relay's block.
    leaf : Expr
        What stands for the relay's output.
    given : Expr
        The input, an expression.
    """

    name: str
    leaf: Expr
    given: Expr


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How a diagram moves within a step.

    Attributes
    ----------
    rates : sequence of Expr
        The derivative of each state; of memories 0.
    solutions : mapping
        As `fixed_points` of `nlctl.expressions.derivatives.tangents`.
    inputs : int
        Number of the diagram's inputs.
    behind : int
        Place, among the program's inputs, from which on their rates follow.
    """

    rates: Sequence[Expr]
    solutions: Mapping[str, Sequence[Expr]]
    inputs: int = 0
    behind: int = 0


@dataclass(frozen=True, kw_only=True)
class SlidingRate:
    """Drift a and gain b of the rate u' = a + b v of a relay's input, and the relay's output v."""

    drift: Expr
    gain: Expr
    output: Expr


def sliding_rates(
    graph: Graph,
    relays: Sequence[SlidingInput],
    motion: Motion,
    output: Callable[[int, tuple[Expr, Expr, Expr]], Expr],
) -> list[SlidingRate]:
    """Return a and b of every relay's u' = a + b v, and its output.

    Parameters
    ----------
    graph : Graph
    relays : sequence of SlidingInput
    motion : Motion
    output : callable
        Takes the number of a relay and its u, a, b; returns its output.

    Raises
    ------
    CompileError
        If there is no such rate, or relays act on each other's.
    """
    rates = [_rate(graph, relay, motion) for relay in relays]
    leaves = [relay.leaf for relay in relays]
    read = [set(leaves).intersection(needed([rate])) for rate, _ in rates]
    made: dict[int, SlidingRate] = {}
    while len(made) < len(relays):
        known = {leaves[i]: one.output for i, one in made.items()}
        ready = [i for i in range(len(relays)) if i not in made and read[i] <= {leaves[i], *known}]
        if not ready:
            names = ", ".join(f"'{r.name}'" for i, r in enumerate(relays) if i not in made)
            raise CompileError(
                f"the ideal relays {names} act on the rates of each other's inputs: what slides "
                f"where both inputs are 0 has no one answer; of one {_SMOOTH}"
            )
        for i in ready:
            without = known | {leaves[i]: graph.const(0.0)}
            drift, gain = replaced_parts(graph, rates[i], without)
            v = output(i, (relays[i].given, drift, gain))
            made[i] = SlidingRate(drift=drift, gain=gain, output=v)
    return [made[i] for i in range(len(relays))]


def replaced_parts(graph: Graph, exprs: Sequence[Expr], instead: Mapping[Expr, Expr]) -> list[Expr]:
    """Return expressions with others in the places of some of their parts."""
    new: dict[Expr, Expr] = {}
    for node in needed(exprs, instead):
        args = tuple(new.get(a, a) for a in node.args)
        if node in instead:
            new[node] = instead[node]
        elif args != node.args:
            new[node] = graph.node(
                node.op, *args, data=node.data, size=node.size, kind=node.kind,
                varies=node.varies, value=node.value,
            )  # fmt: skip
    return [new.get(e, e) for e in exprs]


def _rate(graph: Graph, relay: SlidingInput, motion: Motion) -> tuple[Expr, Expr]:
    """Return u' of a relay, and its derivative by the relay's output."""
    who = f"the ideal relay '{relay.name}'"
    _check_input(who, relay, motion)
    states = graph.joined([(rate, 1) for rate in motion.rates]) if motion.rates else None

    def along(leaf: Expr) -> Expr | None:
        array, start, step = leaf.data
        if array == "t":
            return graph.const(1.0)
        if array == "u":
            where = (array, motion.behind + start, step)
            return graph.node("leaf", data=where, size=leaf.size, varies=True)
        if array != "x" or states is None:
            return None
        if leaf.size is None:
            return motion.rates[start]
        return graph.part(states, start, step, leaf.size)

    try:
        (rate,) = tangents(graph, [relay.given], along, motion.solutions)
        rate = rate or graph.const(0.0)
        (gain,) = tangents(
            graph, [rate], lambda leaf: graph.const(1.0) if leaf is relay.leaf else None,
            motion.solutions,
        )  # fmt: skip
    except Untraceable as error:
        raise CompileError(f"the input of {who} has no rate: {error}; {_SMOOTH}") from None
    if any(e.op == "solve" and _reads(e, OUTPUTS) for e in needed([rate])):
        raise CompileError(
            f"the input of {who} has a rate in which the output of an ideal relay is in an "
            f"algebraic loop: put a state into the loop, or {_SMOOTH}"
        )
    if not _is_affine(rate, relay.leaf):
        raise CompileError(
            f"the output v of {who} does not enter the rate u' of its input as a + b v that can be "
            f"read off: what slides depends on how the jump is made; {_SMOOTH}"
        )
    return rate, gain or graph.const(0.0)


def _is_affine(expr: Expr, leaf: Expr) -> bool:
    """Whether an expression is a + b v for all values, as it is written."""
    depends: set[Expr] = {leaf}
    for node in needed([expr]):
        by = [arg in depends for arg in node.args]
        if not any(by):
            continue
        linear = (
            node.op in _LINEAR
            or (node.op == "mul" and sum(by) == 1)
            or (node.op == "div" and not by[1])
            or (node.op == "select" and not by[0])
        )
        if not linear:
            return False
        depends.add(node)
    return True


def _check_input(who: str, relay: SlidingInput, motion: Motion) -> None:
    """Refuse a relay's input that jumps, or whose rate nobody knows."""
    parts = needed([relay.given])
    for call in (e for e in parts if e.op == "call"):
        raise CompileError(
            f"the input of {who} has no rate: {call.data[0]} is called as it stands, and has no "
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
