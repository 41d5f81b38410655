"""Derivatives of memories that are driven: what they are while they stand, and where they turn.

Corners of what drives a memory: where its rate jumps, such as those of a triangular wave.

A memory that reverses at one keeps what it was driven to there, at a time t* that moves: its
derivative becomes S- + f- t*', with the derivative S- and the rate f- of what has driven it until
then.  At a smooth turn f- is 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from ..errors import CompileError
from ..expressions.bends import replaced_parts
from ..expressions.conditions import conditions, number_rooted
from ..expressions.dependence import reads, rows_read
from ..expressions.graph import ORDERS, Expr, Graph, needed
from .directions import Cause, Direction, when_of
from .names import StatePlaces
from .sides import KeptSides
from .source import EquationParts

_BETWEEN = 1e-3  # of how late a turn may be seen: on either side of a corner


@dataclass(frozen=True, kw_only=True)
class Corner:
    """A corner that may be here."""

    here: Expr  # whether it is
    moves: list[Expr]  # the derivative by each quantity of the time at which it is passed
    node: Expr  # the operation in what drives a memory
    before: Expr  # what stands for that before it


def corners_of(
    source: EquationParts, become: Expr, seeds: Sequence[Direction], longest: Expr
) -> list[Corner]:
    """Return the corners of what drives a memory but for those where the memory is met."""
    graph, jumps, corners = source.graph, set(source.jumps), []
    for node in conditions([become]):
        if node in jumps or node.size is not None:
            continue
        level, above, below = _sides(graph, node)
        if level is None or source.leaves([level], source.driven):
            continue
        (rate,) = source.slopes([level], source.time(source.flow, delays_move=False))
        if rate is None:
            continue
        little = graph.op("mul", graph.const(_BETWEEN), longest)
        little = graph.op("mul", little, source.with_bounded_inputs(rate))
        was, is_then = (
            graph.op("gt", graph.op(op, level, little), graph.const(0.0)) for op in ("sub", "add")
        )
        here = graph.op("ne", graph.number(was), graph.number(is_then))
        side = graph.op("select", was, above, below)
        changes = [source.changes([level], seed)[0] for seed in seeds]
        corners.append(Corner(
            here=here, node=node, before=graph.op("select", here, side, node),
            moves=[graph.op("neg", graph.op("div", change, rate)) for change in changes],
        ))  # fmt: skip
    return corners


def at_corner(
    source: EquationParts, become: Expr, corners: Sequence[Corner], seeds: Sequence[Direction]
) -> tuple[Expr, list[Expr]]:
    """Return whether there is a corner now, and the derivatives that a memory keeps then."""
    graph = source.graph
    here, zero = graph.const(False), graph.const(0.0)
    moves = [zero] * len(seeds)
    for corner in reversed(corners):
        here = graph.op("or", here, corner.here)
        pairs = zip(corner.moves, moves, strict=True)
        moves = [graph.op("select", corner.here, a, b) for a, b in pairs]
    before = {corner.node: corner.before for corner in corners}
    (driving,) = replaced_parts(graph, [become], before)
    (rate,) = source.changes([driving], source.time(source.flow, delays_move=False))
    kept = [
        graph.op("add", source.changes([driving], seed)[0], graph.op("mul", rate, move))
        for seed, move in zip(seeds, moves, strict=True)
    ]
    return here, kept


def _sides(graph: Graph, node: Expr) -> tuple[Expr | None, Expr, Expr]:
    """Return what is 0 at a corner, and what an operation is above that and below."""
    op, args = node.op, [graph.number(arg) for arg in node.args]
    one, yes, no = graph.const(1.0), graph.const(True), graph.const(False)
    square = number_rooted(node)
    if square is not None:
        return square, square, graph.op("neg", square)
    if op in ORDERS or op in ("minimum", "maximum"):
        level = graph.op("sub", *args)
        sides = {"minimum": args[::-1], "maximum": args}.get(op)
        sides = sides or ([yes, no] if op in ("gt", "ge") else [no, yes])
        return level, sides[0], sides[1]
    if op == "absolute":
        return args[0], args[0], graph.op("neg", args[0])
    if op == "sign":
        return args[0], one, graph.op("neg", one)
    if op == "heaviside":
        return args[0], one, graph.const(0.0)
    if op == "copysign":
        size = graph.op("absolute", args[0])
        return args[1], size, graph.op("neg", size)
    return None, one, one


_SAME = 1e-9  # of a memory: it is where it was driven to
_FAR = 5e5  # a memory that is driven is kept at least so far away


@dataclass(frozen=True, kw_only=True)
class DrivenMemories:
    """Where memories that are driven turn."""

    source: EquationParts
    sides: KeptSides
    places: StatePlaces
    seeds: Sequence[Direction]
    _known_corners: dict[Expr, list[Corner]] = field(default_factory=dict)
    _at_corners: dict[Expr, tuple[Expr, list[Expr]]] = field(default_factory=dict)

    def kept(self, j: int, m: int, at_turn: bool = False) -> Expr:
        """Return the derivative of a memory, which is integrated only while it is not driven."""
        graph, become = self.source.graph, self.source.driven[m]
        derivative = self.turned(become, j) if at_turn else self._change(become, j)
        (derivative,) = self.sides.kept([derivative])
        if at_turn:
            derivative = self._at_tick(m, j, derivative)
        # it stays as it was where it begins to be driven
        moved = self.has_turned(m) if at_turn else self._has_moved(m)
        integrated = graph.leaf("x", self.places.derivative(j) + m, None)
        return graph.op("select", moved, derivative, integrated)

    def turned(self, level: Expr, j: int) -> Expr:
        """Return the derivative of a number where that turns."""
        # A step ends a little behind that.
        source, graph = self.source, self.source.graph
        derivative = change = self._change(level, j)
        recent, late = self._late(level)
        (rate,) = source.slopes([change], self._forward)
        if rate is not None:
            late = graph.op("select", recent, late, graph.const(0.0))
            derivative = graph.op("sub", derivative, graph.op("mul", late, rate))
        if self._is_moved_by_delay(j, level):
            # a break of an input, whose time moves behind the delay as that does
            scale = source.setting("scale", j)
            (rate,) = source.changes([level], self._forward)
            moved = graph.op("add", derivative, graph.op("mul", scale, rate))
            derivative = graph.op("select", recent, derivative, moved)
        corners = self.corners(level)
        if corners:
            if level not in self._at_corners:
                self._at_corners[level] = at_corner(source, level, corners, self.seeds)
            here, there = self._at_corners[level]
            derivative = graph.op("select", here, there[j], derivative)
        return derivative

    @cached_property
    def _forward(self) -> Direction:
        """The direction in which everything goes, derivatives too."""
        return self.source.time(
            self.source.flowing(self.source.flow, self.seeds), delays_move=False
        )

    def _is_kept(self, m: int, before: Expr) -> Expr:
        """Return whether a memory is where it was driven to before a clock has ticked."""
        graph, now = self.source.graph, self.source.graph.leaf("x", m, None)
        gap = graph.op("absolute", graph.op("sub", now, before))
        size = graph.op("add", graph.op("absolute", now), graph.const(1.0))
        return graph.op("le", gap, graph.op("mul", graph.const(_SAME), size))

    @property
    def sampled(self) -> list[int]:
        """The states that are samples, then their derivatives."""
        groups = [0, *(self.places.derivative(j) for j in range(self.places.by))]
        return [first + i for first in groups for i in self.source.program.sampled]

    def _at_tick(self, m: int, j: int, turned: Expr) -> Expr:
        """Return the derivative of a memory that turns where what drives it is sampled."""
        # What it was until then has been kept, unless the jump has gone further.
        graph, places, sampled = self.source.graph, self.places, self.source.program.sampled
        level = self.source.driven[m]
        if not (places.samples and reads([level], "x", sampled)):
            return turned
        earlier = {
            state: graph.leaf("x", places.earlier + k, None) for k, state in enumerate(self.sampled)
        }
        before, change = self.sides.kept(
            self.source.with_states([level, self._change(level, j)], earlier)
        )
        (after,) = self.source.with_states([level], {m: before})
        kept = graph.op("select", self._is_kept(m, before), change, self._change(after, j))
        ticked = graph.leaf("x", places.ticked, None)
        gap = graph.op("absolute", graph.op("sub", graph.leaf("t", 0, None), ticked))
        here = graph.op("le", gap, self.source.setting("rounding"))
        return graph.op("select", here, kept, turned)

    def _change(self, level: Expr, j: int) -> Expr:
        return self.source.changes([level], self.seeds[j])[0]

    def _has_moved(self, m: int) -> Expr:
        return self.source.graph.op(
            "ne", self.source.graph.leaf("x", m, None), self.sides.memories[m]
        )

    def has_turned(self, m: int) -> Expr:
        """Return whether a memory has been moved, and is not being moved any more."""
        graph = self.source.graph
        stands = graph.op("not", self.is_far(m, graph.leaf("x", m, None)))
        return graph.op("and", self._has_moved(m), stands)

    def is_far(self, m: int, kept: Expr) -> Expr:
        """Return whether a memory is kept far away from where it is moved."""
        graph = self.source.graph
        gap = graph.op("sub", kept, self.source.driven[m])
        return graph.op("gt", graph.op("absolute", gap), graph.const(_FAR))

    @cached_property
    def corners_apart(self) -> dict[int, Expr]:
        """Whether memories are driven by two corners now, each of which moves otherwise."""
        graph, rounding = self.source.graph, self.source.setting("rounding")
        no, apart = graph.const(False), {}
        for m, become in self.source.driven.items():
            causes = [Cause(met=c.here, moves=c.moves, grazes=no) for c in self.corners(become)]
            if len(causes) > 1:
                apart[m] = self.source.any_of(
                    when_of(graph, causes, self.places.by, rounding).apart
                )
        return apart

    def corners(self, level: Expr) -> list[Corner]:
        """Return the corners of a number."""
        if level not in self._known_corners:
            corners = corners_of(self.source, level, self.seeds, self.source.setting("late"))
            self._known_corners[level] = corners
        return self._known_corners[level]

    def _is_moved_by_delay(self, j: int, become: Expr) -> bool:
        """Whether breaks of inputs that drive a memory move as a quantity, a delay, does."""
        source = self.source
        if not (source.inputs and any(self.places.delays[j])):
            return False
        by = {
            self.places.delays[j][row - source.inputs] if row >= source.inputs else False
            for leaf in needed([become])
            if leaf.op == "leaf" and leaf.data[0] == "u"
            for row in rows_read(leaf)
        }
        if len(by) > 1 or source.extended.direct.any():
            raise CompileError(
                "a memory is driven by inputs that come through several ways, of which one has a "
                "delay that is differentiated by: where inputs have kinks that is not known; take "
                "differences of runs"
            )
        return by == {True}

    def _late(self, become: Expr) -> tuple[Expr, Expr]:
        """Return whether what drives a memory has just reversed smoothly, and how long ago."""
        # Where it turns is located by a difference of rates: a little too early or too late.
        graph, source = self.source.graph, self.source
        zero = graph.const(0.0)
        forward = source.time(source.flow, delays_move=False)
        (rate,) = self.source.slopes([become], forward)
        (bend,) = self.source.slopes([rate or zero], forward)
        late = graph.op("div", rate or zero, bend or zero)
        return graph.op("le", graph.op("absolute", late), self.source.setting("late")), late
