"""A schedule as expressions: blocks traced, wired, loops solved, what cannot be traced called."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import control as ct
import numpy as np

from ...blocks import supplied_of
from ...errors import CompileError
from ...expressions.arrays import Tracer, concatenated, full, leaf_vector
from ...expressions.graph import Ambiguous, Expr, Graph, Untraceable
from ...expressions.trace import trace
from ...responses.watched import watches_nan
from ...sampling.system import Happening
from ...sliding.relay import SLIDING
from ...upstream.systems import System
from ...wording import counted
from ..codegen.solver import Solver
from ..diagram.parameters import length
from ..diagram.program import count_guards, count_switching_functions, memory
from ..diagram.schedule import Schedule, during
from ..diagram.trace import time
from ..opaque.called import Call
from .located import Conditions, Located, found_conditions
from .reader import Reader, vector_of
from .relays import slide_places, with_sliding
from .slides import with_slides


@dataclass(frozen=True, kw_only=True)
class Equations:
    """What a diagram computes."""

    graph: Graph
    # for ``"dx"``, ``"g"``, ``"m"`` and ``"y"`` pairs of a row and the array that is to be written
    # there.  For ``"sample0"`` and so on those of sampled blocks' next states, at each meeting, and
    # for ``"reset"`` the states after jumps of all blocks with guards, if any, and for ``"sharp"``
    # by what sharp functions are measured, if there are such
    results: dict[str, list[tuple[int, Tracer]]]
    calls: dict[str, Call]  # opaque functions by name
    solvers: dict[str, Solver]  # searches for the signals of algebraic loops, by name
    # by the same names: what the blocks of a loop make of the signals found, in their expressions;
    # they are equal to these
    fixed_points: dict[str, list[Expr]]
    # what the equations switch at, and no block declares
    conditions: Conditions = field(default_factory=Conditions)
    # functions in which a loop may take more passes than are written out, and is NaN then: places
    # of their blocks, and kinds
    cut: frozenset[tuple[int, str]] = frozenset()

    def pieces(self, name: str) -> list[tuple[Expr, int]]:
        """Return the expressions of some results, row by row, each with its length."""
        return [piece for _, array in self.results[name] for piece in array.pieces()]


class _Events(NamedTuple):
    """What blocks and the run declare, as rows of their first numbers and these numbers."""

    declared: list[tuple[int, Tracer]]  # switching functions
    guards: dict[int, tuple[int, Tracer]]  # by their blocks' places
    committed: dict[int, tuple[int, Tracer]]  # what memories become, likewise
    watched: list[Located]  # functions of the run


def equations(
    schedule: Schedule, layout: Any, p: np.ndarray | None = None, meetings: Sequence[Happening] = ()
) -> Equations:
    """Write a schedule as expressions."""
    system = schedule.system
    sizes = {"t": 1, "x": system.nstates or 0, "u": schedule.ninputs, "p": length(layout)}
    graph = Graph(sizes, schedule.small)
    reader = Reader(
        graph=graph, layout=layout, blocks=schedule.nodes, p=p,
        samplings={id(h.system): i for i, h in enumerate(schedule.holders)},
        supplied=_behind_delays(graph, schedule) | _of_slides(graph, schedule),
    )  # fmt: skip
    with np.errstate(all="ignore"):  # NumPy would warn of NaN that inputs have that are not known
        reader = with_sliding(reader, schedule)
        reader.read(schedule)
        rates = [reader.derivatives(i) for i in range(len(schedule.nodes))]
        y = reader.wired(schedule.outputs)
        events = _events(reader, schedule)
        switches = _conditions(schedule.system, reader, rates, y, events)
        switches = replace(switches, located=(*switches.located, *events.watched))
        falls = [(row + switches.rows, guard) for row, guard in events.guards.values()]
        results = {
            "dx": [(n.state_offset, rates[i]) for i, n in enumerate(schedule.nodes)],
            "g": events.declared + _located(reader, switches) + falls,
            "m": list(events.committed.values()),
            "y": [(0, y)],
        }
        if events.guards:
            sizes_of_guarded = [n.size if count_guards(n) else 0 for n in reader.blocks]
            results["reset"] = list(_in_rows(sizes_of_guarded, reader.resets).values())
        if switches.sharp:
            results["sharp"] = _rows_of(graph, (argument.expr for argument in switches.sharp))
        results = reader.all_known(results)
        for k, what in enumerate(meetings):
            at_instant = during(schedule, what)
            then = replace(reader, blocks=at_instant.nodes, what=what, signals={}, solved=[])
            then.read(at_instant)
            results |= then.all_known({f"sample{k}": _next(then)})
        results, switches = with_slides(reader, schedule, results, switches)
    return Equations(
        graph=reader.graph, results=results, calls=reader.calls, solvers=reader.solvers,
        fixed_points=reader.fixed_points, conditions=switches, cut=frozenset(reader.cut),
    )  # fmt: skip


def _behind_delays(graph: Graph, schedule: Schedule) -> dict[int, Tracer]:
    """Return what leaves transport delays, by block: inputs behind those of the diagram."""
    first, signals = schedule.system.ninputs or 0, {}
    for k, line in enumerate(schedule.lines):
        i = line.block or 0
        if line.index == 0:
            shape = (schedule.nodes[i].system.noutputs,)
            signals[i] = leaf_vector(graph, "u", first + k, shape)
    return signals


def _of_slides(graph: Graph, schedule: Schedule) -> dict[int, Tracer]:
    """Return outputs of relays that stand for conditions: no signal is made of them."""
    return {i: full(graph, 1, 0.0) for i in slide_places(schedule.nodes)}


def _conditions(
    system: System, reader: Reader, rates: Sequence[Tracer], y: Tracer, events: _Events
) -> Conditions:
    """Return what a diagram in continuous time switches at without saying so."""
    # Also what moves nothing but an event function: a guard, a memory, a function of the run.
    if not ct.isctime(system):
        return Conditions()
    falls = {i: guard for i, (_, guard) in events.guards.items()}
    signs = [array for _, array in events.declared]
    kept = [array for _, array in events.committed.values()]
    others = [e for array in (y[system.noutputs or 0 :], *kept) for e, _ in array.pieces()]
    given = [watch.function for watch in events.watched if not watches_nan(watch.what)]
    shown = [e for e, _ in y[: system.noutputs or 0].pieces()]
    return found_conditions(reader, rates, signs, falls, others, given, shown)


def _located(reader: Reader, switches: Conditions) -> list[tuple[int, Tracer]]:
    """Return the switching functions of conditions with their rows, behind those declared."""
    row = sum(count_switching_functions(node) for node in reader.blocks)
    return _rows_of(reader.graph, (one.function for one in switches.located), row)


def _rows_of(graph: Graph, exprs: Iterable[Expr], row: int = 0) -> list[tuple[int, Tracer]]:
    """Return expressions as arrays with their rows, from one on."""
    arrays = []
    for expr in exprs:
        arrays.append((row, vector_of(graph, expr)))
        row += expr.size or 1
    return arrays


def _in_rows(
    counts: Iterable[int], read: Callable[[int], Tracer | None], row: int = 0
) -> dict[int, tuple[int, Tracer]]:
    """Return what blocks with so many numbers have, by their places, with rows from one on."""
    arrays = {}
    for i, count in enumerate(counts):
        if count and (array := read(i)) is not None:
            arrays[i] = (row, array)
        row += count
    return arrays


def _next(reader: Reader) -> list[tuple[int, Tracer]]:
    """Return the next states of sampled blocks to which something happens, with their rows."""

    def states(i: int) -> Tracer | None:
        sampled = reader.blocks[i].sampled
        return reader.next_states(i) if sampled and sampled.acts(reader.what) else None

    return list(_in_rows([n.size if n.sampled else 0 for n in reader.blocks], states).values())


def _events(reader: Reader, schedule: Schedule) -> _Events:
    """Return what blocks and the run declare."""
    counts = [count_switching_functions(node) for node in reader.blocks]
    kept = [len(memory(node)) for node in reader.blocks]
    events = {i: reader.events(i) for i in range(len(counts)) if counts[i] or kept[i]}
    committed = _in_rows(kept, lambda i: events[i][counts[i] :])
    return _Events(
        declared=list(_in_rows(counts, lambda i: events[i][: counts[i]]).values()),
        guards=_in_rows(map(count_guards, reader.blocks), reader.guards, sum(counts)),
        committed=committed,
        watched=_watched(reader, schedule, {i: become for i, (_, become) in committed.items()}),
    )


def _watched(reader: Reader, schedule: Schedule, become: Mapping[int, Tracer]) -> list[Located]:
    """Return functions that a run watches, as conditions located like those of the equations."""
    graph, system = reader.graph, schedule.system
    rows = []
    for watch in schedule.watched:

        def arguments() -> tuple:
            u = leaf_vector(graph, "u", 0, (system.ninputs or 0,))
            return time(graph), _states_now(reader, schedule, become), u, dict(schedule.overrides)

        try:
            value = trace(graph, partial(watch.function), arguments)
            if value.size != 1:
                raise Untraceable(f"it returns {counted(value.size, 'number')}, not one")
        except (Untraceable, Ambiguous) as error:
            raise CompileError(
                f"event function '{watch.name}' cannot be compiled: {error}; "
                "engine='python-control' calls it unchanged"
            ) from None
        function = graph.number(value.reshape(-1)[0].only)
        rows.append(Located(function=function, block="", what=watch.name, bends=False))
    return rows


def _states_now(reader: Reader, schedule: Schedule, become: Mapping[int, Tracer]) -> Tracer:
    """Return all states within a step, with what memories `become` by then, by blocks' places."""
    graph, at, parts = reader.graph, 0, []
    known = {  # an ideal relay's mode does not follow from the states
        place: values[k : k + 1]
        for i, values in become.items() if supplied_of(reader.blocks[i].system) is not SLIDING
        for k, place in enumerate(memory(reader.blocks[i]))
    }  # fmt: skip
    for place in sorted(known):
        parts += [leaf_vector(graph, "x", at, (place - at,)), known[place]]
        at = place + 1
    slides = len(slide_places(reader.blocks))  # no states of the diagram
    rest = leaf_vector(graph, "x", at, ((schedule.system.nstates or 0) - slides - at,))
    return concatenated(graph, [*parts, rest])
