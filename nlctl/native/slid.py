"""A run again that has chattered at conditions of its equations, with these as ideal relays.

Where a run comes back to a condition with each of its shortest steps, it is looked at around that
place: on which side of which switching function what compares has which value, and whether the
equations are then, on each side, those in which these values are constants.  If so the diagram is
read with a relay for the condition, see `equations.slides`, and the run is repeated from its start,
until it chatters no longer, or at something else.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..blocks import block
from ..errors import CompileError, ParameterError
from ..expressions.conditions import zigzag
from ..expressions.evaluate import evaluate_expressions
from ..expressions.graph import Expr, Graph, Untraceable
from ..sliding.relay import RelayOfCondition
from .chattering.steps import Jump
from .compiled import Compiled
from .diagram.nodes import Node, Slide
from .diagram.parameters import length, slots_of
from .diagram.program import count_switching_functions, memory
from .diagram.schedule import stand_in
from .equations.blocks import Equations
from .equations.relays import slide_places
from .equations.slides import (
    Pairs,
    changing_at,
    declared_functions,
    of_both_sides,
    on_sides,
    others_of,
)
from .happened import row_labels, slide_rows, word_of
from .integrate.state import Status
from .results import Trajectory

Slides = list[tuple["Slide", float]]  # each with how far its function is from 0 at rest

_DONE = Status.OK, Status.ENDED
_STEPS = 0.0, 1.0  # instead of sides of what counts: these are of no one integer
_MOST = 24  # runs again
_NUMBERS = 256  # elements of an array that slide one by one
_AROUND = 64  # points
_NEAR = 0.25  # of a step: how far from its jump it is looked at
_AHEAD = 1e-9  # times the run's length: what comes no further has not slid
_RATE = 10.0  # at which what is left of a switching function decays, times the run's length
_OWN = len(RelayOfCondition.states)
_ROUNDING = 1e-12  # of a time
_ALIKE = 1e-9  # of the largest rate
_REST_RATE = 1e3  # times as much of its rate as of itself counts as rest, in 1/s


@dataclass(frozen=True, kw_only=True, eq=False)
class Slid:
    """A diagram with ideal relays for some conditions of its equations."""

    slides: tuple[Slide, ...]
    compiled: Compiled


def slides_at(compiled: Compiled, p: np.ndarray, jump: Jump, scale: np.ndarray) -> list[Slides]:
    """Return conditions that explain a jump, first with others of their kind, none if none do."""
    # `scale` (nstates,): by how much each state may be off.
    if jump.goes_on or jump.is_rough:
        return []
    near, far = _points(compiled, p, jump, scale), _far_points(compiled, p, jump, 2)
    around = _Around(
        compiled=compiled, read=compiled.equations_with(p), arrays=near, near=near, far=far
    )
    try:
        slides = around.slides()
        others = _siblings(around, slides, _far_points(compiled, p, jump, 3))
    except Untraceable:  # there is what is called unchanged
        return []
    return [slides + others, slides] if others else [slides] if slides else []


def _siblings(around: _Around, slides: Slides, apart: dict[str, np.ndarray]) -> Slides:
    """Return slides of the same kind in the same block as others: elements of an array."""
    whats = {one.what for one, _ in slides}
    every = replace(around, arrays=apart).slides() if slides else []
    alike = [(one, rest) for one, rest in every if one.what in whats and rest > 0.0]
    return [one for one in alike if not any(one[0].shares(other) for other, _ in slides)]


def _points(
    compiled: Compiled, p: np.ndarray, jump: Jump, scale: np.ndarray
) -> dict[str, np.ndarray]:
    """Return times, states, inputs and parameters around a jump."""
    still = [*compiled.program.memory, *compiled.program.sampled]
    rng = np.random.default_rng(1)
    way = np.subtract(jump.after, jump.before)[:, None] * rng.uniform(size=_AROUND)
    moves = way + rng.uniform(-1.0, 1.0, way.shape) * scale[:, None]
    moves[still] = 0.0
    x = np.where(moves == 0.0, jump.after[:, None], jump.before[:, None] + moves)
    return {"t": np.array([[jump.time]]), "x": x, "u": jump.inputs[:, None], "p": p[:, None]}


def _far_points(compiled: Compiled, p: np.ndarray, jump: Jump, seed: int) -> dict[str, np.ndarray]:
    """Return times, states, inputs and parameters, of about the size of those of a jump."""
    rng = np.random.default_rng(seed)
    x, u, t = (np.atleast_1d(v)[:, None] for v in (jump.after, jump.inputs, jump.time))
    x, u, t = (v + rng.normal(size=(len(v), _AROUND)) * (1.0 + np.abs(v)) for v in (x, u, t))
    return {"t": t, "x": x, "u": u, "p": p[:, None]}


@dataclass(frozen=True, kw_only=True)
class _Around:
    """The equations at points around a jump."""

    compiled: Compiled
    read: Equations
    arrays: dict[str, np.ndarray]  # at which it is seen what changes with what
    near: dict[str, np.ndarray]  # which the run might as well have reached
    far: dict[str, np.ndarray]  # at which what holds on a side has to hold as well

    @property
    def graph(self) -> Graph:
        return self.read.graph

    def values(
        self, exprs: Sequence[Expr], arrays: dict[str, np.ndarray] | None = None
    ) -> np.ndarray:
        return _values(exprs, arrays or self.arrays)

    @property
    def _rows(self) -> dict[int, Expr]:
        """The switching functions that are numbers, by their rows: declared ones and others."""
        slides = [node for node in self.compiled.schedule.nodes if node.slide]
        relays = sum(map(count_switching_functions, slides))
        first, watched = self.compiled.program.switching, len(self.compiled.schedule.watched)
        rows, located = (
            declared_functions(self.read.results, first - relays),
            self.read.conditions.located,
        )
        for one in located[: len(located) - watched]:  # but for what a run watches
            if not one.bends and one.function.size is None:
                rows[first] = one.function
            first += one.rows
        return rows

    def slides(self) -> Slides:
        """Return the conditions at which the rates jump, and nothing else does around it."""
        rows = self._rows
        functions = self.values([*rows.values()])
        both = [(row, s) for row, s in zip(rows, functions, strict=True) if _has_both_signs(s)]
        groups: list[list[tuple[int, np.ndarray]]] = []
        for row, s in both:
            alike = next((g for g in groups if _changes_with(g[0][1], s)), None)
            if alike is None:
                groups.append([(row, s)])
            else:
                alike.append((row, s))
        slides = [self._of_group({row: rows[row] for row, _ in group}) for group in groups]
        return [slide for slide in slides if slide is not None]

    def _of_group(self, group: dict[int, Expr]) -> tuple[Slide, float] | None:
        """Return the slide of conditions that change together here, of those that compare."""
        # Where a play is in contact, what it is compared with moves along: that is another place.
        jumping = {
            row: function for row, function in group.items()
            if changing_at(self.graph, self._every, [function])
        }  # fmt: skip
        return self._slide([*jumping], [*jumping.values()]) if jumping else None

    def _slide(self, rows: Sequence[int], functions: list[Expr]) -> tuple[Slide, float] | None:
        """Return a slide of conditions that change together, if rates jump there as it has them."""
        changing = changing_at(self.graph, self._every, functions)
        values = self.values(changing)
        jumps = [bool(np.ptp(v)) for v in values]
        steps = {zigzag(self.graph, n) for n, does in zip(changing, jumps, strict=True) if does}
        if len(steps) != 1:  # different ones, or steps and what compares
            return None
        (step,) = steps
        function = step or functions[0]
        (s,) = self.values([function])
        others = [others_of(self.graph, node, functions) for node in changing]
        ways = [np.ones(1) if e is None else self.values([e])[0] for e in others]
        sides = tuple(
            side
            for does, v, w in zip(jumps, values, ways, strict=True)
            if (side := _STEPS if step and does else _sides(v, s, w))
        )
        if len(sides) < len(values) or (step is not None and np.abs(s).max() > _NEAR):
            return None
        pairs = {
            node: on_sides(self.graph, node, side, functions)
            for node, side in zip(changing, sides, strict=True)
        }
        both = of_both_sides(self.graph, self._rates, pairs)
        now, below, above = map(self.values, (self._rates, *both))
        if np.array_equal(below, above) or not np.array_equal(now, np.where(s < 0.0, below, above)):
            return None
        if not self._holds(function, pairs):
            return None
        first = self.compiled.program.switching
        block, _ = row_labels(self.compiled, self.read.conditions)[rows[0]]
        op = next(n.op for n, (a, b) in zip(changing, sides, strict=True) if a != b)
        slide = Slide(
            what=(block, word_of(op)),
            places=self._places([row - first for row in rows if row >= first]),
            declared=tuple(row for row in rows if row < first),
            sides=sides, integers=step is not None,
        )  # fmt: skip
        (z,) = self.values([function], self.near)
        return slide, float(np.abs(z).max() if z.min() < 0.0 < z.max() else 0.5 * np.ptp(z))

    @cached_property
    def _every(self) -> list[Expr]:
        """All that the equations compute."""
        every = [e for name in self.read.results for e, _ in self.read.pieces(name)]
        return every + [e for part in self.read.fixed_points.values() for e in part]

    @cached_property
    def _rates(self) -> list[Expr]:
        """Rates, and outputs."""
        return [e for name in ("dx", "y") for e, _ in self.read.pieces(name)]

    def _holds(self, function: Expr, pairs: Pairs) -> bool:
        """Whether comparisons are on each side of a function what they are said to be, far away."""
        nodes = [function, *pairs, *(e for pair in pairs.values() for e in pair)]
        s, *values = self.values([self.graph.number(node) for node in nodes], self.far)
        now, low, high = values[: len(pairs)], values[len(pairs) :: 2], values[len(pairs) + 1 :: 2]
        return all(
            np.array_equal(a[s < 0.0], b[s < 0.0]) and np.array_equal(a[s > 0.0], c[s > 0.0])
            for a, b, c in zip(now, low, high, strict=True)
        )

    def _places(self, rows: Sequence[int]) -> tuple[int, ...]:
        """Return the places of located conditions, of integers those of even and of odd ones."""
        located = self.read.conditions.located
        of_rows = [k for k, one in enumerate(located) for _ in range(one.rows)]
        places = {of_rows[row] for row in rows}
        places |= {k + located[k].integers for k in places}
        return tuple(sorted(places, key=lambda k: (-located[k].integers, k)))


def _values(exprs: Sequence[Expr], arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Return values of expressions at all points, those of vectors one below the other."""
    values, shapes = evaluate_expressions(exprs, arrays), ((e.size or 1, _AROUND) for e in exprs)
    return np.concatenate([np.zeros((0, _AROUND)), *map(np.broadcast_to, values, shapes)])


