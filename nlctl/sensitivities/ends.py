"""Memories that have two derivatives: touched at their end and no further, or at two corners.

A play whose input comes to the end of its gap, and back from a corner there, is moved by the least
change of one sign, and not by one of the other.  So is one that has been moved by as little as
nobody sees.  Unless what touches it moves as it does itself: the crests of a periodic input all
touch the memory that the first has left.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial, reduce

from ..expressions.conditions import conditions
from ..expressions.dependence import reads
from ..expressions.graph import Expr, Graph
from .directions import Direction
from .moving_times import TimesThatMove
from .names import StatePlaces
from .sides import KeptSides
from .source import EquationParts
from .turns import DrivenMemories

_AGREE = 1e-4  # derivatives that are one
_SEEN = 1e2  # times what is known of a derivative: by less two of them do not differ


@dataclass(frozen=True, kw_only=True)
class MemoryEnds:
    """Where memories that are driven have two derivatives."""

    source: EquationParts
    sides: KeptSides
    places: StatePlaces
    seeds: Sequence[Direction]
    turns: DrivenMemories
    when: TimesThatMove

    @property
    def graph(self) -> Graph:
        """Where the expressions are kept."""
        return self.source.graph

    @cached_property
    def contacts(self) -> list[tuple[int, Expr, Expr]]:
        """Memories, how far each is from an end, and the rate of that."""
        forward, contacts = self.source.time(self.source.flow), []
        for m, become in self.source.driven.items():
            gaps = [gap for node in conditions([become]) for gap in self._gaps(m, node)]
            for gap in dict.fromkeys(gaps):
                (rate,) = self.source.slopes([gap], forward)
                contacts += [] if rate is None else [(m, gap, rate)]
        return contacts

    def _gaps(self, m: int, node: Expr) -> list[Expr]:
        """Return how far from an end a memory is by a `max` or `min` of it: not below 0."""
        if node.op not in ("maximum", "minimum"):
            return []
        gaps: list[Expr] = []
        for k in range(node.size or 1):
            one, other = (self.graph.item(self.graph.number(arg), k) for arg in node.args)
            is_first = reads([one], "x", [m])
            if is_first != reads([other], "x", [m]):
                larger = is_first == (node.op == "maximum")
                pair = (one, other) if larger else (other, one)
                gaps.append(self.graph.op("sub", *pair))
        return gaps

    @cached_property
    def guards(self) -> list[Expr]:
        """What falls below 0 at a corner at which a memory stands right at an end."""
        # A function of the rate would find smooth turns as well, but steps follow what they look
        # at, and those of a closed loop with a play become ten times as many.
        graph = self.graph
        one, fallen = graph.const(1.0), graph.const(-1.0)
        here = (self._stands_at(m, gap) for m, gap, _ in self.contacts)
        return [graph.op("select", at_end, fallen, one) for at_end in here if at_end is not None]

    def _at_corner(self, number: Expr) -> Expr | None:
        """Return whether a number is at a corner, None if it has none."""
        corners = [corner.here for corner in self.turns.corners(number)]
        if reads([number], "u", self.source.delayed) and self.when.returning.arrives is not None:
            corners.append(self.when.returning.arrives)
        return self.source.any_of(corners) if corners else None

    def _stands_at(self, m: int, gap: Expr) -> Expr | None:
        """Return whether a memory stands right at an end at a corner, None if there is none."""
        graph, corner = self.graph, self._at_corner(gap)
        if corner is None:
            return None
        stands = graph.op("eq", graph.leaf("x", m, None), self.sides.memories[m])
        within = graph.op("le", graph.op("absolute", gap), self._noise(m))
        still = graph.op("not", self._has_just_turned(m))
        return reduce(partial(graph.op, "and"), (corner, stands, within, still))

    @cached_property
    def _touched(self) -> dict[int, Expr]:
        """Whether each memory has two derivatives now, as it is touched, or hardly moved."""
        graph, touched = self.graph, self._hardly_moved
        for m, gap, rate in self.contacts:
            at_end, pairs = self._stands_at(m, gap), []
            if at_end is None:
                continue
            for j in range(self.places.by):
                memory = self._derivative(j, m)
                pairs.append((memory, graph.op("sub", memory, self._change(j, gap, rate))))
            here = graph.op("and", at_end, self._any_differs(pairs))
            touched[m] = graph.op("or", touched[m], here)
        return touched

    @property
    def _hardly_moved(self) -> dict[int, Expr]:
        """Whether each memory turns at a corner right where it stood, by another derivative."""
        graph, hardly = self.graph, {}
        for m in self.source.driven:
            gone = graph.op("sub", graph.leaf("x", m, None), self._stood[m])
            near = graph.op("le", graph.op("absolute", gone), self._noise(m))
            pairs = [
                (self.turns.kept(j, m, at_turn=True), self._derivative(j, m))
                for j in range(self.places.by)
            ]
            corner = self._at_corner(self.source.driven[m])
            parts = (self.turns.has_turned(m), near, self._any_differs(pairs))
            here = reduce(partial(graph.op, "and"), parts)
            hardly[m] = graph.const(False) if corner is None else graph.op("and", corner, here)
        return hardly

    @property
    def _when_cornered(self) -> list[Expr]:
        """When each memory has first reversed at two corners at once."""
        no, apart, when = self.graph.const(False), self.turns.corners_apart, []
        for k, m in enumerate(self.source.driven):
            here = self.graph.op("and", self.turns.has_turned(m), apart.get(m, no))
            when.append(self.source.first_time(self.places.cornered + k, here))
        return when

    @cached_property
    def _stood(self) -> dict[int, Expr]:
        """Where each memory stood before it was moved."""
        graph, stood = self.graph, {}
        for k, m in enumerate(self.source.driven):
            kept = self.sides.memories[m]
            before = graph.leaf("x", self.places.stood + k, None)
            stood[m] = graph.op("select", self.turns.is_far(m, kept), before, kept)
        return stood

    @property
    def _turned(self) -> list[Expr]:
        """When each memory has last reversed."""
        graph, place = self.graph, self.places.turned
        now = graph.leaf("t", 0, None)
        return [
            graph.op("select", self.turns.has_turned(m), now, graph.leaf("x", place + k, None))
            for k, m in enumerate(self.source.driven)
        ]

    @property
    def when_touched(self) -> list[Expr]:
        """When each memory was first touched."""
        places = enumerate(self.source.driven, self.places.touched)
        return [self.source.first_time(place, self._touched[m]) for place, m in places]

    @property
    def at_turns(self) -> list[Expr]:
        """What is kept of the memories from `StatePlaces.touched` on where one turns."""
        return [
            *self.when_touched, *self._when_cornered, *self._stood.values(), *self._turned
        ]  # fmt: skip

    def _has_just_turned(self, m: int) -> Expr:
        """Return whether a memory is near its end since it has reversed there."""
        place = self.places.turned + list(self.source.driven).index(m)
        return self._is_recent(self.graph.leaf("x", place, None))

    def _is_recent(self, time: Expr) -> Expr:
        """Return whether a time is no longer ago than a step may end behind a turn."""
        graph = self.graph
        ago = graph.op("absolute", graph.op("sub", graph.leaf("t", 0, None), time))
        return graph.op("le", ago, self.source.setting("late"))

    def _derivative(self, j: int, m: int) -> Expr:
        return self.graph.leaf("x", self.places.derivative(j) + m, None)

    def _change(self, j: int, level: Expr, rate: Expr) -> Expr:
        """Return the derivative of a level at the time at which it turns."""
        graph, change = self.graph, self.turns.turned(level, j)
        arrives = self.when.returning.arrives
        if arrives is None:
            return change
        (now,) = self.source.changes([level], self.seeds[j])
        move = self.when.returning.when.moves[j]
        there = graph.op("add", now, graph.op("mul", rate, move))
        return graph.op("select", arrives, there, change)

    def _any_differs(self, pairs: Sequence[tuple[Expr, Expr]]) -> Expr:
        """Return whether any two derivatives are not one."""
        graph, differ = self.graph, []
        for one, other in pairs:
            gap = graph.op("absolute", graph.op("sub", one, other))
            size = graph.op("add", graph.op("absolute", one), graph.op("absolute", other))
            seen = graph.op("mul", graph.const(_SEEN), self.when.noise(size))
            least = graph.op("add", graph.op("mul", graph.const(_AGREE), size), seen)
            differ.append(graph.op("gt", gap, least))
        return self.source.any_of(differ)

    def _noise(self, m: int) -> Expr:
        return self.when.noise(self.graph.op("absolute", self.source.driven[m]))
