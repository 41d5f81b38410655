"""Where a run has no derivative: when, at what, and why.

What memories are committed to where a run begins, with their derivatives.

All are committed from what they were, and again as long as one that has moved moves another: a
play behind a relay that switches at once is driven first as the relay was, then as it has become.
Its derivative is that of the last that has moved it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..expressions.dependence import reads
from ..expressions.evaluate import evaluate_expressions
from ..expressions.graph import Expr
from ..native import Compiled
from ..native.happened import row_labels
from ..native.integrate.state import Status
from ..native.jacobians import searches_of
from ..native.results import Trajectory
from ..native.slid import functions_of_relays
from .directions import SomeRows
from .program import Differentiated
from .record import NoDerivative
from .source import EquationParts
from .steep import without_stills

Arrays = dict[str, np.ndarray]


def commits_at_start(
    differentiated: Differentiated, x0: np.ndarray, arrays: Arrays
) -> list[Arrays]:
    """Return what a run begins with before each commit of its memories, then behind the last."""
    source, places = differentiated.sides.source, differentiated.places
    memories = list(source.program.memory)
    x = arrays["x"].copy()
    x[memories, 0] = x0[memories]
    commits = [{**arrays, "x": x}]
    pieces = [(e, 1) for e in source.committed]
    pieces += [(e, 1) for row in differentiated.saltation.at_start for e in row.values()]
    moving = [*source.driven, *source.catching]
    rows = [*memories, *(places.derivative(j) + m for j in range(places.by) for m in moving)]
    for _ in memories:  # as often as the engine does
        behind = evaluated_rows(differentiated, pieces, commits[-1])
        same = np.array_equal(behind[: len(memories)], commits[-1]["x"][memories, 0])
        if same and len(commits) > 1:
            break
        x = commits[-1]["x"].copy()
        x[rows, 0] = behind
        commits.append({**arrays, "x": x})
    return commits


def left_where_they_are(source: EquationParts, commits: Sequence[Arrays], k: int) -> list[int]:
    """Return which driven memories count as commit `k` finds them."""
    # What moves a memory once more says all of it.  Behind the last commit only those can be at
    # another end than before that are driven by what it has changed.
    later = [arrays["x"][:, 0] for arrays in commits[k + 1 :]]
    if later:
        return [m for m in source.driven if all(x[m] == later[0][m] for x in later)]
    behind = commits[-1]["x"]
    changed = {m for m in source.program.memory if commits[-2]["x"][m, 0] != behind[m, 0]}
    return [m for m, become in source.driven.items() if reads([become], "x", changed - {m})]


def evaluated_rows(
    differentiated: Differentiated, pieces: Sequence[SomeRows], arrays: Arrays
) -> np.ndarray:
    """Return the rows of some pieces."""
    searches = searches_of(differentiated.compiled.equations)
    exprs = without_stills(differentiated.sides.source.graph, [e for e, _ in pieces])
    evaluated = evaluate_expressions(exprs, arrays, searches)
    parts = [np.broadcast_to(v.reshape(-1), (n,)) if v.size in (1, n) else v.reshape(-1)
             for v, (_, n) in zip(evaluated, pieces, strict=True)]  # fmt: skip
    return np.concatenate([np.empty(0), *parts])


_TOGETHER = "two things happen at one instant, and each alone at another if it is moved"
_GRAZING = "a condition is met at a rate of 0 (grazing), and may not be met if it is moved"
_RETURNS = "a jump at a time that moves comes back through a delay that varies"
_ENDLESS = "switches follow each other without end"
_FORK = "the run leaves what it slides along where both sides lead away, by one of several ways"
_LOST = "the derivatives cannot be integrated further, although the run itself can"
_KINK = "the run stays on a kink, and on either side of it if it is moved"
_FIRST = "what is driven at the start is at a kink or jump, and on either side of it if it is moved"
_CHOSEN = "what is sampled is right at a kink or jump, and on either side of it if it is moved"
_PAIRS = 32  # of times one after the other, at which a run may be on a kink
_START = "the run starts on a condition, and on either side of it if it is moved"
_TOUCHED = "a memory is touched at its end and no further, and is moved, or not, by what moves that"
_CORNERED = "a memory turns where its input has two corners, each at another time if it is moved"
_MARKS = (("together", _TOGETHER), ("at_reset", _TOGETHER), ("chosen", _CHOSEN))  # by quantity


def missing(
    differentiated: Differentiated,
    of_whom: tuple[Compiled, tuple[str, ...]],
    trajectory: Trajectory,
    given: tuple[np.ndarray, ...],
    commits: list[Arrays],
) -> list[NoDerivative]:
    """Return why there are no derivatives from some time on, in the order of time."""
    compiled, names = of_whom
    run = _Run(
        differentiated=differentiated, compiled=compiled, names=names, trajectory=trajectory,
        given=given, commits=commits,
    )  # fmt: skip
    later = sorted(run.later(), key=lambda lack: lack.time)
    return [*_first_of([*run.at_start(), *run.at_first_jump(), *run.at_kinks()]), *_first_of(later)]


def _first_of(every: Sequence[NoDerivative]) -> list[NoDerivative]:
    """Return of several lacks by a quantity the first."""
    lacks: list[NoDerivative] = []
    for lack in every:
        known = {name for other in lacks for name in other.with_respect_to}
        others = tuple(name for name in lack.with_respect_to if name not in known)
        lacks += [replace(lack, with_respect_to=others)] if others else []
    return lacks


@dataclass(frozen=True, kw_only=True)
class _Run:
    """A run with derivatives that is examined."""

    differentiated: Differentiated
    compiled: Compiled
    names: tuple[str, ...]
    trajectory: Trajectory
    given: tuple[np.ndarray, ...]  # times, the state at the start, parameters, inputs
    commits: list[Arrays]  # see `commits_at_start`: none if nothing is driven at the start

    def later(self) -> list[NoDerivative]:
        """Return why there are none behind the start."""
        times, start, p = self.given[:3]
        places, end = self.differentiated.places, float(self.trajectory.statistics.time)
        last = self.trajectory.states[:, -1] if self.trajectory.time.size else start
        grazing = float(last[places.grazing])
        lacks = [self._lack(grazing, _GRAZING)] if grazing <= end else []
        for name, why in _MARKS:
            place = getattr(places, name)
            times = last[place : place + places.by]
            first = np.unique(times[times <= end])
            lacks += [self._lack(float(when), why, times == when) for when in first]
        for place, why in ((places.touched, _TOUCHED), (places.cornered, _CORNERED)):
            for k, m in enumerate(self.differentiated.sides.source.driven):
                if last[place + k] <= end:
                    lack = self._lack(float(last[place + k]), why)
                    lacks.append(replace(lack, where=f"memory of '{self._owner(m)}'"))
        if last[places.jumped] <= end and self.differentiated.extended.lines:
            lacks.append(self._lack(float(last[places.jumped]) + self._shortest(p), _RETURNS))
        together = self._resets_together()
        if together is not None:
            lacks.append(self._lack(together, _TOGETHER))
        lacks += [self._lack(time, _FORK) for time in self.trajectory.statistics.forks]
        if self.trajectory.statistics.status is Status.ZENO:
            lacks.append(self._lack(self.trajectory.since, _ENDLESS))
        elif self.trajectory.statistics.status is Status.CHATTERING:
            lacks.append(self._lack(end, _ENDLESS))
        elif self.trajectory.statistics.status is not Status.OK:
            lacks.append(self._lack(end, _LOST))
        return [lack for lack in lacks if lack.time <= times[-1]]

    def at_start(self) -> list[NoDerivative]:
        """Return by what there are none, as the run starts on a condition that it moves."""
        source, sides = self.differentiated.sides.source, self.differentiated.sides.sides
        levels = [source.graph.item(s.here.level, k) for s in sides for k in range(s.rows)]
        lacks = self._where_met(levels, self._start, _START)
        return [*lacks, *self._where_moved(self._slides_at_start(), self._start, _START)]

    def _slides_at_start(self) -> list[tuple[Expr, np.ndarray]]:
        """Return the functions along which a run slides when it begins."""
        # A relay has its function on a side, and next to it how far that is from where it rests.
        equations, begun = (
            self.differentiated.sides.source.equations,
            list[tuple[Expr, np.ndarray]](),
        )
        for switched in functions_of_relays(self.compiled, equations):
            _, rest, function = switched.args
            (within,) = self._values([rest], self._start)
            begun += [(function, np.array(True))] if np.all(within >= 0.0) else []
        return begun

    def at_first_jump(self) -> list[NoDerivative]:
        """Return by what there are none, as what is sampled or driven at the start has two."""
        if not self.commits:
            return []
        source, lacks = self.differentiated.sides.source, []
        for k, arrays in enumerate(self.commits):
            edges = source.edges(left_where_they_are(source, self.commits, k))
            lacks += self._where_met(edges, arrays, _FIRST)
        return lacks

    def at_kinks(self) -> list[NoDerivative]:
        """Return by what there are none, as the run stays on a kink of its equations."""
        source, trajectory = self.differentiated.sides.source, self.trajectory
        count = min(trajectory.time.size - 1, _PAIRS)
        if count < 1:
            return []
        first = np.unique(np.linspace(0, trajectory.time.size - 2, count).astype(int))
        one, other = self._along(first), self._along(first + 1)
        return self._where_met(source.kinks, one, _KINK, other)

    def _where_met(
        self,
        levels: list[Expr],
        at: dict[str, np.ndarray],
        why: str,
        later: dict[str, np.ndarray] | None = None,
    ) -> list[NoDerivative]:
        """Return by what there is none from when on: a level is 0, and later, and moves there."""
        met = self._zeros([(level, np.array(True)) for level in levels], at)
        met = self._zeros(met, later) if later and met else met
        return self._where_moved(met, at, why, later)

    def _where_moved(
        self,
        met: list[tuple[Expr, np.ndarray]],
        at: dict[str, np.ndarray],
        why: str,
        later: dict[str, np.ndarray] | None = None,
    ) -> list[NoDerivative]:
        """Return by what there is none from when on: levels that are met move there."""
        if not met:
            return []
        later, zero, lacks = later or at, self.differentiated.sides.source.graph.const(0.0), []
        changes = [self._changes([level for level, _ in met], j) for j in range(len(self.names))]
        moves = self._values([change or zero for row in changes for change in row], later)
        for j, name in enumerate(self.names):
            moved = moves[j * len(met) : (j + 1) * len(met)]
            parts = [
                np.atleast_2d(zeros & (v != 0.0)).any(axis=0)
                for v, (_, zeros) in zip(moved, met, strict=True)
            ]
            times = at["t"][0][np.any([np.broadcast_to(v, at["t"].size) for v in parts], axis=0)]
            if parts and times.size:
                lacks.append((float(times[0]), name))
        return [
            NoDerivative(
                time=time, where="", why=why,
                with_respect_to=tuple(name for other, name in lacks if other == time),
            ) for time in sorted({time for time, _ in lacks})
        ]  # fmt: skip

    def _zeros(
        self, levels: list[tuple[Expr, np.ndarray]], at: dict[str, np.ndarray]
    ) -> list[tuple[Expr, np.ndarray]]:
        """Return which levels are 0 somewhere, and where: there as well, if it was so before."""
        values = self._values([level for level, _ in levels], at)
        zeros = [
            (level, before & (value == 0.0))
            for (level, before), value in zip(levels, values, strict=True)
        ]
        return [(level, zero) for level, zero in zeros if np.any(zero)]

    def _changes(self, levels: list[Expr], j: int) -> list[Expr | None]:
        """Return the derivatives of levels by a quantity, derived where they are first met."""
        known, seed = self.differentiated.changes, self.differentiated.saltation.seeds[j]
        new = [level for level in levels if (level, j) not in known]
        slopes = self.differentiated.sides.source.slopes(new, seed)
        known.update(zip(((level, j) for level in new), slopes, strict=True))
        return [known[level, j] for level in levels]

    def _values(self, exprs: list[Expr], at: dict[str, np.ndarray]) -> list[np.ndarray]:
        equations = self.differentiated.sides.source.equations
        return evaluate_expressions(exprs, at, searches_of(equations))

    @property
    def _start(self) -> dict[str, np.ndarray]:
        """Return what expressions read where the run starts."""
        times, start, p, u = self.given
        wide = np.zeros((self.differentiated.extended.schedule.ninputs, 1))
        wide[: u.shape[0], 0] = u[:, 0]
        return {"t": times[:1][None], "x": start[:, None], "u": wide, "p": p[:, None]}

    def _along(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Return what expressions read at some of the output times."""
        trajectory, p = self.trajectory, self.given[2]
        arrays = {"t": trajectory.time[None], "x": trajectory.states, "u": trajectory.inputs}
        return {**{name: array[:, rows] for name, array in arrays.items()}, "p": p[:, None]}

    def _lack(self, time: float, why: str, by: np.ndarray | None = None) -> NoDerivative:
        """Return it with the names of what happens then; by all quantities, or by some."""
        names = tuple(n for j, n in enumerate(self.names) if by is None or by[j])
        when, labels = self._events
        happened = dict.fromkeys(labels[k][:2] for k in np.flatnonzero(when == time))
        where = ", ".join(f"{which} of '{block}'" for block, which in happened if block)
        return NoDerivative(time=time, where=where, why=why, with_respect_to=names)

    def _owner(self, m: int) -> str:
        """Return the block that a state belongs to."""
        nodes = self.compiled.schedule.nodes
        return next(n.path for n in reversed(nodes) if n.size and n.state_offset <= m)

    def _shortest(self, p: np.ndarray) -> float:
        """Return the shortest delay in s, 0 if one varies."""
        extended, delays = self.differentiated.extended, []
        for line in extended.schedule.lines[: extended.lines]:
            spec = extended.schedule.nodes[line.block or 0].system.current_spec
            slot = extended.layout[line.block or 0]["delay"]
            delays.append(p[slot.offset] if spec.varying is None else 0.0)
        return float(min(delays))

    @cached_property
    def _events(self) -> tuple[np.ndarray, list[tuple[str, str]]]:
        """What has happened to the diagram itself: when, and block and which."""
        source, happened = self.differentiated.sides.source, self.trajectory.happened
        conditions = source.equations.conditions
        labels = row_labels(self.compiled, conditions)
        ordered = source.ordered
        labels = [*(labels[k] for k in ordered), *labels[len(ordered) :]]
        first = self.compiled.program.switching + conditions.rows
        saltation = self.differentiated.saltation
        watching = self.differentiated.touching + self.differentiated.places.lines
        watching += len(saltation.moving) + len(saltation.leaving)
        when, names = [], []
        for time, row in zip(happened.time, happened.label // 2, strict=True):
            if first <= row < first + watching:
                continue
            if row - watching * (row >= first) < len(labels):
                when.append(time)
                names.append(labels[row - watching * (row >= first)])
        return np.array(when), names

    def _resets_together(self) -> float | None:
        """Return when two guards have first fallen at one instant."""
        when, labels = self._events
        rows = [k for k, label in enumerate(labels) if label[1].startswith("guard")]
        for one, other in pairwise(rows):
            if when[one] == when[other] and labels[one] != labels[other]:
                return float(when[one])
        return None
