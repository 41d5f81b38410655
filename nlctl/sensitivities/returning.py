"""Jumps that come back through delays: when, how far, and how the time of each moves.

What jumps at a time t* that moves jumps once more where it leaves a delay d, at t* + d, which moves
as well.  So behind each delayed signal more is sent the same way: how many such jumps there have
been, how far the signal has jumped last, and the derivatives of t*.  Where another number leaves a
delay than has left it before, a jump has arrived: the run ends a step there anyway, and what was
sent says what derivatives need (`saltation`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from ..expressions.bends import replaced_parts
from ..expressions.graph import Expr, Graph
from .directions import Cause, Direction, SomeRows, Taken, When, when_of
from .names import StatePlaces
from .schedule import Sent
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
