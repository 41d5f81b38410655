"""Reads the blocks of a schedule as expressions: traced, wired, loops solved, the opaque called."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import control as ct
import numpy as np

from ...errors import CompileError
from ...expressions.arrays import Tracer, as_array, concatenated, full, leaf_vector, scalar, traced
from ...expressions.graph import SMALL, Ambiguous, Expr, Graph, Untraceable, needed
from ...expressions.operators import elementwise
from ...expressions.stage import Stage
from ...expressions.trace import trace
from ...sampling.system import Happening, Sampled, oldest, rounded
from ...wording import counted
from ..codegen.newton import inside, solver
from ..codegen.solver import Solver
from ..diagram.checks import refused_block
from ..diagram.nodes import Node
from ..diagram.program import check_continuous, count_guards, count_switching_functions, memory
from ..diagram.schedule import AlgebraicLoop, Combination, Schedule, Signal, signal_name
from ..diagram.trace import feedthrough, time, traced_parameters
from ..opaque.called import Call, call_of
from ..purity.registers import unfollowed

BEYOND = "a loop in it takes more passes than are written out"


def _labels(blocks: Sequence[Node]) -> list[str]:
    """Return what names begin with; numbers are added unless all are different."""
    clean = [re.sub(r"\W|^(?=\d)", "_", node.path) for node in blocks]
    same = len(set(clean)) < len(clean)
    return [f"{name}_{i}" for i, name in enumerate(clean)] if same else clean


@dataclass(kw_only=True)
class Reader:
    """Reads blocks one after the other."""

    graph: Graph
    layout: Any
    blocks: Sequence[Node]
    # values of integer parameters; None for those that the blocks have now
    p: np.ndarray | None = None
    # outputs of the blocks that have been read
    signals: dict[int, Tracer] = field(default_factory=dict)
    # what stands for signals that are being solved for
    guesses: dict[Signal, Tracer] = field(default_factory=dict)
    solved: list[Tracer] = field(default_factory=list)  # signals that have been
    # by name
    calls: dict[str, Call] = field(default_factory=dict)
    solvers: dict[str, Solver] = field(default_factory=dict)
    fixed_points: dict[str, list[Expr]] = field(default_factory=dict)
    # places and kinds of functions in which a loop may take more passes than are written out
    cut: set[tuple[int, str]] = field(default_factory=set)
    what: Happening = frozenset()  # what happens to sampled blocks
    # where in the layout the parameters of a sampling are, by its identity
    samplings: Mapping[int, int] = field(default_factory=dict)
    # outputs of blocks that these alone cannot compute: of transport delays, further inputs of the
    # program; of ideal relays, what follows from the rates of the diagram
    supplied: Mapping[int, Tracer] = field(default_factory=dict)
    # a and b of the rates u' = a + b v of the inputs of ideal relays
    moving: Mapping[int, Tracer] = field(default_factory=dict)

    def read(self, schedule: Schedule) -> None:
        """Read all blocks in their order, and solve the loops."""
        at = 0
        for loop in schedule.loops:
            self.evaluate(schedule, range(at, loop.start))
            self.solve(schedule, loop)
            at = loop.stop
        self.evaluate(schedule, range(at, len(schedule.order)))

    def all_known(self, results: dict[str, Any]) -> dict[str, Any]:
        """Return results that are NaN where a loop was not solved."""
        if not self.solved:
            return results
        return {k: [(row, self.known(a)) for row, a in v] for k, v in results.items()}

    def evaluate(self, schedule: Schedule, places: range) -> None:
        """Read the outputs of blocks at some places of the order."""
        for place in places:
            i = schedule.order[place]
            self.signals[i] = self.outputs(i, schedule.unknown[place])

    def solve(self, schedule: Schedule, loop: AlgebraicLoop) -> None:
        """Read the blocks of a loop: with guesses, and then with what these are solved for."""
        name, places = f"loop{len(self.solvers)}", range(loop.start, loop.stop)
        leaves = [self.graph.leaf(name, k, None) for k in range(len(loop.torn))]
        self._guessed(schedule, places, loop.torn, [scalar(self.graph, leaf) for leaf in leaves])
        values = self._made(loop.torn)
        try:
            search, given = solver(name, leaves, values)
        except Untraceable as error:
            names = ", ".join(signal_name(self.blocks, signal) for signal in loop.torn)
            why = _opaque(leaves, values, self.calls) or str(error)
            raise CompileError(
                f"the algebraic loop through {names} cannot be solved: {why}; put a state into it"
            ) from error
        self.solvers[name] = search
        pieces = [vector_of(self.graph, expr) for expr in given]
        results = _results(self.graph, "solve", name, pieces, search.count)
        self.solved.append(results)
        self._guessed(schedule, places, loop.torn, [results[k] for k in range(search.count)])
        self.fixed_points[name] = self._made(loop.torn)

    def _made(self, torn: Sequence[Signal]) -> list[Expr]:
        """Return what the blocks have made of signals that were guessed."""
        return [self.taken(signal, 1).reshape(-1)[0].only for signal in torn]

    def _guessed(
        self, schedule: Schedule, places: range, torn: Sequence[Signal], values: Sequence[Tracer]
    ) -> None:
        self.guesses = dict(zip(torn, values, strict=True))
        self.evaluate(schedule, places)
        self.guesses = {}

    def known(self, array: Tracer) -> Tracer:
        """Return an array, NaN where a loop was not solved: blocks may turn NaN into numbers."""
        pairs = [elementwise(self.graph, "eq", z, z) for signals in self.solved for z in signals]
        is_known = reduce(lambda a, b: elementwise(self.graph, "and", a, b), pairs)
        return elementwise(self.graph, "select", is_known, array, np.nan) if array.size else array

    def taken(self, signal: Signal, count: int) -> Tracer:
        """Return a block's output, or several from that on; of those that are guessed the guess."""
        signals = [Signal(signal.block, signal.index + k) for k in range(count)]
        if not any(s in self.guesses for s in signals):
            return self.signals[signal.block or 0][signal.index : signal.index + count]
        parts = [
            self.guesses[s] if s in self.guesses else self.signals[s.block or 0][s.index]
            for s in signals
        ]
        return concatenated(self.graph, [part.reshape(1) for part in parts])

    def outputs(self, i: int, unknown: Collection[int]) -> Tracer:
        """Return a block's outputs; those that depend on unknown inputs are asked for again."""
        node = self.blocks[i]
        if node.sampled and not node.sampled.answers(self.what):
            _, _, held = node.sampled.parts(self._every_state(i))
            return self._due(i) if node.sampled.releases(self.what) else held
        if node.sampled:
            return self._converted(node.sampled, self._own_outputs(i, unknown), 1)
        return self._own_outputs(i, unknown)

    def _own_outputs(self, i: int, unknown: Collection[int]) -> Tracer:
        node, system = self.blocks[i], self.blocks[i].system
        if i in self.supplied:
            return self.supplied[i]
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
        if node.sampled:
            inputs = self._converted(node.sampled, inputs, 0)
        if linear:
            return self._linear(node, system.C, system.D, inputs)
        return self._function(i, "output", [system.outfcn], inputs, system.noutputs)

    def relay_output(self, i: int, known: Tracer) -> Tracer:
        """Return the output of an ideal relay whose input, and a and b of its rate, are known."""
        return self._function(i, "output", [self.blocks[i].system.outfcn], known, 1)

    def derivatives(self, i: int) -> Tracer:
        """Return the derivatives of a block's states; those of sampled ones stand still."""
        if self.blocks[i].sampled:
            return full(self.graph, self.blocks[i].size, 0.0)
        return self._own_states(i)

    def next_states(self, i: int) -> Tracer:
        """Return the states of a sampled block after what happens."""
        sampled: Any = self.blocks[i].sampled

        def computed() -> tuple[Tracer, Tracer]:
            direct = replace(self.blocks[i], direct=feedthrough(self.blocks[i].system))
            reader = replace(self, blocks=[*self.blocks[:i], direct, *self.blocks[i + 1 :]])
            following = self._own_states(i)
            if sampled.euler:
                state, _, _ = sampled.parts(self._every_state(i))
                following = state + self._sampling(sampled).dt * following
            return following, self._converted(sampled, reader._own_outputs(i, ()), 1)

        parts = sampled.after(self.what, self._every_state(i), self._due(i), computed)
        return concatenated(self.graph, parts)

    def _sampling(self, sampled: Sampled) -> Any:
        """Return the parameters of a block's sampling."""
        slots = self.layout[self.samplings[id(sampled.sampling)]]
        return traced_parameters(self.graph, sampled.sampling, slots, self.p)

    def _due(self, i: int) -> Tracer:
        """Return the outputs of a sampled block that follow if any do."""
        sampled: Any = self.blocks[i].sampled
        function = Stage(self.graph).copied(oldest)
        return sampled.oldest(function, self._every_state(i), self._sampling(sampled))

    def _converted(self, sampled: Sampled, values: Tracer, which: int) -> Tracer:
        """Return what the converter of inputs (0) or outputs (1) makes of values."""
        function = Stage(self.graph).copied(rounded)
        return sampled.converted(function, values, self._sampling(sampled), which)

    def _every_state(self, i: int) -> Tracer:
        """Return a sampled block's own states, and behind them what waits and is held."""
        node = self.blocks[i]
        return leaf_vector(self.graph, "x", node.state_offset, (node.size,))

    def _own_states(self, i: int) -> Tracer:
        node, system = self.blocks[i], self.blocks[i].system
        if not system.nstates:
            return self._states(node)
        inputs = self.wired(node.inputs)
        if node.sampled:
            inputs = self._converted(node.sampled, inputs, 0)
        if isinstance(system, ct.StateSpace):
            return self._linear(node, system.A, system.B, inputs)
        return self._function(i, "update", [system.updfcn], inputs, system.nstates)

    def events(self, i: int, given: Tracer | None = None) -> Tracer:
        """Return what a block declares, and what its memories become; of what it may be given."""
        node, spec = self.blocks[i], self.blocks[i].system.spec
        used = [("switching", count_switching_functions(node)), ("commit", len(memory(node)))]
        functions = [getattr(spec, name) for name, count in used if count]
        if node.slide is not None and given is None:  # it follows from all others
            return full(self.graph, sum(count for _, count in used), 0.0)
        inputs = self.wired(node.inputs) if given is None else given
        if i in self.moving:
            inputs = concatenated(self.graph, [inputs, self.moving[i]])
        values = self._function(i, "events", functions, inputs, sum(count for _, count in used))
        if not used[0][1]:
            check_continuous(node, values, inputs)
        return values

    def guards(self, i: int) -> Tracer:
        """Return the guards of a block."""
        node = self.blocks[i]
        given = [node.system.spec.guard], self.wired(node.inputs), count_guards(node)
        return self._function(i, "guard", *given)

    def resets(self, i: int) -> Tracer:
        """Return the states of a block with guards after a jump."""
        node = self.blocks[i]
        given = [node.system.spec.reset], self.wired(node.inputs), node.size
        return self._function(i, "reset", *given)

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
                part = leaf_vector(self.graph, "u", signal.index, (count,))
            else:
                part = self.taken(signal, count)
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
        return leaf_vector(self.graph, "x", node.state_offset, (node.system.nstates or 0,))

    def _function(
        self, i: int, kind: str, functions: list[Any], inputs: Tracer, count: int
    ) -> Tracer:
        """Return the results of a block's functions, traced if possible."""
        node = self.blocks[i]
        if kind in node.called:
            return self._called(i, kind, functions, inputs, count, BEYOND)

        def arguments() -> tuple[Any, ...]:
            given = traced_parameters(self.graph, node.system, self.layout[i], self.p)
            return time(self.graph), self._states(node), inputs.copy(), given

        self.graph.is_cut = False
        try:
            parts = [trace(self.graph, f, arguments, node.registers) for f in functions]
            result = concatenated(self.graph, parts)
            if result.size != count:
                raise Untraceable(f"it returns {counted(result.size, 'value')}, not {count}")
        except Untraceable as error:
            return self._called(i, kind, functions, inputs, count, str(error))
        except Ambiguous as error:
            raise CompileError(
                f"block '{node.path}' cannot be compiled: its {kind} function {error}; "
                "the diagram still runs in python-control"
            ) from None
        if self.graph.is_cut:
            self.cut.add((i, kind))
        return result

    def _called(
        self, i: int, kind: str, functions: list[Any], inputs: Tracer, count: int, reason: str
    ) -> Tracer:
        """Return the results of an opaque call."""
        node, slots = self.blocks[i], self.layout[i]
        if node.registers:
            raise refused_block(node.path, kind, unfollowed(node.registers, reason))
        name = f"{_labels(self.blocks)[i]}_{kind}_of_one"
        if name not in self.calls:
            self.calls[name] = call_of(name, node, kind, functions, slots, count, reason)
        size = sum(s.size for s in slots.values())
        start = min((s.offset for s in slots.values()), default=0)
        given = [
            time(self.graph).reshape(1),
            self._states(node),
            inputs,
            leaf_vector(self.graph, "p", start, (size,)),
        ]
        return _results(self.graph, "call", name, given, count)


