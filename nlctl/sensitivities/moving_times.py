"""When something has happened: how the time moves at which sides were left, or a guard fell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..expressions.dependence import reads
from ..expressions.graph import Expr
from .branches import bounded
from .directions import Cause, Direction, SomeRows, When, at_once, differ, when_of
from .names import StatePlaces
from .returning import Returning
from .sides import KeptSides
from .source import EquationParts

_FAR = 1e300


@dataclass(frozen=True, kw_only=True)
class TimesThatMove:
    """What may happen at a time that moves."""

    source: EquationParts
    sides: KeptSides
    places: StatePlaces
    seeds: Sequence[Direction]
    returning: Returning

    def left(self, jumps: Expr, flows: Expr | None = None) -> When:
        """Return how the time moves at which sides have been left; a clock's does not."""
        # What only goes into delays does not meet a clock, but what `flows`.
        graph, alone = self.source.graph, self._alone()
        free, causes = graph.op("and", alone, jumps), []
        for side in self.sides.sides:
            # what no clock can have taken across is met together with it, at a time of its own
            may_be_met = free if self._follows_clocks(side.here.level) else jumps
            for k in range(side.rows):
                kept, now, level, extent = (
                    graph.item(e, k)
                    for e in (side.kept, side.before.now, side.before.level, side.before.extent)
                )
                # what a jump that leaves a delay has taken across has not been met at a rate
                (now,) = self.returning.earlier([now])
                left = graph.op("ne", kept, now)
                if side.node is None:  # a memory may switch right at its level
                    left = graph.op("or", left, graph.op("eq", level, graph.const(0.0)))
                left = graph.op("and", left, may_be_met)
                rate, cause = self.met(left, level, extent, self.sides.flow_before)
                causes += [cause] if rate is not None else []
        at_clock = graph.op("and", graph.op("not", alone), jumps if flows is None else flows)
        still = [graph.const(0.0)] * self.places.by
        causes.append(Cause(met=at_clock, moves=still, grazes=graph.const(False)))
        return when_of(graph, causes, self.places.by, self.returning.rounding)

    def _follows_clocks(self, level: Expr) -> bool:
        """Whether a level may jump as a clock ticks."""
        program = self.source.program
        jumping = {*program.sampled, *program.memory}
        return reads([level], "x", jumping) or reads([level], "u", self.source.delayed)

    def _alone(self, ago: Expr | None = None) -> Expr:
        """Whether neither a clock nor a block has made something jump right now, or so long ago."""
        graph = self.source.graph
        now, last = (graph.leaf(*at, None) for at in (("t", 0), ("x", self.places.last)))
        then = now if ago is None else graph.op("sub", now, ago)
        since = graph.op("absolute", graph.op("sub", then, last))
        return graph.op("gt", since, graph.op("mul", graph.const(2.0), self.returning.rounding))

    def reset(self, guards: Sequence[Expr]) -> tuple[When, list[Expr]]:
        """Return how the time moves at which a block jumps, and by what two causes differ."""
        # A guard that is at least 0 on the sides that are kept has fallen as these have been left,
        # or by what was sampled right now: then that says how the time moves.
        graph, source = self.source.graph, self.source
        earlier, fell = self.returning.earlier(self.sides.earlier(guards)), graph.const(False)
        for guard in earlier:
            sampled = reads([guard], "x", source.program.sampled)
            fallen = graph.op("lt", guard, graph.const(0.0))
            alone = graph.op("and", self._alone(), fallen)
            fell = graph.op("or", fell, alone if sampled else fallen)
        (by_itself, ago), by_jumps = self._fallen(earlier), self.left(graph.const(True))
        arrived = self.returning.arrives
        if arrived is not None:
            by_jumps = by_jumps.unless(arrived, self.returning.when, graph)
        left = graph.op("lt", self.sides.margin, graph.const(0.0))
        rounding, zero = self.returning.rounding, graph.const(0.0)
        ticked = graph.op("not", self._alone(ago))
        unknown = graph.op("and", left, graph.op("not", by_jumps.met))
        differs = at_once(graph, by_itself, by_jumps, rounding)
        together = []
        for move, other, apart in zip(by_itself.moves, differs, by_jumps.apart, strict=True):
            at_tick = graph.op("and", ticked, differ(graph, move, zero, rounding))
            by_itself_too = source.any_of([unknown, other, at_tick])
            together.append(graph.op("select", fell, by_itself_too, apart))
        return by_jumps.unless(fell, by_itself, graph), together

    def _fallen(self, guards: Sequence[Expr]) -> tuple[When, Expr]:
        """Return how the time moves at which the guard nearest to 0 has fallen; how long ago."""
        graph = self.source.graph
        far = nearest = graph.const(_FAR)
        yes, fallen_guards = graph.const(True), []
        for guard in guards:
            guard = bounded(graph, guard)
            size = graph.op("absolute", guard)
            rate, cause = self.met(yes, guard, size, self.sides.flow_before)
            if rate is not None:
                fallen = graph.op("lt", guard, graph.const(0.0))
                ago = graph.op("absolute", graph.op("div", guard, rate))
                ago = graph.op("select", fallen, ago, far)
                fallen_guards.append((ago, cause))
                nearest = graph.op("minimum", nearest, ago)
        causes = [replace(cause, met=graph.op("le", ago, nearest)) for ago, cause in fallen_guards]
        return when_of(graph, causes, self.places.by, self.returning.rounding), nearest

    def met(
        self, met: Expr, level: Expr, extent: Expr, flow: Sequence[SomeRows]
    ) -> tuple[Expr | None, Cause]:
        """Return the rate of a level, None where it stands still, and what it is the cause of."""
        graph, source = self.source.graph, self.source
        forward = source.time(flow)
        (rate,) = self.source.slopes([level], forward)
        if rate is None:
            return None, Cause(met=met, moves=[], grazes=graph.const(False))
        (bend,) = self.source.slopes([rate], source.time(flow, delays_move=False))
        noise = self.noise(extent)
        bent = graph.op("absolute", graph.const(0.0) if bend is None else bend)
        least = graph.op("mul", graph.op("mul", graph.const(2.0), bent), noise)
        grazes = graph.op("le", graph.op("mul", rate, rate), least)
        moves = []
        for seed in self.seeds:
            (change,) = source.slopes([level], seed)
            zero = graph.const(0.0)
            moves.append(graph.op("neg", graph.op("div", change, rate)) if change else zero)
        return rate, Cause(met=met, moves=moves, grazes=grazes)

    def noise(self, extent: Expr) -> Expr:
        """Return how well a number of some size is known."""
        graph = self.source.graph
        rtol, atol = map(self.source.setting, ("rtol", "atol"))
        return graph.op("add", graph.op("mul", rtol, extent), atol)
