"""Memories that have two derivatives: touched at their end and no further, or at two corners.

A play whose input comes to the end of its gap and goes back from there is moved by the least change
of one sign, and not by one of the other.  So is one that has been moved by as little as nobody
sees.  Unless what touches it moves as it does itself: the crests of a periodic input all touch the
memory that the first has left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ..expressions.conditions import conditions, switching_function
from ..expressions.graph import Expr, Graph, needed
from .directions import Direction
from .names import StatePlaces
from .returning import Returning
from .sides import KeptSides
from .source import EquationParts
from .turns import DrivenMemories

_STILL = 1e-4  # of what is known of a number, in the time in which a turn is seen: a rest
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
    returning: Returning

    @property
    def graph(self) -> Graph:
        """Where the expressions are kept."""
        return self.source.graph

    @cached_property
    def contacts(self) -> list[tuple[int, Expr, Expr]]:
        """Memories, how far each is from an end, and the rate of that."""
        forward, contacts = self.source.time(self.source.flow), []
        for m, become in self.source.driven.items():
            levels = [level for node in conditions([become]) for level in self._of(m, node)]
            for level in dict.fromkeys(levels):
                (rate,) = self.source.slopes([level], forward)
                contacts += [] if rate is None else [(m, level, rate)]
        return contacts

    def _of(self, m: int, node: Expr) -> list[Expr]:
        """Return the switching functions of a condition that are of a memory."""
        level, functions = switching_function(self.graph, node), []
        for leaf in needed([level]):
            if leaf.op == "leaf" and leaf.data[0] == "x" and leaf.size in (None, level.size):
                _, start, step = leaf.data
                functions += [
                    self.graph.item(level, k)
                    for k in range(level.size or 1)
                    if start + step * (k if leaf.size else 0) == m
                ]
        return functions

    @cached_property
    def guards(self) -> list[Expr]:
        """What falls through 0 where the input of a memory that stands turns."""
        # By its rate alone: where a memory comes to its end and further, nothing falls.
        graph, guards = self.graph, []
        for m, rate in dict.fromkeys((m, rate) for m, _, rate in self.contacts):
            least = graph.op("mul", graph.const(_STILL), graph.op("div", self._noise(m), self._late))
            driven = self.turns.is_far(m, graph.leaf("x", m, None))
            for op in ("sub", "add"):
                turns = graph.op(op, least, rate)
                guards.append(graph.op("select", driven, graph.const(1.0), turns))
        return guards

    @cached_property
    def touched(self) -> dict[int, Expr]:
        """Whether each memory has two derivatives now, as it is touched, or hardly moved."""
        graph, touched = self.graph, self._hardly_moved
        for m, level, rate in self.contacts:
            stands = graph.op("eq", graph.leaf("x", m, None), self.sides.memories[m])
            stands = graph.op("and", stands, graph.op("not", self._has_just_turned(m)))
            near = graph.op("le", graph.op("absolute", level), self._noise(m))
            pairs = []
            for j in range(self.places.by):
                memory = self._derivative(j, m)
                pairs.append((memory, graph.op("sub", memory, self._change(j, level, rate))))
            here = graph.op("and", stands, near)
            here = graph.op("and", here, self._any_differs(pairs))
            touched[m] = graph.op("or", touched[m], here)
        return touched

    @property
    def _hardly_moved(self) -> dict[int, Expr]:
        """Whether each memory has just turned, with another derivative than where it stood."""
        graph, hardly = self.graph, {}
        for m in self.source.driven:
            gone = graph.op("sub", graph.leaf("x", m, None), self.stood[m])
            near = graph.op("le", graph.op("absolute", gone), self._noise(m))
            pairs = [
                (self.turns.kept(j, m, at_turn=True), self._derivative(j, m))
                for j in range(self.places.by)
            ]
            here = graph.op("and", self.turns.has_turned(m), near)
            hardly[m] = graph.op("and", here, self._any_differs(pairs))
        return hardly

    @cached_property
    def cornered(self) -> dict[int, Expr]:
        """Whether each memory has just turned at two corners at once."""
        no, apart = self.graph.const(False), self.turns.corners_apart
        return {
            m: self.graph.op("and", self.turns.has_turned(m), apart.get(m, no))
            for m in self.source.driven
        }

    @cached_property
    def stood(self) -> dict[int, Expr]:
        """Where each memory stood before it was moved."""
        graph, stood = self.graph, {}
        for k, m in enumerate(self.source.driven):
            kept = self.sides.memories[m]
            before = graph.leaf("x", self.places.stood + k, None)
            stood[m] = graph.op("select", self.turns.is_far(m, kept), before, kept)
        return stood

    @cached_property
    def turned(self) -> dict[int, Expr]:
        """When each memory has last turned."""
        graph, now = self.graph, self.graph.leaf("t", 0, None)
        return {
            m: graph.op("select", self.turns.has_turned(m), now, self._last_turn(m))
            for m in self.source.driven
        }

    def _last_turn(self, m: int) -> Expr:
        place = self.places.turned + list(self.source.driven).index(m)
        return self.graph.leaf("x", place, None)

    def _has_just_turned(self, m: int) -> Expr:
        """Return whether a memory is near its end since it has turned there."""
        graph = self.graph
        ago = graph.op("sub", graph.leaf("t", 0, None), self._last_turn(m))
        return graph.op("le", graph.op("absolute", ago), self._late)

    @property
    def _late(self) -> Expr:
        """How long behind a turn a step may end."""
        return self.graph.leaf("p", self.source.extended.slot("late").offset, None)

    def _derivative(self, j: int, m: int) -> Expr:
        return self.graph.leaf("x", self.places.derivative(j) + m, None)

    def _change(self, j: int, level: Expr, rate: Expr) -> Expr:
        """Return the derivative of a level at the time at which it turns."""
        graph, change = self.graph, self.turns.turned(level, j)
        arrives = self.returning.arrives
        if arrives is None:
            return change
        (now,) = self.source.changes([level], self.seeds[j])
        move = self.returning.when.moves[j]
        there = graph.op("add", now, graph.op("mul", rate, move))
        return graph.op("select", arrives, there, change)

    def _any_differs(self, pairs: Sequence[tuple[Expr, Expr]]) -> Expr:
        """Return whether any two derivatives are not one."""
        graph, differs = self.graph, self.graph.const(False)
        for one, other in pairs:
            gap = graph.op("absolute", graph.op("sub", one, other))
            size = graph.op("add", graph.op("absolute", one), graph.op("absolute", other))
            seen = graph.op("mul", graph.const(_SEEN), self._known(size))
            least = graph.op("add", graph.op("mul", graph.const(_AGREE), size), seen)
            differs = graph.op("or", differs, graph.op("gt", gap, least))
        return differs

    def _noise(self, m: int) -> Expr:
        return self._known(self.graph.op("absolute", self.source.driven[m]))

    def _known(self, size: Expr) -> Expr:
        """Return how well a number of some size is known."""
        graph, slot = self.graph, self.source.extended.slot
        rtol, atol = (graph.leaf("p", slot(name).offset, None) for name in ("rtol", "atol"))
        return graph.op("add", graph.op("mul", rtol, size), atol)
