"""What a diagram computes, in the parts that its derivatives are made of.

Choices that do not jump: both ways have the same value where the condition switches.

A dead zone that is written with `np.where` has kinks and no jumps.  What both ways are on the
condition is seen from values at random, with parameters near those of the run: what is the same
for all of these is the same.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial, reduce

import numpy as np

from ..blocks import supplied_of
from ..errors import CompileError
from ..expressions.arrays import Tracer
from ..expressions.bends import Bending, replaced_parts
from ..expressions.conditions import conditions, switching_function
from ..expressions.continuity import may_jump
from ..expressions.dependence import reads, rows_read
from ..expressions.evaluate import evaluate_expressions
from ..expressions.graph import Expr, Graph, Untraceable, needed
from ..expressions.trace import trace
from ..native import Compiled
from ..native.diagram.nodes import Node
from ..native.diagram.parameters import slots_of
from ..native.diagram.program import Program, count_switching_functions, memory
from ..native.diagram.trace import traced_arguments
from ..native.equations.blocks import Equations, equations
from ..native.jacobians import searches_of
from ..sliding.relay import SLIDING
from .branches import by_comparisons, jumping
from .directions import Direction, SomeRows, from_time, one_sided, rows_replaced, slopes, taken
from .schedule import Extended, Sent
from .steep import bent_roots, steep_levels, with_their_opposites, without_stills

_SHORT = 1e5  # times what of the times is passed at once: a bend of a steep root is as short


@dataclass(frozen=True, kw_only=True)
class EquationParts:
    """The equations of a diagram, row by row."""

    equations: Equations
    extended: Extended
    program: Program  # of the diagram itself
    inputs: int  # number of the diagram's inputs
    switching: list[Expr]  # switching functions that blocks declare
    guards: list[Expr]
    committed: list[Expr]  # what each memory would become
    switched: frozenset[int]  # states of memories that jump, and are not driven
    owners: tuple[int, ...]  # the block of each switching function
    # their rows, those of blocks with memories first, and how many these are: a step ends right
    # behind where a memory may jump
    ordered: tuple[int, ...]
    behind: int
    p: np.ndarray  # parameters near which the equations are evaluated

    @property
    def graph(self) -> Graph:
        """Where the expressions are kept."""
        return self.equations.graph

    def setting(self, name: str, k: int = 0) -> Expr:
        """Return a number that a run with derivatives is given, of several the k-th."""
        return self.graph.leaf("p", self.extended.slot(name).offset + k, None)

    def any_of(self, happen: Sequence[Expr]) -> Expr:
        """Return whether any of some things happens."""
        never = self.graph.const(False)
        return reduce(partial(self.graph.op, "or"), happen) if happen else never

    def first_time(self, place: int, happens: Expr) -> Expr:
        """Return when something has first happened, by its state; now at the latest if it does."""
        before, now = self.graph.leaf("x", place, None), self.graph.leaf("t", 0, None)
        return self.graph.op("select", happens, self.graph.op("minimum", before, now), before)

    @property
    def driven(self) -> dict[int, Expr]:
        """The next values of driven memories, by their states."""
        pairs = zip(self.program.memory, self.committed, strict=True)
        return {m: expr for m, expr in pairs if m not in self.switched}

    @cached_property
    def catching(self) -> dict[int, Expr]:
        """The next values of memories that catch a number where they switch, by their states."""
        # A relay's side is one of two constants, whatever is differentiated by; a fault that is
        # stuck at what a signal has been catches that.
        pairs = zip(self.program.memory, self.committed, strict=True)
        switching = {m: expr for m, expr in pairs if m in self.switched}
        return {
            m: self._behind_others(m, expr, switching)
            for m, expr in switching.items()
            if self._is_caught(expr)
        }

    def _behind_others(self, m: int, become: Expr, switching: Mapping[int, Expr]) -> Expr:
        """Return what a memory becomes by what those of other blocks have become."""
        nodes = self.extended.schedule.nodes
        (block,) = (n for n in nodes if n.state_offset <= m < n.state_offset + n.size)
        inside = range(block.state_offset, block.state_offset + block.size)
        others = {k: expr for k, expr in switching.items() if k not in inside}
        return self.with_states([become], others)[0]

    def _is_caught(self, expr: Expr) -> bool:
        """Return whether what a memory becomes moves with anything but memories."""
        graph, memories, of = self.graph, self.program.memory, self._everywhere

        def of_states(start: int, step: int, size: int | None) -> Expr | None:
            rows = [start + step * i for i in range(size or 1)]
            parts = [(graph.const(float(row not in memories)), 1) for row in rows]
            return graph.joined(parts) if size else parts[0][0] if rows[0] not in memories else None

        every = Direction(of={"t": of, "u": of, "p": of, "x": of_states})
        return self.slopes([expr], every)[0] is not None

    def _everywhere(self, start: int, step: int, size: int | None) -> Expr:
        """Return a direction in which all numbers go."""
        one = self.graph.const(1.0)
        return self.graph.joined([(one, 1)] * size) if size else one

    @cached_property
    def flow(self) -> list[SomeRows]:
        """The derivatives of the states, with steep roots bent so that these have derivatives."""
        graph, way = self.graph, self.time(self.exact_flow, delays_move=False)
        exprs, short = self._exact, graph.op("mul", graph.const(_SHORT), self.setting("rounding"))
        steep = steep_levels(graph, exprs, self._levels(jumping(exprs)))
        rates = self.changes([*steep.values()], way)
        bent = {**bent_roots(graph, steep, rates, short), **{e: e for e in jumping(exprs)}}
        if not steep:
            return self.exact_flow
        exprs = replaced_parts(graph, exprs, bent)
        return [(e, size) for e, (_, size) in zip(exprs, self.exact_flow, strict=True)]

    @property
    def _exact(self) -> list[Expr]:
        return [e for e, _ in self.exact_flow]

    @cached_property
    def _turning_roots(self) -> set[Expr]:
        """What jumps where a steep root is 0, as the sign of what flows out does."""
        steep = steep_levels(self.graph, self._exact, self._levels(jumping(self._exact)))
        levels = with_their_opposites(self.graph, steep.values())
        flow = without_stills(self.graph, [e for e, _ in self.flow], self.graph.const(0.0))
        return {e for e in jumping(flow) if switching_function(self.graph, e) in levels}

    @cached_property
    def exact_flow(self) -> list[SomeRows]:
        """The derivatives of the states; memories stand still."""
        still = dict.fromkeys(self.program.memory, self.graph.const(0.0))
        return rows_replaced(self.graph, self.equations.pieces("dx"), still)

    @cached_property
    def arriving(self) -> list[SomeRows]:
        """What arrives at the delays."""
        pieces = _behind(self.graph, self.equations.pieces("y"), len(self.extended.schedule.outputs)
                         - self.extended.lines)  # fmt: skip
        if self.extended.sent < Sent.TURNS:
            return pieces
        # a memory behind a delay may turn at a corner: its rate jumps there, by a comparison
        chosen = by_comparisons(self.graph, [e for e, _ in pieces])
        return [(e, size) for e, (_, size) in zip(chosen, pieces, strict=True)]

    @cached_property
    def single_arriving(self) -> list[Expr]:
        """What arrives at each delay."""
        return [self.graph.item(e, k) for e, size in self.arriving for k in range(size)]

    @cached_property
    def jumps(self) -> list[Expr]:
        """The operations at which the flow may jump."""
        inside = [e for fixed_point in self.equations.fixed_points.values() for e in fixed_point]
        if jumping(inside):
            raise CompileError(
                "an algebraic loop has jumps in it: derivatives of a run do not know its signals "
                "on both sides; put a lag into the loop"
            )
        # what jumps may also make a memory switch, or a guard fall
        roots = [*self._flowing, *self.of_memories, *self.guards]
        turns = self.extended.sent >= Sent.TURNS
        cornered = set(jumping([e for e, _ in self.arriving] if turns else []))
        # a comparison of what jumps there may turn out the other way by that
        compared = [a for e in jumping(roots) for a in e.args if a.varies]
        roots = [*roots, *compared]
        bending = Bending(self.graph, roots, self.p)
        return [
            e for e in jumping(roots)
            if e in cornered or e in self._turning_roots or not bending.only_bends(e)
        ]  # fmt: skip

    @property
    def _flowing(self) -> list[Expr]:
        """What a run is made of between its events."""
        return [*(e for e, _ in (*self.exact_flow, *self.arriving)), *self.driven.values()]

    @cached_property
    def of_memories(self) -> list[Expr]:
        """The switching functions of the blocks whose memories jump."""
        nodes = self.extended.schedule.nodes
        jumping_blocks = {
            i for i, node in enumerate(nodes) for m in self.switched
            if node.state_offset <= m < node.state_offset + node.size
        }  # fmt: skip
        pairs = zip(self.owners, self.switching, strict=True)
        return [expr for i, expr in pairs if i in jumping_blocks and expr.varies]

    @cached_property
    def kinks(self) -> list[Expr]:
        """Levels of what has another derivative on either side; a driven memory is at its own."""
        roots = [*self._flowing, *(e for e, _ in self.equations.pieces("y"))]
        levels = self._levels([e for e in conditions(roots) if e not in self.jumps])
        return [level for level in levels if not self.leaves([level], self.driven)]

    def choices(self, name: str) -> list[tuple[Expr, Expr]]:
        """Levels of what has another derivative on either side, in samples; with their extents."""
        chosen = conditions(e for e, _ in self.equations.pieces(name))
        graph, pairs = self.graph, []
        for condition, level in zip(chosen, self._levels(chosen), strict=True):
            for k in range(level.size or 1):
                parts = [graph.item(graph.number(arg), k) for arg in condition.args]
                sizes = [graph.op("absolute", part) for part in parts]
                extent = reduce(partial(graph.op, "add"), sizes)
                pairs.append((graph.item(level, k), extent))
        return pairs

    def edges(self, memories: Sequence[int]) -> list[Expr]:
        """Return levels of what some memories are driven by."""
        return [level for m in memories for level in self._edges[m]]

    @cached_property
    def _edges(self) -> dict[int, list[Expr]]:
        """Levels of what each memory is driven by."""
        return {m: self._levels(conditions([become])) for m, become in self.driven.items()}

    def _levels(self, of: Iterable[Expr]) -> list[Expr]:
        return [switching_function(self.graph, condition) for condition in of]

    def time(
        self,
        pieces: Sequence[SomeRows],
        time: Expr | None = None,
        delays_move: bool = True,
    ) -> Direction:
        """Return the direction in which everything goes with these rates of the states."""
        # By `time`, 1 if it is None. Rates of delayed signals that are not known are refused, and
        # count as 0 unless `delays_move`.
        lines = self.delayed if delays_move else range(0)
        outside = from_time(self.graph, time, lines, self._row_of_rate)
        return Direction(of={**outside.of, "x": taken(self.graph, pieces)})

    def with_bounded_inputs(self, rate: Expr) -> Expr:
        """Return a rate by inputs that rise in no time as if they took some for it."""
        # A step of an input ends at once: what lies ahead of it is not reached at its slope.
        graph, steepest, schedule = self.graph, self.setting("steepest"), self.extended.schedule
        bounded = {}
        for row in range(schedule.ninputs - schedule.rates, schedule.ninputs):
            most = graph.op("minimum", graph.leaf("u", row, None), steepest)
            bounded[row] = graph.op("maximum", most, graph.op("neg", steepest))
        return replaced_parts(graph, [rate], self.leaves([rate], bounded, "u"))[0]

    def _row_of_rate(self, row: int) -> int | None:
        """Return which row of the inputs has the rate of another, None if none has."""
        extended_program = self.extended
        schedule, lines = extended_program.schedule, extended_program.lines
        if row < self.inputs:
            return schedule.ninputs - schedule.rates + row
        group, i = divmod(row - self.inputs, lines) if lines else (0, 0)
        rates = extended_program.group_of_rates(group - 1)
        return None if rates is None else self.inputs + extended_program.line(rates, i)

    def moving(self, flow: Sequence[SomeRows], committed: Sequence[Expr]) -> list[SomeRows]:
        """Return the rates of all states, those of memories that are driven included."""
        pairs = zip(self.program.memory, committed, strict=True)
        driven = {m: expr for m, expr in pairs if m not in self.switched}
        if not driven:
            return list(flow)
        direction = self.time(flow)
        solutions = self.equations.fixed_points
        ahead = one_sided(self.graph, list(driven.values()), direction, solutions)
        rates = self.changes(ahead, direction)
        return rows_replaced(self.graph, flow, dict(zip(driven, rates, strict=True)))

    @property
    def drives_by_delays(self) -> bool:
        """Whether what leaves delays drives a memory, or the rate of what does."""
        if not self._reads_delays(list(self.driven.values())):
            return False
        self._check_samples()
        nodes = self.extended.schedule.nodes
        specs = [
            nodes[line.block or 0].system.current_spec for line in self.extended.schedule.lines
        ]
        if any(spec.varying is not None for spec in specs):
            raise CompileError(
                "a memory is driven by a signal whose delay varies, of which rates are not kept: "
                "derivatives of that are not known; take differences of runs"
            )
        if reads([e for e, _ in self.arriving], "x", self.driven):
            raise CompileError(
                "a memory is driven by what another one moves, through a delay: where that sets "
                "out is not sent through it; take differences of runs"
            )
        return True

    @property
    def switches_by_delays(self) -> bool:
        """Whether what leaves delays, or its size, says when something jumps."""
        arguments = [self.graph.number(a) for jump in self.jumps for a in jump.args]
        exprs = [*arguments, *self.of_memories, *self.guards]
        if reads(exprs, "u", self._delayed_samples):
            raise CompileError(
                "when something jumps depends on samples that come through a delay: when these "
                "jump there is not known; put a lag in between (nlctl.Lag), or take differences "
                "of runs"
            )
        return self._reads_delays(exprs)

    def check_steps(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Refuse held inputs whose steps are seen by what takes the values of their instant."""
        # A step takes a little time in a run with derivatives.
        way = Direction(of=dict.fromkeys("txu", self._everywhere))
        caught = self.changes(list(self.catching.values()), way)
        values = evaluate_expressions(caught, arrays, searches_of(self.equations))
        catches = any(np.any(value != 0.0) for value in values)
        readers = {
            "a guard": self.guards, "a delay": self.single_arriving,
            "a memory that keeps what a signal has been": self.of_memories if catches else [],
        }  # fmt: skip
        for reader, exprs in readers.items():
            if reads(exprs, "u", range(self.inputs)):
                raise CompileError(
                    f"{reader} sees the steps of held inputs: with hold='zoh' its derivatives are "
                    "not known; put a lag in between (nlctl.Lag), or take differences of runs"
                )

    @property
    def _delayed_samples(self) -> set[int]:
        """The rows of the inputs that leave delays of what is made of samples at once."""
        direct, sampled = self.extended.direct, self.program.sampled
        lines = {i for i, e in enumerate(self.single_arriving) if reads([e], "x", sampled)}
        for _ in range(len(direct)):
            lines |= {i for i in range(len(direct)) if any(direct[i, k] for k in lines)}
        return {self.inputs + i for i in lines}

    def _check_samples(self) -> None:
        """Refuse a memory that samples drive through a delay together with anything else."""
        # Alone they move it only where they jump, and it keeps what it is moved to then.
        for become in self.driven.values():
            rows = self._delayed_samples
            if not reads([become], "u", rows):
                continue
            delayed = [self.single_arriving[row - self.inputs] for row in rows]
            leaves = [leaf for leaf in needed([become, *delayed]) if leaf.op == "leaf"]
            still = {*self.program.sampled, *self.driven}
            others = any(
                leaf.data[0] == "t"
                or (leaf.data[0] == "x" and not still.issuperset(rows_read(leaf)))
                or (leaf.data[0] == "u" and not rows.issuperset(rows_read(leaf)))
                for leaf in leaves
            )
            if others or len(rows) > 1:
                raise CompileError(
                    "a memory is driven by samples that come through a delay, and by something "
                    "else: what it is driven to before they jump is not known; put a lag in "
                    "between (nlctl.Lag), or take differences of runs"
                )

    def _reads_delays(self, exprs: Sequence[Expr]) -> bool:
        """Return whether expressions, or their rates, are made of what leaves delays."""
        rates = self.changes(exprs, self.time(self.flow, delays_move=False))
        return reads([*exprs, *rates], "u", self.delayed)

    @property
    def delayed(self) -> range:
        """The rows of the inputs that leave delays."""
        return range(self.inputs, self.inputs + self.extended.lines)

    def flowing(self, flow: Sequence[SomeRows], seeds: Sequence[Direction]) -> list[SomeRows]:
        """Return rates of the states, and behind them those of their derivatives."""
        pieces = list(flow)
        for seed in seeds:
            rates = self.changes([e for e, _ in self.flow], seed)
            pieces += [(e, size) for e, (_, size) in zip(rates, self.flow, strict=True)]
        return pieces

    def slopes(self, exprs: Sequence[Expr], direction: Direction) -> list[Expr | None]:
        """Return the derivatives of expressions along a direction, None where they are 0."""
        return slopes(self.graph, exprs, direction, self.equations.fixed_points)

    def changes(self, exprs: Sequence[Expr], direction: Direction) -> list[Expr]:
        """Return the derivatives of expressions along a direction, 0 where they stand still."""
        return [e or self.graph.const(0.0) for e in self.slopes(exprs, direction)]

    def with_states(self, exprs: Sequence[Expr], instead: Mapping[int, Expr]) -> list[Expr]:
        """Return expressions with others in the places of some states."""
        return replaced_parts(self.graph, exprs, self.leaves(exprs, instead))

    def leaves(
        self, exprs: Iterable[Expr], instead: Mapping[int, Expr], array: str = "x"
    ) -> dict[Expr, Expr]:
        """Return what stands for the leaves of expressions that read some rows of an array."""
        replacements = {}
        for leaf in needed(exprs):
            if leaf.op != "leaf" or leaf.data[0] != array:
                continue
            rows = rows_read(leaf)
            if not any(row in instead for row in rows):
                continue
            parts = [instead.get(r, self.graph.leaf(array, r, None)) for r in rows]
            replacements[leaf] = (
                self.graph.joined([(e, 1) for e in parts]) if leaf.size else parts[0]
            )
        return replacements


