"""The sides of all jumps of a diagram: which are kept, and the equations on these."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

from ..expressions.bends import replaced_parts
from ..expressions.graph import Expr, needed
from ..native.equations.located import of_time_alone
from .branches import Branch, branch_of
from .directions import SomeRows
from .source import EquationParts


@dataclass(frozen=True, kw_only=True)
class KeptSide:
    """One jump, or as many as it has elements."""

    kept: Expr  # the side that is kept, a state
    here: Branch  # by what everything is now
    before: Branch  # by what everything was on the sides that are kept
    timed: bool  # whether it is of t alone
    node: Expr | None = None  # the operation in the equations

    @property
    def rows(self) -> int:
        """Number of its elements."""
        return self.kept.size or 1


@dataclass(frozen=True, kw_only=True)
class KeptSides:
    """The sides of all jumps."""

    source: EquationParts
    sides: tuple[KeptSide, ...]
    # of states of memories, what is kept of them: far away while they are driven, and where
    # they stand otherwise
    memories: dict[int, Expr]
    before: dict[Expr, Expr]  # what stands, on the sides that are kept, for parts of the equations

    @property
    def rows(self) -> int:
        """Number of all that is kept."""
        return sum(side.rows for side in self.sides) + len(self.memories)

    @property
    def now(self) -> list[SomeRows]:
        """What is to be kept from now on."""
        memories = [(self.source.graph.leaf("x", m, None), 1) for m in self.memories]
        return [*((side.here.now, side.rows) for side in self.sides), *memories]

    @cached_property
    def flow_before(self) -> list[SomeRows]:
        """The derivatives of the states on the sides that are kept."""
        flow = self.source.flow
        earlier = self.earlier([e for e, _ in flow])
        return [(e, size) for e, (_, size) in zip(earlier, flow, strict=True)]

    def earlier(self, exprs: Sequence[Expr]) -> list[Expr]:
        """Return expressions on the sides that are kept."""
        instead = self.source.leaves(exprs, self.memories)
        return replaced_parts(self.source.graph, exprs, {**instead, **self.before})

    def kept(self, exprs: Sequence[Expr]) -> list[Expr]:
        """Return expressions with the memories that are kept."""
        return self.source.with_states(exprs, self.memories)

    @property
    def watches(self) -> bool:
        """Whether there is anything that may jump in the equations."""
        return bool(self.sides or self.source.switched)

    @property
    def first_memory(self) -> int:
        """Where, behind all sides, what is kept of memories begins."""
        return sum(side.rows for side in self.sides)

    @property
    def driven(self) -> Expr:
        """What is at least 0 as long as every memory that is driven is where it was."""
        graph, same = self.source.graph, self.source.graph.const(True)
        for m, kept in self.memories.items():
            if m not in self.source.switched:
                same = graph.op("and", same, graph.op("eq", graph.leaf("x", m, None), kept))
        return graph.op("select", same, graph.const(1.0), graph.const(-1.0))

    @cached_property
    def margin(self) -> Expr:
        """What is at least 0 as long as nothing has left the side that is kept."""
        graph, margins = self.source.graph, []
        one, behind = graph.const(1.0), graph.const(-1.0)
        for side, rests in zip(self.sides, self._rest, strict=True):
            for k in range(side.rows):
                kept, now = graph.item(side.kept, k), graph.item(side.here.now, k)
                left, margin = graph.op("not", graph.op("eq", kept, now)), one
                if rests is not None:
                    margin = graph.item(side.here.margin, k)
                    here = graph.op("eq", margin, graph.const(0.0))
                    here = graph.op("and", here, graph.item(graph.number(rests), k))
                    left = graph.op("and", left, here)
                margins.append(graph.op("select", left, behind, margin))
        for m in self.source.switched:
            same = graph.op("eq", graph.leaf("x", m, None), self.memories[m])
            margins.append(graph.op("select", same, one, behind))
        return reduce(lambda a, b: graph.op("minimum", a, b), margins, one)

    @property
    def _rest(self) -> list[Expr | None]:
        """Whether levels stay: at exactly 0 they are on no side, or on one where sign(0) is 0."""
        graph, moving = self.source.graph, [side for side in self.sides if not side.timed]
        flow = self.source.time(self.source.flow, delays_move=False)
        rates = iter(self.source.changes([side.here.level for side in moving], flow))
        zero = graph.const(0.0)
        return [None if side.timed else graph.op("eq", next(rates), zero) for side in self.sides]


def sides_of(source: EquationParts, first: int) -> KeptSides:
    """Return the sides of all jumps of a diagram."""
    graph = source.graph
    jumps = [(node, node.op, node.args) for node in source.jumps]
    jumps += [(None, "ge", (expr, graph.const(0.0))) for expr in source.of_memories]
    sizes = [next((a.size for a in args if a.size), None) for _, _, args in jumps]
    behind = first + sum(size or 1 for size in sizes)
    memories = {m: graph.leaf("x", behind + k, None) for k, m in enumerate(source.program.memory)}
    before: dict[Expr, Expr] = {}
    sides, timed = [], of_time_alone(needed([e for _, _, args in jumps for e in args]))
    for (node, op, args), size in zip(jumps, sizes, strict=True):
        kept, first = graph.leaf("x", first, size), first + (size or 1)
        leaves = source.leaves(args, memories)
        earlier = replaced_parts(graph, list(args), {**leaves, **before})
        there = branch_of(graph, op, earlier, kept)
        sides.append(KeptSide(
            kept=kept, here=branch_of(graph, op, args, kept), before=there, node=node,
            timed=all(a in timed or not a.varies for a in args),
        ))  # fmt: skip
        if node is not None:
            before[node] = there.value
    return KeptSides(source=source, sides=tuple(sides), memories=memories, before=before)