def _opaque(guesses: Sequence[Expr], results: Sequence[Expr], calls: Mapping[str, Call]) -> str:
    """Return which opaque functions are in a loop, in words; nothing if there are none."""
    nodes = inside(needed(results), guesses)
    names = [n.data[0] for n in sorted(nodes, key=lambda n: n.index) if n.op == "call"]
    used = [calls[name] for name in dict.fromkeys(names)]
    return ", ".join(
        f"the {call.kind} function of block '{call.block}' is called unchanged ({call.reason}) "
        "and has no derivatives"
        for call in used
    )


def _is_next(one: Combination | None, other: Combination | None) -> bool:
    """Whether a combination is another one, of the signals after those."""
    if one is None or other is None:
        return one is other
    shifted = {Signal(s.block, s.index + 1): gain for s, gain in one.items()}
    return bool(one) and shifted == other


def _results(graph: Graph, op: str, name: str, given: Sequence[Tracer], count: int) -> Tracer:
    """Return what a call or a search with these arguments results in."""
    pieces = [piece for g in given for piece in g.pieces()]
    args, sizes = [e for e, _ in pieces], tuple(n for _, n in pieces)
    if not count:
        return traced(graph, 0.0).reshape(1)[:0]
    node = graph.node(op, *args, data=(name, sizes), size=count, varies=True)
    if count > SMALL:
        return vector_of(graph, node)
    return concatenated(graph, [vector_of(graph, graph.item(node, k)) for k in range(count)])


def vector_of(graph: Graph, expr: Expr) -> Tracer:
    """Return a vector, or a number as one of a single entry."""
    if expr.size:
        return Tracer(graph, as_array(expr), 0, expr.size)
    return scalar(graph, expr).reshape(1)
