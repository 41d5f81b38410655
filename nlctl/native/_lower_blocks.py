"""A schedule as expressions: blocks traced, wired, and what cannot be traced called."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import control as ct
import numpy as np

from .._errors import CompileError
from ..expressions.arrays import Tracer, boxed, concatenated, full, number, traced, vector
from ..expressions.graph import SMALL, Ambiguous, Graph, Untraceable
from ..expressions.operators import elementwise
from ..expressions.trace import trace
from ._code import Code, code
from ._emit import Program
from ._parameters import length
from ._schedule import Combination, Node, Schedule, Signal
from ._trace_block import parameters, time
from .codegen.calls import Call


@dataclass(frozen=True, kw_only=True)
class Equations:
    """What a diagram computes.

    Attributes
    ----------
    graph : Graph
    results : dict
        For ``"dx"``, ``"g"`` and ``"y"`` pairs of a row and the array that is to be written there.
    calls : dict
        Opaque functions by name.
    before : str
        Source that these need.
    """

    graph: Graph
    results: dict[str, list[tuple[int, Tracer]]]
    calls: dict[str, Call]
    before: str = ""


def equations(schedule: Schedule, layout: Any) -> Equations:
    """Write a schedule as expressions.

    Parameters
    ----------
    schedule : Schedule
    layout : mapping
        Places of the parameters, as in `Program.layout`.

    Returns
    -------
    Equations
    """
    system = schedule.system
    sizes = {"t": 1, "x": system.nstates or 0, "u": system.ninputs or 0, "p": length(layout)}
    reader = Reader(graph=Graph(sizes), layout=layout, blocks=schedule.nodes)
    with np.errstate(all="ignore"):  # NumPy would warn of NaN that inputs have that are not known
        for i, unknown in zip(schedule.order, schedule.unknown, strict=True):
            reader.signals[i] = reader.outputs(i, unknown)
        results = {
            "dx": [(n.state_offset, reader.derivatives(i)) for i, n in enumerate(schedule.nodes)],
            "g": _events(reader),
            "y": [(0, reader.wired(schedule.outputs))],
        }
    return Equations(graph=reader.graph, results=results, calls=reader.calls)


def whole(schedule: Schedule, program: Program) -> Equations:
    """Return a program that is called as it stands: what cannot be written out as a whole.

    Parameters
    ----------
    schedule : Schedule
    program : Program
    """
    system = schedule.system
    n, size = system.nstates or 0, length(program.layout)
    graph = Graph({"t": 1, "x": n, "u": system.ninputs or 0, "p": size})
    given = [
        time(graph).reshape(1),
        *(vector(graph, name, 0, (graph.lengths[name],)) for name in "xup"),
    ]
    why = "it has algebraic loops to be solved" if schedule.loops else "an integer has changed"
    calls = {}
    found = []
    for name, count, line in (
        ("rhs", n + program.events, f"program_rhs(t, x, u, p, y[:{n}], y[{n}:])"),
        ("out", len(schedule.outputs), "program_out(t, x, u, p, y)"),
    ):
        lengths = (*(g.size for g in given), count)
        call = Call(name=f"{name}_of_one", lines=(line,), lengths=lengths, reason=why)
        if count:
            calls[call.name] = call
        found.append(_results(graph, call, given))
    dx, y = found
    source = program.source.replace("def rhs(", "@equation\ndef program_rhs(")
    return Equations(
        graph=graph,
        results={"dx": [(0, dx[:n])], "g": [(0, dx[n:])], "y": [(0, y)]},
        calls=calls,
        before=source.replace("def out(", "@equation\ndef program_out("),
    )


def _results(graph: Graph, call: Call, given: Sequence[Tracer]) -> Tracer:
    """Return what a call with these arguments results in."""
    count = call.lengths[-1]
    pieces = [piece for g in given for piece in g.pieces()]
    args, sizes = [e for e, _ in pieces], tuple(n for _, n in pieces)
    if not count:
        return concatenated(graph, [given[0][:0]])
    node = graph.node("call", *args, data=(call.name, sizes), size=count, varies=True)
    if count > SMALL:
        return Tracer(graph, boxed(node), 0, count)
    items = [number(graph, graph.item(node, k)).reshape(1) for k in range(count)]
    return concatenated(graph, items)


def _events(reader: Reader) -> list[tuple[int, Tracer]]:
    """Return switching functions of all blocks, then what memories are committed to."""
    blocks = [reader.code(i) for i in range(len(reader.blocks))]
    corner, memory, found = 0, sum(own.corners for own in blocks), []
    for i, own in enumerate(blocks):
        if own.corners or own.memory:
            events = reader.events(i)
            found += [(corner, events[: own.corners]), (memory, events[own.corners :])]
            corner, memory = corner + own.corners, memory + len(own.memory)
    return found


@dataclass(kw_only=True)
class Reader:
    """Reads blocks one after the other; `signals` are the outputs of those that have been read."""

    graph: Graph
    layout: Any
    blocks: Sequence[Node]
    signals: dict[int, Tracer] = field(default_factory=dict)
    calls: dict[str, Call] = field(default_factory=dict)

    def code(self, i: int) -> Code:
        return code(i, self.blocks[i], self.layout[i])

    def outputs(self, i: int, unknown: Collection[int]) -> Tracer:
        """Return a block's outputs; those that depend on unknown inputs are asked for again."""
        node, system = self.blocks[i], self.blocks[i].system
        linear = isinstance(system, ct.StateSpace)
        if not linear and (system.outfcn is None or not system.noutputs):
            return self._states(node)[: system.noutputs or 0]
        direct = [bool(column.any()) for column in node.direct.T]
        missing = [not (d if linear else any(direct)) for d in direct]
        inputs = self.wired(
            [
                None if j in unknown or missing[j] else combination
                for j, combination in enumerate(node.inputs)
            ]
        )
        if linear:
            return self._linear(node, system.C, system.D, inputs)
        return self._function(i, "output", [system.outfcn], inputs, system.noutputs)

    def derivatives(self, i: int) -> Tracer:
        node, system = self.blocks[i], self.blocks[i].system
        if not system.nstates:
            return self._states(node)
        inputs = self.wired(node.inputs)
        if isinstance(system, ct.StateSpace):
            return self._linear(node, system.A, system.B, inputs)
        return self._function(i, "update", [system.updfcn], inputs, system.nstates)

    def events(self, i: int) -> Tracer:
        own, spec = self.code(i), self.blocks[i].system.spec
        used = [("corners", own.corners), ("commit", len(own.memory))]
        functions = [getattr(spec, name) for name, count in used if count]
        inputs = self.wired(self.blocks[i].inputs)
        return self._function(i, "events", functions, inputs, own.corners + len(own.memory))

    def wired(self, combinations: Sequence[Combination | None]) -> Tracer:
        """Return linear combinations of signals, NaN for None; neighbours become vectors."""
        parts, at = [traced(self.graph, 0.0).reshape(1)[:0]], 0
        while at < len(combinations):
            end = at + 1
            while end < len(combinations) and _is_next(combinations[end - 1], combinations[end]):
                end += 1
            parts.append(self._combined(combinations[at], end - at))
            at = end
        return concatenated(self.graph, parts)

    def _combined(self, combination: Combination | None, count: int) -> Tracer:
        if combination is None:
            return full(self.graph, count, np.nan)
        total = full(self.graph, count, 0.0)
        for signal, gain in combination.items():
            if signal.block is None:
                part = vector(self.graph, "u", signal.index, (count,))
            else:
                part = self.signals[signal.block][signal.index : signal.index + count]
            if gain != -1.0:
                part = elementwise(self.graph, "mul", gain, part)
            total = elementwise(self.graph, "sub" if gain == -1.0 else "add", total, part)
        return total

    def _linear(self, node: Node, on_state: Any, on_input: Any, inputs: Tracer) -> Tracer:
        """Return the products with a system's matrices, without their zeros."""
        x, rows = self._states(node), []
        for i in range(on_state.shape[0]):
            terms = [(on_state[i, j], x[j]) for j in np.flatnonzero(on_state[i])]
            terms += [(on_input[i, j], inputs[j]) for j in np.flatnonzero(on_input[i])]
            row = traced(self.graph, 0.0)
            for factor, value in terms:
                term = elementwise(self.graph, "mul", float(factor), value)
                row = elementwise(self.graph, "add", row, term)
            rows.append(row.reshape(1))
        return concatenated(self.graph, rows) if rows else x[:0]

    def _states(self, node: Node) -> Tracer:
        return vector(self.graph, "x", node.state_offset, (node.system.nstates or 0,))

    def _function(
        self, i: int, kind: str, functions: list[Any], inputs: Tracer, count: int
    ) -> Tracer:
        """Return the results of a block's functions, traced if possible."""
        node = self.blocks[i]

        def arguments() -> tuple[Any, ...]:
            given = parameters(self.graph, node.system, self.layout[i])
            return time(self.graph), self._states(node), inputs.copy(), given

        try:
            parts = [trace(self.graph, function, arguments) for function in functions]
            found = concatenated(self.graph, parts)
            if found.size != count:
                raise Untraceable(f"it returns {found.size} values, not {count}")
        except Untraceable as error:
            return self._called(i, kind, inputs, count, str(error))
        except Ambiguous as error:
            raise CompileError(
                f"block '{node.path}' cannot be compiled: its {kind} function {error}; "
                "the diagram still runs in python-control"
            ) from None
        return found

    def _called(self, i: int, kind: str, inputs: Tracer, count: int, reason: str) -> Tracer:
        """Return the results of an opaque call."""
        node, slots = self.blocks[i], self.layout[i]
        if node.unbound:
            raise CompileError(
                f"block '{node.path}' cannot be compiled: its {kind} function reads "
                f"'{node.unbound[0]}', which has no value on one of the ways there: give it one "
                "before; the diagram still runs in python-control"
            )
        name = f"{self.code(i).name}_{kind}_of_one"
        size = sum(s.size for s in slots.values())
        start = min((s.offset for s in slots.values()), default=0)
        given = [
            time(self.graph).reshape(1),
            self._states(node),
            inputs,
            vector(self.graph, "p", start, (size,)),
        ]
        lengths = (*(g.size for g in given), count)
        lines = tuple(_lines_of_one(i, node, slots, start, kind, count))
        self.calls[name] = Call(name=name, lines=lines, lengths=lengths, reason=reason)
        return _results(self.graph, self.calls[name], given)


def _is_next(one: Combination | None, other: Combination | None) -> bool:
    """Whether a combination is another one, of the signals after those."""
    if one is None or other is None:
        return one is other
    shifted = {Signal(s.block, s.index + 1): gain for s, gain in one.items()}
    return bool(one) and shifted == other


def _lines_of_one(i: int, node: Node, slots: Any, start: int, kind: str, count: int) -> list[str]:
    """Return the source that evaluates one block alone, with its own t, x, u, p and y."""
    inputs = tuple({Signal(None, j): 1.0} for j in range(len(node.inputs)))
    alone = replace(node, state_offset=0, inputs=inputs)
    own = code(i, alone, {k: replace(s, offset=s.offset - start) for k, s in slots.items()})
    if kind == "output":
        body = [*own.output_lines(), *(f"y[{k}] = y{i}[{k}]" for k in range(count))]
    else:
        lines = (
            own.update_lines(ready=False) if kind == "update" else own.event_lines(0, own.corners)
        )
        target = "dx" if kind == "update" else "g"
        body = [f"{target} = y", *lines]
    return [*own.parameter_lines(), *body]
