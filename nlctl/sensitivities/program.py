"""The derivative of a whole program, as a program: flow, outputs, memories, samples and jumps.

Derivatives by each quantity are further states.  They flow with the linearized equations, become
with memories and samples what the derivative of these says, and jump at conditions and resets
(`saltation`).  So one run has them with the states, under the same error control.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..expressions.arrays import Tracer, as_array, scalar
from ..expressions.graph import Expr, Graph
from ..native import Compiled
from ..native.diagram.program import Program
from ..native.equations.blocks import Equations
from ..native.equations.located import Located
from ..native.settings import Settings
from .directions import Direction, SomeRows
from .ends import MemoryEnds
from .names import Observed, StatePlaces, VariedQuantity
from .saltation import Saltation
from .schedule import Extended, Sent, extended, has_constant_delays, with_derivatives
from .sides import KeptSides, sides_of
from .source import EquationParts, equation_parts
from .steep import without_stills

# How far behind a turn a step ends, of a step: as far as the root of the relative tolerance says,
# or as the part over which it is seen whether a memory turns.
_LATE, _AHEAD = 0.5, 1e-4
_MOVED = 1e3  # times what is known of a number: by less it is not moved
_RISE = 1e-3  # of what inputs go through: by more they do not rise where a step ends behind a turn
_PASSED = 1e-14  # of the times: break points of t that are as close are passed together


@dataclass(frozen=True, kw_only=True)
class Differentiated:
    """A diagram, compiled with its derivatives."""

    compiled: Compiled
    places: StatePlaces
    extended: Extended
    sides: KeptSides
    outputs: int  # number of the signals that are outputs
    saltation: Saltation
    touching: int  # number of what is watched for turning away where it is touched
    # derivatives of levels that a run was on, by the number of the quantity
    changes: dict[tuple[Expr, int], Expr | None] = field(default_factory=dict)


def parameters_with(
    extended_program: Extended,
    quantities: Sequence[VariedQuantity],
    p: np.ndarray,
    scale: np.ndarray,
    settings: Settings,
    span: tuple[float, float],
    rise: float = 1.0,
) -> np.ndarray:
    """Return all parameters of a program with derivatives."""
    size = extended_program.slot("rounding").offset + 1
    late = _LATE * max(np.sqrt(settings.rtol), _AHEAD) * (span[1] - span[0])
    rounding = _PASSED * max(map(abs, span))
    whole = np.concatenate([p, np.zeros(size - p.size)])
    layout = extended_program.layout
    for j in range(extended_program.groups):
        for i in range(extended_program.lines):
            slots = layout[extended_program.schedule.lines[extended_program.line(j, i)].block or 0]
            original = layout[extended_program.schedule.lines[i].block or 0]
            whole[slots["delay"].offset] = p[original["delay"].offset]
            if j < len(quantities) and quantities[j].place == original["before"].offset:
                whole[slots["before"].offset] = scale[j]
    given = {
        "scale": scale, "rtol": settings.rtol, "atol": settings.atol, "late": late,
        "steepest": _RISE * rise / late, "rounding": rounding,
    }  # fmt: skip
    for name, value in given.items():
        slot = extended_program.slot(name)
        whole[slot.offset : slot.offset + slot.size] = value
    return whole


def with_its_derivatives(
    compiled: Compiled,
    signals: Sequence[Observed],
    quantities: Sequence[VariedQuantity],
    p: np.ndarray,
    settings: Any,
) -> Differentiated:
    """Compile a diagram with its derivatives."""
    by = len(quantities)
    combinations = [s.combination for s in signals if s.combination is not None]
    sides = _sides(compiled, combinations, quantities, p, settings)
    source, extended_program = sides.source, sides.source.extended
    places = _places(sides, quantities)
    seeds = [_seed(source, places, j, quantity) for j, quantity in enumerate(quantities)]
    kept = [s.state for s in signals if s.state in source.driven]
    saltation = Saltation(source=source, sides=sides, places=places, seeds=seeds)
    ends = MemoryEnds(
        source=source, sides=sides, places=places, seeds=seeds, turns=saltation.turns,
        when=saltation.when,
    )  # fmt: skip
    maker = _Maker(
        source=source, sides=sides, places=places, seeds=seeds, observed=kept,
        saltation=saltation, ends=ends,
    )  # fmt: skip
    outputs = len(combinations) + len(kept)
    schedule = with_derivatives(compiled, extended_program, places.size, outputs * (1 + by), by)
    differentiated = replace(
        compiled, schedule=schedule, program=maker.program(), original=None, apart=None
    )
    differentiated.__dict__["equations"] = maker.equations()
    return Differentiated(
        compiled=differentiated, places=places, extended=extended_program, sides=sides,
        outputs=outputs, saltation=saltation,
        touching=len(saltation.turning) + len(ends.guards),
    )  # fmt: skip


def _sides(
    compiled: Compiled,
    combinations: Sequence[Any],
    quantities: Sequence[VariedQuantity],
    p: np.ndarray,
    settings: Any,
) -> KeptSides:
    """Return what a program is made of, with all that has to be sent through its delays."""
    by, n = len(quantities), compiled.system.nstates or 0
    delays = {compiled.program.layout[line.block or 0]["delay"].offset
              for line in compiled.schedule.lines}  # fmt: skip
    rated = any(quantity.place in delays for quantity in quantities)

    def sides_with(sent: Sent) -> KeptSides:
        room = extended(compiled, combinations, by, sent)
        whole = parameters_with(room, quantities, p, np.ones(by), settings, (0.0, 1.0))
        return sides_of(equation_parts(compiled, room, whole), n * (1 + by))

    returns = has_constant_delays(compiled)
    sides = sides_with(Sent.RATES if rated else Sent.JUMPS if returns else Sent.DERIVATIVES)
    switches = returns and sides.source.switches_by_delays
    if sides.source.drives_by_delays:
        return sides_with(Sent.TURNS)
    if switches and not rated:
        return sides_with(Sent.RATES)
    if returns and not (rated or sides.watches or compiled.program.guards):
        return sides_with(Sent.DERIVATIVES)  # nothing jumps
    return sides


def _places(sides: KeptSides, quantities: Sequence[VariedQuantity]) -> StatePlaces:
    """Return where a program has its states."""
    source, extended_program = sides.source, sides.source.extended
    sent, by = extended_program.sent, len(quantities)
    return StatePlaces(
        states=sum(size for _, size in source.flow), by=by, branches=sides.rows,
        lines=extended_program.lines if sent else 0, turns=sent >= Sent.TURNS,
        driven=len(source.driven),
        samples=len(source.program.sampled) * (1 + by) if source.driven else 0,
        delays=tuple(extended_program.is_delay(q.place) for q in quantities),
    )  # fmt: skip


def _seed(
    source: EquationParts, places: StatePlaces, j: int, quantity: VariedQuantity
) -> Direction:
    """Return the direction in which everything goes by a quantity."""
    graph, extended_program = source.graph, source.extended
    scale = source.setting("scale", j)

    def of_states(start: int, step: int, size: int | None) -> Expr | None:
        if start >= places.states:
            return None
        where = ("x", places.derivative(j) + start, step)
        return graph.node("leaf", data=where, size=size, varies=True)

    def of_inputs(start: int, step: int, size: int | None) -> Expr | None:
        if not 0 <= start - source.inputs < extended_program.lines:
            return None
        first = source.inputs + extended_program.line(j, start - source.inputs)
        change = graph.node("leaf", data=("u", first, step), size=size, varies=True)
        later = [
            float(places.delays[j][start - source.inputs + step * k]) for k in range(size or 1)
        ]
        if not any(later):
            return change
        # a signal that is later by dt is lower by its rate times dt
        first = source.inputs + extended_program.line(extended_program.rates, start - source.inputs)
        rate = graph.node("leaf", data=("u", first, step), size=size, varies=True)
        moves = graph.joined([(graph.const(part), 1) for part in later]) if size else None
        rate = rate if moves is None else graph.op("mul", rate, moves)
        return graph.op("sub", change, graph.op("mul", scale, rate))

    def of_parameters(start: int, step: int, size: int | None) -> Expr | None:
        rows = [start + step * i for i in range(size or 1)]
        if quantity.place not in rows:
            return None
        zero = graph.const(0.0)
        parts = [(scale if row == quantity.place else zero, 1) for row in rows]
        return graph.joined(parts) if size else scale

    return Direction(of={"x": of_states, "u": of_inputs, "p": of_parameters})


@dataclass(frozen=True, kw_only=True)
class _Maker:
    """Makes the program of derivatives from a source."""

    source: EquationParts
    sides: KeptSides
    places: StatePlaces
    seeds: Sequence[Direction]
    saltation: Saltation
    ends: MemoryEnds
    observed: Sequence[int]

    def program(self) -> Program:
        """Return the arrays of the program."""
        source, places = self.source, self.places
        before, by = source.program, places.by
        sampled = [places.derivative(j) + i for j in range(by) for i in before.sampled]
        program = replace(
            before,
            layout=source.extended.layout,
            switching=source.behind,
            guards=self._guards,
            jumping=self._jumping,
            sampled=(
                *before.sampled,
                *sampled,
                *([places.last, *range(places.chosen, places.ticked)] if before.sampled else []),
                *(range(places.ticked, places.size) if places.samples else []),
            ),
        )
        program.__dict__["meetings"] = before.meetings
        return program

    @property
    def _guards(self) -> tuple[int, ...]:
        """Whose the guards are: what jumps by a later one says more."""
        owner = self.source.extended.owner
        count = len(self.saltation.turning) + len(self.ends.guards)
        turning = [owner + 1] * len(self.saltation.moving)
        watching = [owner] * len(self.saltation.leaving)
        arriving = [owner + 3] * self.places.lines
        ours = [*[owner + 2] * count, *turning, *watching, *arriving]
        return (*ours, *self.source.program.guards)

    @property
    def _jumping(self) -> tuple[tuple[int, int, int], ...]:
        """Which states jump by whose guards."""
        places, before, owner = self.places, self.source.program, self.source.extended.owner
        n, first = places.states, places.kept + self.sides.first_memory
        memories = (first, first + len(before.memory))
        sent = [(places.number, places.arrived)] if places.lines else []
        jumping: list[tuple[int, tuple[int, int]]] = []
        for i, _, _ in before.jumping:
            rows = [(n, places.together), (places.grazing, places.touched), *sent]
            jumping += [(i, row) for row in rows]
        if self.sides.watches:
            jumping += [(owner, row) for row in [(n, places.last), *sent]]
        if self.source.driven:
            turning = [(m, m + 1) for m in self.saltation.at_turns()]
            rows = [*turning, memories, (places.touched, places.number)]
            jumping += [(owner + 1, row) for row in rows]
        if self.ends.guards or self.saltation.turning:
            rows = [(places.grazing, places.grazing + 1), (places.touched, places.cornered)]
            jumping += [(owner + 2, row) for row in rows]
        if places.lines:
            rows = [(n, places.kept), *([memories] if places.turns else [])]
            rows += [(places.together, places.grazing), (places.number, places.chosen)]
            jumping += [(owner + 3, row) for row in rows]
        return (*before.jumping, *((i, *row) for i, row in jumping))

    def equations(self) -> Equations:
        """Return what the program computes."""
        equations = self.source.equations
        located = (*self._declared(), *equations.conditions.located)
        located = tuple(replace(condition, bends=False) for condition in located)
        results: dict[str, list[tuple[int, Tracer]]] = {
            "dx": self._flow(),
            "g": self._switching(),
            "m": equations.results["m"],
            "y": self._outputs(),
        }
        jumping = self.sides.watches or self.source.driven or self.places.lines
        if equations.results.get("reset") or jumping:
            results["reset"] = self._resets()
        if "sharp" in equations.results:  # derivatives are as narrow as the functions themselves
            results["sharp"] = equations.results["sharp"]
        for name in equations.results:
            if name.startswith("sample"):
                results[name] = self._samples(name)
        return replace(
            equations, results=results, conditions=replace(equations.conditions, located=located)
        )

    def _declared(self) -> list[Located]:
        """Return what blocks without memories declare, to be located as conditions are."""
        # A kink of the states is a jump of the rates of their derivatives.
        functions = [self.source.switching[k] for k in self.source.ordered[self.source.behind :]]
        return [Located(function=e, block="", what="", bends=False) for e in functions]

    # -- results ---------------------------------------------------------------------------------

    def _along(self, pieces: Sequence[SomeRows], j: int) -> list[SomeRows]:
        """Return the derivatives of pieces by a quantity."""
        changes = self.source.changes([e for e, _ in pieces], self.seeds[j])
        return [(e, size) for e, (_, size) in zip(changes, pieces, strict=True)]

    def _rows(self, first: int, pieces: Sequence[SomeRows]) -> list[tuple[int, Tracer]]:
        """Return pieces as arrays with their rows."""
        rows, exprs = [], without_stills(self.source.graph, [e for e, _ in pieces])
        for expr, (_, size) in zip(exprs, pieces, strict=True):
            rows.append((first, _array(self.source.graph, expr, size)))
            first += size
        return rows

    def _flow(self) -> list[tuple[int, Tracer]]:
        pieces, places = list(self.source.exact_flow), self.places
        for j in range(places.by):
            pieces += self._along(self.source.flow, j)
        rest = places.size - places.kept
        return self._rows(0, [*pieces, (self.source.graph.const(0.0), rest)])

    def _outputs(self) -> list[tuple[int, Tracer]]:
        graph, pieces = self.source.graph, self.source.equations.pieces("y")
        count = sum(size for _, size in pieces) - sum(size for _, size in self.source.arriving)
        leading, arriving = _divided(graph, pieces, count)
        leading += [(self.source.driven[m], 1) for m in self.observed]
        shown = ((self._shown(leading, j), self._shown(arriving, j)) for j in range(self.places.by))
        parts = [(leading, arriving), *shown]
        rows = [p for k in (0, 1) for part in parts for p in part[k]]
        return self._rows(0, [*rows, *self.saltation.returning.arriving])

    def _shown(self, numbers: Sequence[SomeRows], j: int) -> list[SomeRows]:
        """Return the derivatives of numbers, of memories that are driven as they are kept."""
        return [(e, 1) for e in self.sides.kept([e for e, _ in self._along(numbers, j)])]

    def _switching(self) -> list[tuple[int, Tracer]]:
        source = self.source
        first = source.program.switching + source.equations.conditions.rows
        declared = [(source.switching[k], 1) for k in source.ordered]
        switching = self._rows(0, declared)
        switching += [
            (row, array)
            for row, array in source.equations.results["g"]
            if source.program.switching <= row < first and array.size
        ]
        rows = [*(apart for apart, _ in self.saltation.turning), *self.ends.guards]
        rows += [*self.saltation.moving, *self.saltation.leaving]
        rows += [*self.saltation.returning.guards, *source.guards]
        return [*switching, *self._rows(first, [(e, 1) for e in rows])]

    def _resets(self) -> list[tuple[int, Tracer]]:
        source, places = self.source, self.places
        resets = source.equations.results.get("reset", [])
        pieces = [p for _, array in resets for p in array.pieces()]
        guards: dict[int, list[Expr]] = {}
        for i, guard in zip(source.program.guards, source.guards, strict=True):
            guards.setdefault(i, []).append(guard)
        for (i, begin, _), (_, array) in zip(source.program.jumping, resets, strict=True):
            pieces += self.saltation.at_reset(begin, array.pieces(), guards[i])
        if self.sides.watches:
            pieces += self.saltation.at_conditions()
        reversed_levels = self.saltation.at_turns()
        if reversed_levels:
            pieces += [(e, 1) for e in reversed_levels.values()]
            pieces += self.sides.now[len(self.sides.sides) :]
            pieces += [(e, 1) for e in self.ends.at_turns]
        if self.saltation.turning or self.ends.guards:
            pieces.append((self.saltation.at_touch(), 1))
            pieces += [(e, 1) for e in self.ends.when_touched]
        if places.lines:
            pieces += self.saltation.at_arrival()
        return self._rows(0, pieces)

    def _samples(self, name: str) -> list[tuple[int, Tracer]]:
        graph, count = self.source.graph, len(self.source.program.sampled)
        samples = list(self.source.equations.results[name])
        for row, array in self.source.equations.results[name]:
            for j in range(self.places.by):
                samples += self._rows(row + count * (1 + j), self._along(array.pieces(), j))
        taken = [(row, array.size) for row, array in samples]
        now, behind = graph.leaf("t", 0, None), count * (1 + self.places.by)
        samples += self._rows(behind, [(now, 1), *self._when_chosen(name)])
        if not self.places.samples:
            return samples
        before, behind = self.saltation.turns.sampled, behind + 1 + self.places.by
        samples += self._rows(behind, [(now, 1)])
        for row, size in taken:
            earlier = [(graph.leaf("x", before[row + k], None), 1) for k in range(size)]
            samples += self._rows(behind + 1 + row, earlier)
        return samples

    def _when_chosen(self, name: str) -> list[SomeRows]:
        """Return when samples were first taken right at a kink or jump that each quantity moves."""
        graph, source, noise = self.source.graph, self.source, self.saltation.when.noise
        choices = source.choices(name)
        met = [graph.op("le", graph.op("absolute", e), noise(extent)) for e, extent in choices]
        least = [graph.op("mul", graph.const(_MOVED), noise(extent)) for _, extent in choices]
        rows: list[SomeRows] = []
        for place, seed in enumerate(self.seeds, self.places.chosen):
            changes = source.slopes([level for level, _ in choices], seed)
            moved = [
                graph.op("and", here, graph.op("gt", graph.op("absolute", change), seen))
                for here, change, seen in zip(met, changes, least, strict=True)
                if change is not None
            ]
            rows.append((source.first_time(place, source.any_of(moved)), 1))
        return rows


def _array(graph: Graph, expr: Expr, size: int) -> Tracer:
    """Return an expression as an array."""
    if size == 1:
        return scalar(graph, expr).reshape(1)
    return Tracer(graph, as_array(expr), 0, size)


def _divided(
    graph: Graph, pieces: Sequence[SomeRows], count: int
) -> tuple[list[SomeRows], list[SomeRows]]:
    """Return the first rows of pieces, and the others."""
    single = [(graph.item(e, k), 1) for e, size in pieces for k in range(size)]
    return single[:count], single[count:]
