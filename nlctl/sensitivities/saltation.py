"""How derivatives jump where something happens at a time that moves with what they are taken by.

At a time t* the states become x+ = R(x-), and flow with f- before and f+ behind.  Derivatives at
a fixed time, S, then jump to

    S+ = R' (S- + f- t*') - f+ t*',     t*' = -(g_x S- + g_p) / (g_x f- + g_t),

where R' takes time and parameters along, g(t*, x-) = 0 says when it happens, and ' is the
derivative by what S is taken by (Aizerman, Gantmakher, Quarterly Journal of Mechanics and Applied
Mathematics 11, 1958; Filippov, Differential Equations with Discontinuous Righthand Sides, 1988:
both by name only).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial, reduce

from ..expressions.bends import replaced_parts
from ..expressions.graph import Expr, Graph, needed
from .directions import Direction, SomeRows, Taken, at_once, rows_replaced
from .moving_times import Returning, TimesThatMove
from .names import StatePlaces
from .sides import KeptSide, KeptSides
from .source import EquationParts
from .turns import DrivenMemories

_NOTICED = 1e-7  # of the rates: a smaller jump is rounding
_UNSEEN = 1e3  # times the absolute tolerance: jumps that nobody sees
_FAR = 1e300
_WAY = "way"  # the array that stands for the derivatives of the states
_NOW = "now"  # and the one for memories behind a jump
_STILL = 1e-4  # of squares of what is known of a number: it does not move


@dataclass(frozen=True, kw_only=True)
class Saltation:
    """How derivatives jump at conditions and resets."""

    source: EquationParts
    sides: KeptSides
    places: StatePlaces
    seeds: Sequence[Direction]  # in which direction everything goes by each quantity

    def at_conditions(self) -> list[SomeRows]:
        """Return what follows the states where a side has been left."""
        source, graph, places = self.source, self.source.graph, self.places
        arriving = self.sides.earlier(source.single_arriving)
        before = source.moving(self.sides.flow_before, self.sides.earlier(source.committed))
        behind = source.moving(source.flow, source.committed)
        sent = self._sent(self._seen(arriving, before), self._seen(source.single_arriving, behind))
        jumps = self._differ([(e, piece) for (e, _), piece in zip(before, behind, strict=True)])
        switches = [self._switches(m) for m in source.catching]
        flows = source.any_of([jumps, *switches])
        when = self.when.left(source.any_of([flows, *sent]), flows)
        rows: list[SomeRows] = []
        for j, move in enumerate(when.moves):
            states, broken = [], graph.op("or", when.grazes, when.apart[j])
            for (s, size), (a, _), (b, _) in zip(self._states(j), before, behind, strict=True):
                if a is not b:
                    s = graph.op("add", s, graph.op("mul", graph.op("sub", a, b), move))
                states.append((s, size))
            across = self._across(j, before, behind, move, self._driving)
            for s, size in rows_replaced(graph, states, across):
                rows.append((graph.op("select", broken, graph.const(0.0), s), size))
        rows += self.sides.now
        moves = self.returning.counts(when, sent)
        happens = [(e, 1) for e in (*when.apart, when.grazes, self.source.any_of(moves))]
        brought = self._brought(before, when.moves)
        sent_rows = self.returning.sent(
            moves, arriving, source.single_arriving, when.moves, brought
        )  # fmt: skip
        behind_all = self._behind_breaks([*rows, *happens, *sent_rows])
        first, behind_rows = len(rows) + len(happens), behind_all[: len(rows)]
        *apart, grazes, jumped = [e for e, _ in behind_all[len(rows) : first]]
        return [
            *behind_rows, *self._first_times(places.together, apart),
            (self.source.first_time(places.grazing, grazes), 1),
            (self._lost_in_delay(jumped), 1), *behind_all[first:],
        ]  # fmt: skip

    def _first_times(self, place: int, happens: Sequence[Expr]) -> list[SomeRows]:
        """Return when some things have first happened, by their states from a place on."""
        return [(self.source.first_time(place + j, e), 1) for j, e in enumerate(happens)]

    def _seen(self, arriving: Sequence[Expr], flow: Sequence[SomeRows]) -> list[list[Expr]]:
        """Return what may jump of what arrives at each delay: rates, too, if memories follow it."""
        rates = self.places.turns and self.source.changes(arriving, self.source.time(flow))
        return [list(pair) for pair in zip(arriving, *([rates] if rates else []), strict=True)]

    def _sent(
        self,
        earlier: Sequence[Sequence[Expr]],
        now: Sequence[Sequence[Expr]],
        unseen: Expr | None = None,
    ) -> list[Expr]:
        """Return whether what arrives at each delay jumps."""
        pairs = [
            zip(a, [(e, 1) for e in b], strict=True) for a, b in zip(earlier, now, strict=True)
        ]
        return [
            self.source.any_of([self._differ([pair], unseen) for pair in line]) for line in pairs
        ]

    def _behind_breaks(self, rows: Sequence[SomeRows]) -> list[SomeRows]:
        """Return numbers as they are behind all break points of t that are passed at once."""
        # Only what is of t alone: what states have just crossed could be as near.
        graph, t = self.source.graph, self.source.graph.leaf("t", 0, None)
        behind = graph.op("add", t, self.returning.rounding)
        timed = [side for side in self.sides.sides if side.timed]
        nodes = [e for s in timed for e in (s.node, s.here.now, s.before.now) if e is not None]
        later = dict(zip(nodes, replaced_parts(graph, nodes, {t: behind}), strict=True))
        exprs = replaced_parts(graph, [e for e, _ in rows], later)
        return [(e, size) for e, (_, size) in zip(exprs, rows, strict=True)]

    def at_reset(
        self, begin: int, states: Sequence[SomeRows], guards: Sequence[Expr]
    ) -> list[SomeRows]:
        """Return what follows the states where a block jumps."""
        source, graph, places = self.source, self.source.graph, self.places
        before = self._before_all
        rows: dict[int, Expr] = {}
        for expr, size in states:
            rows |= {begin + len(rows): graph.item(expr, k) for k in range(size)}
        rows |= self._driven_after(rows)
        behind = self._after(rows, source.moving(source.flow, source.committed))
        flow = source.moving(source.flow, source.committed)
        lines = self._seen(source.single_arriving, flow)
        later = [[e for e, _ in self._after(rows, [(e, 1) for e in line])] for line in lines]
        earlier = self._earlier(source.single_arriving)
        # what is reset to where it has fallen has moved by as little as a step ends behind that
        unseen = graph.op("mul", graph.const(_UNSEEN), source.setting("atol"))
        sent = self._sent(self._seen(earlier, before), later, unseen)
        when, together = self.when.reset(guards)
        after: list[SomeRows] = []
        for j, move in enumerate(when.moves):
            broken = graph.op("or", when.grazes, together[j])
            after += self._jumped(j, rows, before, behind, move, broken)
        sides = self.sides.now[: len(self.sides.sides)]
        after += self._after(rows, sides)
        for m, kept in self.sides.memories.items():
            (stands,) = self.sides.kept([rows.get(m, kept)])
            after.append((graph.leaf("x", m, None) if m in source.switched else stands, 1))
        after.append((self.source.first_time(places.grazing, when.grazes), 1))
        moves = self.returning.counts(when, sent)
        after.append((self._lost_in_delay(self.source.any_of(moves)), 1))
        after.append((graph.leaf("t", 0, None), 1))
        after += self._first_times(places.at_reset, together)
        after.append((graph.op("neg", graph.leaf("x", places.parity, None)), 1))
        brought = self._brought(before, when.moves)
        now = [line[0] for line in later]
        return [*after, *self.returning.sent(moves, earlier, now, when.moves, brought)]

    def _brought(
        self, before: Sequence[SomeRows], moves: Sequence[Expr]
    ) -> Callable[[int, Sequence[Expr]], list[Expr]]:
        """Return what has the derivatives of numbers right before a time that moves."""

        def rows(j: int, exprs: Sequence[Expr]) -> list[Expr]:
            _, of = self._arriving(j, before, moves[j])
            return self._through(exprs, self.returning.bringing(j, of), moves[j])

        return rows

    def at_arrival(self) -> list[SomeRows]:
        """Return what follows the states where a jump leaves a delay."""
        source, graph, returning = self.source, self.source.graph, self.returning
        when, before = self.returning.when, self._before_all
        behind = source.moving(source.flow, source.committed)
        driving, rows = returning.earlier(self._driving), []
        for j, move in enumerate(when.moves):
            states = []
            for (s, size), (a, _), (b, _) in zip(self._states(j), before, behind, strict=True):
                moved = graph.op("add", s, graph.op("mul", graph.op("sub", a, b), move))
                states.append((moved, size))
            if self.places.turns:
                across = self._across(j, before, behind, move, driving)
                states = rows_replaced(graph, states, across)
            apart = when.apart[j]
            rows += [(graph.op("select", apart, graph.const(0.0), s), n) for s, n in states]
        if self.places.turns:
            rows += self.sides.now[len(self.sides.sides) :]
        others = at_once(graph, when, self.when.left(graph.const(True)), returning.rounding)
        together = [
            reduce(partial(graph.op, "or"), (apart, other, returning.several))
            for apart, other in zip(when.apart, others, strict=True)
        ]
        rows += self._first_times(self.places.together, together)
        arriving = self._earlier(source.single_arriving)
        sent = self._sent([[e] for e in arriving], [[e] for e in source.single_arriving])
        sent = [graph.op("or", e, returning.goes_on(i)) for i, e in enumerate(sent)]
        moves = self.returning.counts(when, sent)
        brought = self._brought(before, when.moves)
        rows += returning.sent(moves, arriving, source.single_arriving, when.moves, brought)
        return [*rows, *returning.arrived]

    def _earlier(self, exprs: Sequence[Expr]) -> list[Expr]:
        """Return expressions as they were before jumps, those that have just left delays, too."""
        return self.returning.earlier(self.sides.earlier(exprs))

    @cached_property
    def _before_all(self) -> list[SomeRows]:
        """The rates of all states before jumps, those that have just left delays, too."""
        source = self.source
        flow = self._earlier([e for e, _ in source.flow])
        pieces = [(e, size) for e, (_, size) in zip(flow, source.flow, strict=True)]
        return source.moving(pieces, self._earlier(source.committed))

    def _lost_in_delay(self, moves: Expr) -> Expr:
        """Return when a jump whose time moves was first sent through delays that do not keep it."""
        never = self.source.graph.const(False)
        return self.source.first_time(self.places.jumped, never if self.places.lines else moves)

    @cached_property
    def when(self) -> TimesThatMove:
        """What may happen at a time that moves."""
        return TimesThatMove(
            source=self.source, sides=self.sides, places=self.places, seeds=self.seeds,
            returning=self.returning,
        )  # fmt: skip

    @cached_property
    def returning(self) -> Returning:
        """Jumps that come back through delays."""
        return Returning(source=self.source, places=self.places, seeds=self.seeds)

    @cached_property
    def turning(self) -> list[tuple[Expr, Expr]]:
        """What falls through 0 where a level turns away from 0, and whether it has touched it."""
        # That is where d(level^2) / dt rises through 0: at conditions that are met, and where one
        # is nearly met. With memories that switch, what is at rest has levels that are noise, and
        # nothing is looked for.
        graph, turns = self.source.graph, []
        for side in () if self.source.switched else self.sides.sides:
            for k in range(0 if side.timed else side.rows):
                level, extent = (graph.item(e, k) for e in (side.here.level, side.here.extent))
                yes = self._jumps_at(side)
                rate, cause = self.when.met(yes, level, extent, self.source.flow)
                if rate is None:
                    continue
                noise = self.when.noise(extent)
                still = graph.op("mul", graph.const(_STILL), graph.op("mul", noise, noise))
                apart = graph.op("sub", still, graph.op("mul", level, rate))
                near = graph.op("le", graph.op("absolute", level), noise)
                touched = graph.op("and", near, cause.grazes)
                turns.append((apart, graph.op("and", touched, cause.met)))
        return turns

    def _jumps_at(self, side: KeptSide) -> Expr:
        """Return whether the flow would be another on the other side of a comparison."""
        graph, node = self.source.graph, side.node
        if node is None or node.kind != "b":
            return graph.const(True)
        flow = self.source.flow
        exprs = replaced_parts(graph, [e for e, _ in flow], {node: graph.op("not", node)})
        return self._differ([(e, piece) for e, piece in zip(exprs, flow, strict=True)])

    def at_touch(self) -> Expr:
        """Return when a condition was first touched, where a level has reversed."""
        touched = self.source.any_of([touch for _, touch in self.turning])
        return self.source.first_time(self.places.grazing, touched)

    @cached_property
    def turns(self) -> DrivenMemories:
        """Derivatives of memories that are driven."""
        return DrivenMemories(
            source=self.source, sides=self.sides, places=self.places, seeds=self.seeds
        )  # fmt: skip

    def at_turns(self) -> dict[int, Expr]:
        """Return what derivatives of memories become where these turn, by their states."""
        places, driven = self.places, self.source.driven
        return {
            places.derivative(j) + m: self.turns.kept(j, m, at_turn=True)
            for j in range(places.by)
            for m in driven
        }

    @cached_property
    def leaving(self) -> list[Expr]:
        """What falls below 0 where a side is left, if there are any."""
        if not self.sides.watches:
            return []
        return self._alternating(self.sides.margin, bool(self.source.switched))

    @cached_property
    def moving(self) -> list[Expr]:
        """What falls below 0 where a memory that is driven is not where it was, if any is."""
        driven = bool(self.source.driven)
        return self._alternating(self.sides.driven, driven) if driven else []

    def _alternating(self, guard: Expr, by_resets: bool) -> list[Expr]:
        """Return a guard that a reset may leave below 0, or two that watch in turn if it may."""
        # A guard falls again only when it has risen.  As a block resets, one may fall by what has
        # moved a memory until then, and the reset moves that at once: there the other falls.
        if not (by_resets and self.source.guards):
            return [guard]
        graph, one = self.source.graph, self.source.graph.const(1.0)
        odd = graph.op("lt", graph.leaf("x", self.places.parity, None), graph.const(0.0))
        return [graph.op("select", odd, one, guard), graph.op("select", odd, guard, one)]

    @cached_property
    def at_start(self) -> list[dict[int, Expr]]:
        """By quantity the derivatives of memories that a run begins by driving, by their states."""
        committed = dict(zip(self.source.program.memory, self.source.committed, strict=True))
        become = {m: committed[m] for m in (*self.source.driven, *self.source.catching)}
        rows = [self.source.changes(list(become.values()), seed) for seed in self.seeds]
        return [dict(zip(become, changes, strict=True)) for changes in rows]

    # -- states ----------------------------------------------------------------------------------

    def _states(self, j: int) -> list[SomeRows]:
        """Return the derivatives of all states by a quantity, in the pieces of the flow."""
        graph, row, pieces = self.source.graph, self.places.derivative(j), []
        for _, size in self.source.flow:
            pieces.append((graph.leaf("x", row, size if size > 1 else None), size))
            row += size
        return rows_replaced(graph, pieces, {m: self.turns.kept(j, m) for m in self.source.driven})

    def _jumped(
        self,
        j: int,
        rows: dict[int, Expr],
        before: Sequence[SomeRows],
        behind: Sequence[SomeRows],
        move: Expr,
        broken: Expr,
    ) -> list[SomeRows]:
        """Return R' (S + f- t*') - f+ t*' of all states."""
        graph = self.source.graph
        arriving, of = self._arriving(j, before, move)
        exprs = self.source.with_states(list(rows.values()), self._switched)
        changes = dict(zip(rows, self._through(exprs, of, move), strict=True))
        state, left = graph.joined(arriving), graph.joined(list(behind))
        jumped = []
        for k in range(self.places.states):
            moved = changes[k] if k in changes else graph.item(state, k)
            moved = graph.op("sub", moved, graph.op("mul", graph.item(left, k), move))
            jumped.append((graph.op("select", broken, graph.const(0.0), moved), 1))
        return jumped

    def _arriving(
        self, j: int, before: Sequence[SomeRows], move: Expr
    ) -> tuple[list[SomeRows], dict[str, Taken]]:
        """Return where all states go at the time that moves, S + f- t*', and everything."""
        graph, seed = self.source.graph, self.seeds[j]
        arriving = [
            (graph.op("add", s, graph.op("mul", a, move)), size)
            for (s, size), (a, _) in zip(self._states(j), before, strict=True)
        ]
        moving = self.source.time(arriving, self._time)
        of = {**seed.of, **moving.of, "u": _sum(graph, seed.of["u"], moving.of["u"])}
        return arriving, of

    def _across(
        self,
        j: int,
        before: Sequence[SomeRows],
        behind: Sequence[SomeRows],
        move: Expr,
        driving: Sequence[Expr],
    ) -> dict[int, Expr]:
        """Return the derivatives of memories behind a jump, by their states."""
        # What drives them may jump there: first they are what has driven them until then.
        graph, source, driven = self.source.graph, self.source, self.source.driven
        if not driven and not source.catching:
            return {}
        becomes = list(driven.values())
        earlier = dict(zip(driven, driving, strict=True))
        now = {**self._switched, **source.catching, **earlier}
        after = [*source.with_states(becomes, now), *source.catching.values()]
        _, of = self._arriving(j, before, move)
        changes = self._through(after, self.returning.bringing(j, of), move)
        left = graph.joined(list(behind))
        rows = {
            m: graph.op("sub", change, graph.op("mul", graph.item(left, m), move))
            for m, change in zip(driven, changes, strict=False)
        }
        for m, change in zip(source.catching, changes[len(driven) :], strict=True):
            still = graph.leaf("x", self.places.derivative(j) + m, None)
            rows[m] = graph.op("select", self._switches(m), change, still)
        return rows

    @property
    def _switched(self) -> dict[int, Expr]:
        """What stands for memories that switch, as they are now, by their states."""
        graph = self.source.graph
        return {
            m: graph.node("leaf", data=(_NOW, m, 0), size=None, varies=True)
            for m in self.source.switched
        }

    @cached_property
    def _driving(self) -> list[Expr]:
        """What has driven memories until something has jumped."""
        becomes = list(self.source.driven.values())
        return replaced_parts(self.source.graph, becomes, self.sides.before)

    def _switches(self, m: int) -> Expr:
        """Return whether a memory has just become another."""
        return self.source.graph.op(
            "ne", self.source.graph.leaf("x", m, None), self.sides.memories[m]
        )

    @property
    def _time(self) -> Expr:
        """What stands for the derivative of the time."""
        return self.source.graph.node("leaf", data=(_WAY, -1, 0), size=None, varies=True)

    def _through(self, exprs: Sequence[Expr], of: Mapping[str, Taken], move: Expr) -> list[Expr]:
        """Return the derivatives of expressions, with memories as they are kept."""
        # The derivatives of the states and of the time are put in last: what they say of memories
        # stays.
        graph, source = self.source.graph, self.source

        def place(start: int, step: int, size: int | None) -> Expr | None:
            if start >= self.places.states:
                return None
            return graph.node("leaf", data=(_WAY, start, step), size=size, varies=True)

        zero = graph.const(0.0)
        kept = self.sides.kept(source.changes(exprs, Direction(of={**of, "x": place})))
        leaves = [e for e in needed(kept) if e.op == "leaf" and e is not self._time]
        ways = {
            leaf: of["x"](leaf.data[1], leaf.data[2], leaf.size) or zero
            for leaf in leaves
            if leaf.data[0] == _WAY
        }
        ways |= {e: graph.leaf("x", e.data[1], None) for e in leaves if e.data[0] == _NOW}
        ways[self._time] = move
        return replaced_parts(graph, kept, ways)

    def _driven_after(self, rows: dict[int, Expr]) -> dict[int, Expr]:
        """Return driven memories after a jump of other states."""
        # First they are what has driven them until then, or what they are reset to.
        driven = self.source.driven
        driving = self.returning.earlier(self._driving)
        return {
            m: self.source.with_states([become], {m: earlier, **rows})[0]
            for (m, become), earlier in zip(driven.items(), driving, strict=True)
        }

    def _after(self, rows: dict[int, Expr], pieces: Sequence[SomeRows]) -> list[SomeRows]:
        """Return expressions behind a jump of some states, and what memories switch to by it."""
        source, driven = self.source, self.source.driven
        rows = {k: self.sides.kept([e])[0] if k in driven else e for k, e in rows.items()}
        held = [
            (m, c) for m, c in zip(source.program.memory, source.committed, strict=True)
            if m in source.switched
        ]  # fmt: skip
        switched = source.with_states([c for _, c in held], rows)
        instead = {**rows, **dict(zip((m for m, _ in held), switched, strict=True))}
        changed = source.with_states([e for e, _ in pieces], instead)
        return [(e, size) for e, (_, size) in zip(changed, pieces, strict=True)]

    def _differ(self, pairs: Sequence[tuple[Expr, SomeRows]], unseen: Expr | None = None) -> Expr:
        """Return whether expressions differ by more than rounding, or than what is not seen."""
        graph = self.source.graph
        apart = extent = graph.const(0.0)
        for a, (b, size) in pairs:
            if a is b:
                continue
            sizes = [graph.op("absolute", e) for e in (graph.op("sub", a, b), a, b)]
            parts = [graph.sum(e, size) if size > 1 else e for e in sizes]
            apart = graph.op("add", apart, parts[0])
            extent = graph.op("add", extent, graph.op("add", *parts[1:]))
        least = graph.op("mul", graph.const(_NOTICED), extent)
        return graph.op("gt", apart, least if unseen is None else graph.op("add", least, unseen))


def _sum(graph: Graph, one: Taken, other: Taken) -> Taken:
    """Return the sum of two directions."""

    def both(start: int, step: int, size: int | None) -> Expr | None:
        a, b = one(start, step, size), other(start, step, size)
        return graph.op("add", a, b) if a is not None and b is not None else a or b

    return both