def equation_parts(compiled: Compiled, extended_program: Extended, p: np.ndarray) -> EquationParts:
    """Return what a diagram computes."""
    program = compiled.program
    computed = equations(extended_program.schedule, extended_program.layout, p, program.meetings)
    graph, first = computed.graph, program.switching + computed.conditions.rows
    rows = _single(graph, computed.results["g"])
    del graph.lengths["x"]  # there are more of them now
    nodes = compiled.schedule.nodes
    owners = [i for i, node in enumerate(nodes) for _ in range(count_switching_functions(node))]
    jump = [m for node in nodes if memory(node) and _jumps(node) for m in memory(node)]
    ordered = sorted(range(len(owners)), key=lambda k: not memory(nodes[owners[k]]))
    return EquationParts(
        equations=computed, extended=extended_program, program=program,
        inputs=compiled.system.ninputs or 0,
        switching=[computed.conditions.levels.get(k, rows[k]) for k in range(program.switching)],
        guards=[rows[first + k] for k in range(len(program.guards))],
        committed=list(_single(graph, computed.results["m"]).values()),
        switched=frozenset(jump), owners=tuple(owners), ordered=tuple(ordered),
        behind=sum(bool(memory(nodes[i])) for i in owners), p=p,
    )  # fmt: skip


def _single(graph: Graph, results: Sequence[tuple[int, Tracer]]) -> dict[int, Expr]:
    """Return the expression of each row of some results."""
    single: dict[int, Expr] = {}
    for row, array in results:
        for expr, size in array.pieces():
            single |= {row + k: graph.item(expr, k) for k in range(size)}
            row += size
    return single


def _jumps(node: Node) -> bool:
    """Whether the memories of a block jump, whatever its inputs do."""
    graph, system = Graph(), node.system
    if supplied_of(system) is SLIDING:
        return True
    try:
        given = traced_arguments(graph, system, slots_of(system))
        committed = trace(graph, system.spec.commit, lambda: given)
    except Untraceable as error:
        raise CompileError(
            f"block '{node.path}' has a memory that is not an expression ({error}): its "
            "derivatives are not known; take differences of runs"
        ) from None
    return may_jump([e for e, _ in committed.pieces()])


def _behind(graph: Graph, pieces: Sequence[SomeRows], first: int) -> list[SomeRows]:
    """Return the rows of pieces from one on."""
    rest_of_pieces, row = [], 0
    for expr, size in pieces:
        cut = min(max(first - row, 0), size)
        if cut < size:
            rest = size - cut
            part = graph.item(expr, cut) if rest == 1 else graph.part(expr, cut, 1, rest)
            rest_of_pieces.append((part if expr.size else expr, rest))
        row += size
    return rest_of_pieces
