"""Derivatives of memories that are driven: what they are while they stand, and where they turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ..errors import CompileError
from ..expressions.dependence import reads
from ..expressions.graph import Expr
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
            if rate is not None:
                late = self._late(become)
                derivative = graph.op("sub", derivative, graph.op("mul", late, rate))
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

    def _late(self, become: Expr) -> Expr:
        """Return how long ago what drives a memory has reversed, 0 at a break."""
        # Where it turns is located by a difference of rates: a little too early or too late.
        graph, source = self.source.graph, self.source
        zero = graph.const(0.0)
        forward = source.time(source.flow, delays_move=False)
        (rate,) = self.source.slopes([become], forward)
        (bend,) = self.source.slopes([rate or zero], forward)
        if bend is None:
            return zero
        late = graph.op("div", rate or zero, bend)
        recent = graph.op("le", graph.op("absolute", late), self._longest)
        return graph.op("select", recent, late, zero)