def _has_both_signs(s: np.ndarray) -> bool:
    return bool(np.all(s != 0.0) and s.min() < 0.0 < s.max())


def _changes_with(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two functions have equal or opposite signs at all points."""
    return abs(int(np.sum(np.sign(one) * np.sign(other)))) == one.size


def _sides(values: np.ndarray, s: np.ndarray, way: np.ndarray) -> tuple[float, float] | None:
    """Return the one value that a comparison has below, and that above; None if it has several."""
    # as they are where its way is above 0
    below, above = np.unique(values[s < 0.0]), np.unique(values[s > 0.0])
    if not below.size == above.size == 1:
        return None
    low, high = float(below[0]), float(above[0])
    if low == high or np.all(way >= 0.0):
        return low, high
    return (high, low) if np.all(way < 0.0) else None


@dataclass(frozen=True, kw_only=True)
class SlidRun:
    """A run of a diagram with relays for conditions."""

    compiled: Compiled  # the diagram with relays, whose modes are its last states
    p: np.ndarray  # all parameters
    reached: Trajectory
    slides: tuple[tuple[Slide, float], ...] = ()  # with how far functions are from 0 at rest

    def of_diagram(self, original: Compiled) -> Trajectory:
        """Return the run without what is the relays'."""
        if not self.slides:
            return self.reached
        states, inputs = original.system.nstates or 0, original.schedule.ninputs
        reached, jump = self.reached, self.reached.statistics.jump
        if jump is not None:
            jump = jump.first(states, inputs)
        return self.named(
            replace(
                reached, states=reached.states[:states], inputs=reached.inputs[:inputs],
                statistics=replace(reached.statistics, jump=jump),
            )
        )  # fmt: skip

    def named(self, reached: Trajectory) -> Trajectory:
        """Return a run that says along what it has slid, and when several ways led away."""
        nodes, log = self.compiled.schedule.nodes, self.reached.happened
        noted, slides, forks = log.label // 2, list[str](), set[float]()
        places, rows = slide_places(nodes), slide_rows(self.compiled)
        for (slide, _), i, (_, *ends) in zip(self.slides, places, rows, strict=True):
            below, above = (set(log.time[noted == row].tolist()) for row in ends)
            modes, parted = self.reached.states[nodes[i].state_offset :][:_OWN]
            if below or above or np.any(np.abs(modes[1:]) < 0.5):
                slides.append(slide.name)
            forks |= set(parted[1:][np.diff(parted) > _ROUNDING * np.abs(parted[1:])].tolist())
        return replace(
            reached,
            statistics=replace(
                reached.statistics, slides=tuple(slides), forks=tuple(sorted(forks))
            ),
        )


def sliding(
    run: Callable[[Compiled, np.ndarray, np.ndarray], Trajectory],
    compiled: Compiled,
    reached: Trajectory,
    start: tuple[np.ndarray, np.ndarray],
    times: np.ndarray,
) -> SlidRun:
    """Return a run that chatters no longer, if relays can stand for the conditions of that."""
    # `run` has a diagram, an initial state and a parameter vector.
    _, p = start
    last = best = SlidRun(compiled=compiled, p=p, reached=reached)
    for _ in range(_MOST):
        done, jump = last.reached.statistics, last.reached.statistics.jump
        if jump is None:
            break
        scale = done.atol + done.rtol * np.maximum(np.abs(jump.before), np.abs(jump.after))
        more = slides_at(last.compiled, last.p, jump, scale)
        if not more and _has_loops(compiled):
            return sliding(run, _in_numbers(compiled), reached, start, times)
        tried = (_further(run, compiled, (last, jump), each, start, times) for each in more)
        if (further := next(filter(None, tried), None)) is None:
            break
        last = further
        # of relays whose inputs depend on each other no output is known: it ends where that is so
        ahead = last.reached.statistics.time - best.reached.statistics.time
        if last.reached.statistics.status in _DONE or ahead > _AHEAD * np.ptp(times):
            best = last
    return best


def _further(
    run: Callable[[Compiled, np.ndarray, np.ndarray], Trajectory],
    compiled: Compiled,
    ended: tuple[SlidRun, Jump],
    more: Slides,
    start: tuple[np.ndarray, np.ndarray],
    times: np.ndarray,
) -> SlidRun | None:
    """Return a run with relays for more conditions, None if they cannot be read."""
    (last, jump), (x0, p) = ended, start
    slides = (*last.slides, *((_counted(slide, last.slides), far) for slide, far in more))
    try:
        diagram = with_relays(compiled, tuple(slide for slide, _ in slides), p)
        whole = _parameters(diagram, p, [far for _, far in slides], float(np.ptp(times)))
        compare_sides(compiled, diagram, p, whole, jump)
        reached = run(diagram, with_modes(x0, len(slides), times), whole)
    except (CompileError, ParameterError, Untraceable):
        return None
    return SlidRun(compiled=diagram, p=whole, reached=reached, slides=slides)


def compare_sides(
    compiled: Compiled, slid: Compiled, p: np.ndarray, whole: np.ndarray, jump: Jump
) -> None:
    """Refuse a diagram whose rates and outputs are others with each relay on its side, anywhere."""
    states = compiled.system.nstates or 0
    given = _far_points(compiled, p, jump.first(states, compiled.schedule.ninputs), 4)
    places = slide_places(slid.schedule.nodes)
    modes = [slid.schedule.nodes[i].state_offset for i in places]
    extended = np.ones((slid.system.nstates or 0, _AROUND))
    extended[:states] = given["x"]
    there = given | {"x": extended, "p": whole[:, None]}
    read, original = slid.equations_with(whole), compiled.equations_with(p)
    extended[modes] = np.sign(_values(functions_of_relays(slid, read), there))
    for name, width in (("dx", states), ("y", compiled.system.noutputs or 0)):
        right, now = (
            _values([e for e, _ in equations.pieces(name)], arrays)[:width]
            for equations, arrays in ((original, given), (read, there))
        )
        largest = np.abs(right).max(axis=1, initial=0.0, where=np.isfinite(right), keepdims=True)
        if not np.isclose(now, right, 0.0, _ALIKE * largest, equal_nan=True).all():
            raise CompileError("relays do not stand for the conditions that they were made for")


def functions_of_relays(slid: Compiled, read: Equations) -> list[Expr]:
    """Return what each relay for a condition switches at: while it slides, how far it may go."""
    functions = declared_functions(read.results, slid.program.switching)
    levels = read.conditions.levels  # of what jumps at integers: declared is 1 where it is not met
    return [{**functions, **levels}[rows[0]] for rows in slide_rows(slid)]


def with_modes(x0: np.ndarray, count: int, times: np.ndarray) -> np.ndarray:
    """Return an initial state with those of so many relays: both sides have never led away."""
    return np.append(x0, np.tile([0.0, times[0] - np.ptp(times)], count))


def _has_loops(compiled: Compiled) -> bool:
    """Whether conditions are of arrays that are read as loops, and could be read as numbers."""
    located = compiled.equations.conditions.located
    return compiled.schedule.small < _NUMBERS and any(one.function.size for one in located)


def _in_numbers(compiled: Compiled) -> Compiled:
    """Return a diagram each element of whose arrays is a number of its own."""
    schedule = replace(compiled.schedule, small=_NUMBERS)
    whole = replace(compiled, schedule=schedule, original=None, apart=None)
    return compiled.cache.found(
        Slid, lambda each: not each.slides, lambda: Slid(slides=(), compiled=whole)
    ).compiled


def _counted(slide: Slide, before: Sequence[tuple[Slide, float]]) -> Slide:
    """Return a slide with places among all conditions, of one among those that were left."""
    gone = {place for one, _ in before if not one.integers for place in one.places}
    every = [k for k in range(max(slide.places, default=0) + len(gone) + 1) if k not in gone]
    return replace(slide, places=tuple(every[place] for place in slide.places))


def with_relays(compiled: Compiled, slides: tuple[Slide, ...], p: np.ndarray) -> Compiled:
    """Return a diagram with ideal relays for conditions, made when it is first needed."""
    slid = compiled.cache.found(
        Slid, lambda each: each.slides == slides, lambda: _read_with(compiled, slides)
    ).compiled
    _ = slid.equations_with(p)  # refused now if they act on each other
    return slid


def _read_with(compiled: Compiled, slides: tuple[Slide, ...]) -> Slid:
    read, program = compiled.schedule, compiled.program
    n, count = read.system.nstates or 0, len(read.nodes)
    nodes = [_relay(slide, n + _OWN * k) for k, slide in enumerate(slides)]
    at, layout = length(program.layout), {i: program.layout[i] for i in range(count)}
    for k, node in enumerate(nodes):
        layout[count + k] = slots_of(node.system, node.path, at)
        at += sum(slot.size for slot in layout[count + k].values())
    later = {i + len(nodes): i for i in range(count, count + len(read.samplings))}
    layout |= {i: program.layout[before] for i, before in later.items()}
    schedule = replace(
        read, nodes=(*read.nodes, *nodes), order=(*read.order, *range(count, count + len(nodes))),
        unknown=(*read.unknown, *[frozenset[int]()] * len(nodes)),
        system=stand_in(read.system, n + _OWN * len(nodes), read.system.noutputs or 0),
    )  # fmt: skip
    moved = {i: program.fixed[before] for i, before in later.items() if before in program.fixed}
    whole = replace(
        program, layout=layout, fixed={i: v for i, v in program.fixed.items() if i < count} | moved,
        switching=program.switching + sum(map(count_switching_functions, nodes)),
        memory=(*program.memory, *(m for node in nodes for m in memory(node))),
    )  # fmt: skip
    slid = replace(compiled, schedule=schedule, program=whole, original=None, apart=None)
    return Slid(slides=slides, compiled=slid)


def _relay(slide: Slide, state: int) -> Node:
    """Return an ideal relay that stands for a condition, and has no signals."""
    name = f"{slide.what[0].replace('.', '_')}_slides"  # names have no dots, paths do
    return Node(
        path=slide.what[0], system=block(RelayOfCondition(), name), state_offset=state,
        inputs=({},), direct=np.zeros((1, 1), dtype=bool), slide=slide,
    )  # fmt: skip


def _parameters(slid: Compiled, p: np.ndarray, far: Sequence[float], span: float) -> np.ndarray:
    """Return all parameters, with those of relays by how far functions are from 0 at rest."""
    whole = np.append(p, np.zeros(length(slid.program.layout) - p.size))
    for i, rest in zip(slide_places(slid.schedule.nodes), far, strict=True):
        values = {
            "height": 1.0, "rest": rest, "rate": _RATE / span, "rest_rate": _REST_RATE * rest,
        }  # fmt: skip
        for name, value in values.items():
            whole[slid.program.layout[i][name].offset] = value
    return whole
