"""Derivatives of memories that are driven: what they are while they stand, and where they turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ..errors import CompileError
from ..expressions.dependence import rows_read
from ..expressions.graph import Expr, needed
from .corners import at_corner, corners_of
from .directions import Direction
from .names import StatePlaces
from .sides import KeptSides
from .source import EquationParts


@dataclass(frozen=True, kw_only=True)
class DrivenMemories:
    """Where memories that are driven turn."""

    source: EquationParts
    sides: KeptSides
    places: StatePlaces
    seeds: Sequence[Direction]

    def kept(self, j: int, m: int, at_turn: bool = False) -> Expr:
        """Return the derivative of a memory, which is integrated only while it is not driven."""
        # A step ends a little behind where it has reversed.
        graph = self.source.graph
        kept = self.sides.memories[m]
        become = self.source.driven[m]
        (change,) = self.source.slopes([become], self.seeds[j])
        derivative = graph.const(0.0) if change is None else change
        if at_turn and change is not None:
            flowing = self.source.flowing(self.source.flow, self.seeds)
            forward = self.source.time(flowing, delays_move=False)
            (rate,) = self.source.slopes([change], forward)
            recent, late = self._late(become)
            if rate is not None:
                late = graph.op("select", recent, late, graph.const(0.0))
                derivative = graph.op("sub", derivative, graph.op("mul", late, rate))
            if self._is_moved_by_delay(j, become):
                # a break of an input, whose time moves behind the delay as that does
                scale = graph.leaf("p", self.source.extended.slot("scale").offset + j, None)
                (rate,) = self.source.changes([become], forward)
                moved = graph.op("add", derivative, graph.op("mul", scale, rate))
                derivative = graph.op("select", recent, derivative, moved)
        if at_turn and m in self._at_corners:
            here, there = self._at_corners[m]
            derivative = graph.op("select", here, there[j], derivative)
        (derivative,) = self.sides.kept([derivative])
        moved = graph.op("ne", graph.leaf("x", m, None), kept)
        integrated = graph.leaf("x", self.places.derivative(j) + m, None)
        return graph.op("select", moved, derivative, integrated)

    @cached_property
    def _at_corners(self) -> dict[int, tuple[Expr, list[Expr]]]:
        """Return of memories that corners may drive whether one does, and what they keep then."""
        source, kept = self.source, {}
        for m, become in source.driven.items():
            corners = corners_of(source, become, self.seeds, self._longest)
            if corners:
                kept[m] = at_corner(source, become, corners, self.seeds)
        return kept

    @property
    def _longest(self) -> Expr:
        """How late a turn may be seen."""
        return self.source.graph.leaf("p", self.source.extended.slot("late").offset, None)

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
        return graph.op("le", graph.op("absolute", late), self._longest), late
