"""When something has happened: how the time moves at which sides were left, or a guard fell.

Jumps that come back through delays: when, how far, and how the time of each moves.

What jumps at a time t* that moves jumps once more where it leaves a delay d, at t* + d, which moves
as well.  So behind each delayed signal more is sent the same way: how many such jumps there have
been, how far the signal has jumped last, and the derivatives of t*.  Where another number leaves a
delay than has left it before, a jump has arrived: the run ends a step there anyway, and what was
sent says what derivatives need (`saltation`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from ..expressions.bends import replaced_parts
from ..expressions.dependence import reads
from ..expressions.graph import Expr, Graph
from .branches import bounded
from .directions import Cause, Direction, SomeRows, Taken, When, at_once, differ, when_of
from .names import StatePlaces
from .schedule import Sent
from .sides import KeptSides
from .source import EquationParts

_ANOTHER = 0.5  # of a number of jumps


@dataclass(frozen=True, kw_only=True)
class Returning:
    """What is known of jumps that delays have not let out yet; no lines if there are none."""

    source: EquationParts
    places: StatePlaces
    seeds: Sequence[Direction]

    @property
    def graph(self) -> Graph:
        """Where the expressions are kept."""
        return self.source.graph

    @property
    def guards(self) -> list[Expr]:
        """What falls through 0 where a jump leaves each line."""
        graph, one, fallen = self.graph, self.graph.const(1.0), self.graph.const(-1.0)
        lines = range(self.places.lines)
        return [graph.op("select", self._arrived(i), fallen, one) for i in lines]

    @property
    def rounding(self) -> Expr:
        """How close break points of t are that are passed at once."""
        return self.source.setting("rounding")

    @cached_property
    def when(self) -> When:
        """How the time moves at which jumps leave delays."""
        return when_of(self.graph, self.causes, self.places.by, self.rounding)

    @property
    def arrives(self) -> Expr | None:
        """Whether a jump leaves any line now, None if there are none."""
        every = [self._arrived(i) for i in range(self.places.lines)]
        return self.source.any_of(every) if every else None

    @property
    def causes(self) -> list[Cause]:
        """Which lines a jump has left, and how the time of that moves."""
        by, no = self.places.by, self.graph.const(False)
        return [
            Cause(
                met=self._arrived(i), grazes=no,
                moves=[self._move(j, i) for j in range(by)],
            )
            for i in range(self.places.lines)
        ]  # fmt: skip

    def earlier(self, exprs: Sequence[Expr]) -> list[Expr]:
        """Return expressions by what left the lines before the jumps that have just arrived."""
        graph, places, first = self.graph, self.places, self.source.inputs
        instead: dict[int, Expr] = {}
        for i in range(places.lines):
            now = self._leaving(-1, i)
            before = graph.op("add", now, self._leaving(places.by + 1, i))
            instead[first + i] = graph.op("select", self._arrived(i), before, now)
        return replaced_parts(graph, exprs, self.source.leaves(exprs, instead, "u"))

    def _move(self, j: int, i: int) -> Expr:
        """Return how the time at which a jump leaves a line moves by a quantity, its delay, too."""
        sent = self._leaving(self.places.by + 2 + j, i)
        if not self.places.delays[j][i]:
            return sent
        return self.graph.op("add", sent, self.source.setting("scale", j))

    def counts(self, when: When, sent: Sequence[Expr]) -> list[Expr]:
        """Return whether what is sent through each line jumps, at a time that moves."""
        # What is sent at any other time leaves a line at one that moves with its delay.
        rated = self.source.extended.sent >= Sent.RATES
        return [e if rated else self.graph.op("and", when.happens, e) for e in sent]

    def goes_on(self, i: int) -> Expr:
        """Return whether a corner that has left a delay arrives at a line at once."""
        lines = range(self.places.lines if self.places.turns else 0)
        arrived = [self._arrived(k) for k in lines if self.source.extended.direct[i, k]]
        return self.source.any_of(arrived)

    def sent(
        self,
        happens: Sequence[Expr],
        earlier: Sequence[Expr],
        now: Sequence[Expr],
        moves: Sequence[Expr],
        brought: Callable[[int, Sequence[Expr]], Sequence[Expr]],
    ) -> list[SomeRows]:
        """Return all that is sent of jumps, behind one that is sent where it `happens`."""
        # The derivatives of what was `earlier`, at the time that moves, are by a quantity what
        # `brought` makes of it.
        graph, places = self.graph, self.places
        if not places.lines:
            return []
        numbers = [self._state(places.number + i) for i in range(places.lines)]
        numbers = [graph.op("add", number, graph.const(1.0)) for number in numbers]
        heights = [graph.op("sub", a, b) for a, b in zip(earlier, now, strict=True)]
        rest = [e for j in range(places.by) for e in brought(j, earlier)] if places.turns else []
        any_happens = self.source.any_of(happens)
        new = [*zip(happens, numbers, strict=True), *zip(happens, heights, strict=True)]
        new += [(any_happens, move) for move in moves]
        new += [(happens[k % places.lines], e) for k, e in enumerate(rest)]
        return [
            (graph.op("select", if_sent, e, self._state(places.number + k)), 1)
            for k, (if_sent, e) in enumerate(new)
        ]

    @property
    def arrived(self) -> list[SomeRows]:
        """The numbers of jumps that have left the lines."""
        lines = range(self.places.lines)
        return [(self._leaving(self.places.by, i), 1) for i in lines]

    @property
    def arriving(self) -> list[SomeRows]:
        """What is sent through the lines behind the derivatives."""
        places, lines = self.places, range(self.places.lines)
        numbers = [places.number + i for i in lines]
        heights = [places.height + i for i in lines]
        moves = [places.moved + j for j in range(places.by) for _ in lines]
        sent = [(self._state(place), 1) for place in [*numbers, *heights, *moves]]
        if self.source.extended.sent >= Sent.RATES:
            sent += self._rates
        brought = range(places.by * places.lines if places.turns else 0)
        return [*sent, *[(self._state(places.brought + k), 1) for k in brought]]

    @property
    def _rates(self) -> list[SomeRows]:
        """The rates of what arrives at the lines, and where memories turn those of these."""
        source, places = self.source, self.places
        signals = source.single_arriving
        if not places.turns:
            forward = source.time(source.moving(source.flow, source.committed))
            return [(e, 1) for e in source.changes(signals, forward)]
        flow = source.moving(source.flow, source.committed)
        forward = source.time(source.flowing(flow, self.seeds))
        rates = source.changes(signals, forward)
        rows = [*rates, *source.changes(rates, forward)]
        for seed in self.seeds:
            rows += source.changes(source.changes(signals, seed), forward)
        return [(e, 1) for e in rows]

    def bringing(self, j: int, of: Mapping[str, Taken]) -> Mapping[str, Taken]:
        """Return a direction in which what is `earlier` goes by a quantity as it was brought."""
        # It is what leaves a line now and its height, so the height goes as the rest of it does.
        graph, source, places = self.graph, self.source, self.places
        heights = source.inputs + source.extended.line(places.by + 1, 0)
        if not places.turns:
            return of

        def of_inputs(start: int, step: int, size: int | None) -> Expr | None:
            i = start - heights
            if not 0 <= i < places.lines:
                return of["u"](start, step, size)
            now = of["u"](source.inputs + i, 1, None) or graph.const(0.0)
            return graph.op("sub", self._leaving(source.extended.brought + j, i), now)

        return {**of, "u": of_inputs}

    def _state(self, place: int) -> Expr:
        return self.graph.leaf("x", place, None)

    def _leaving(self, group: int, i: int) -> Expr:
        """Return what leaves line `i` of a group: -1 has the signals, then `Extended.line`."""
        return self.graph.leaf("u", self.source.inputs + self.source.extended.line(group, i), None)

    def _arrived(self, i: int, more_than: float = _ANOTHER) -> Expr:
        """Return whether a jump leaves a line now, or more than one."""
        graph, places = self.graph, self.places
        apart = graph.op("sub", self._leaving(places.by, i), self._state(places.arrived + i))
        return graph.op("gt", graph.op("absolute", apart), graph.const(more_than))

    @property
    def several(self) -> Expr:
        """Whether more than one jump leaves a line now, of which only the last is known."""
        lines = range(self.places.lines)
        return self.source.any_of([self._arrived(i, 1.0 + _ANOTHER) for i in lines])


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
