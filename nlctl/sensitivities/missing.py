"""Where a run has no derivative: when, at what, and why."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..expressions.evaluate import evaluate_expressions
from ..native import Compiled
from ..native.happened import row_labels
from ..native.integrate.state import Status
from ..native.jacobians import searches_of
from ..native.results import Trajectory
from .program import Differentiated
from .record import NoDerivative

_TOGETHER = "two things happen at one instant, and each alone at another if it is moved"
_GRAZING = "a condition is met at a rate of 0 (grazing), and may not be met if it is moved"
_RETURNS = "a jump at a time that moves comes back through a delay"
_ENDLESS = "switches follow each other without end"
_START = "the run starts on a condition, and on either side of it if it is moved"
_MARKS = (("together", _TOGETHER), ("at_reset", _TOGETHER), ("grazing", _GRAZING))


def missing(
    differentiated: Differentiated,
    of_whom: tuple[Compiled, tuple[str, ...]],
    trajectory: Trajectory,
    given: tuple[np.ndarray, ...],
) -> list[NoDerivative]:
    """Return why there are no derivatives from some time on, in the order of time."""
    compiled, names = of_whom
    run = _Run(
        differentiated=differentiated, compiled=compiled, names=names, trajectory=trajectory,
        given=given,
    )  # fmt: skip
    first = sorted(run.later(), key=lambda lack: lack.time)[:1]
    return [*run.at_start(), *first]


@dataclass(frozen=True, kw_only=True)
class _Run:
    """A run with derivatives that is examined."""

    differentiated: Differentiated
    compiled: Compiled
    names: tuple[str, ...]
    trajectory: Trajectory
    given: tuple[np.ndarray, ...]

    def later(self) -> list[NoDerivative]:
        """Return why there are none behind the start."""
        times, start, p, _ = self.given
        places, end = self.differentiated.places, float(self.trajectory.statistics.time)
        last = self.trajectory.states[:, -1] if self.trajectory.time.size else start
        lacks = [
            self._lack(float(last[getattr(places, name)]), why)
            for name, why in _MARKS
            if last[getattr(places, name)] <= end
        ]
        if last[places.jumped] <= end and self.differentiated.extended.lines:
            lacks.append(self._lack(float(last[places.jumped]) + self._shortest(p), _RETURNS))
        together = self._resets_together()
        if together is not None:
            lacks.append(self._lack(together, _TOGETHER))
        if self.trajectory.statistics.status is Status.ZENO:
            lacks.append(self._lack(self.trajectory.since, _ENDLESS))
        elif self.trajectory.statistics.status is Status.CHATTERING:
            lacks.append(self._lack(end, _ENDLESS))
        return [lack for lack in lacks if lack.time <= times[-1]]

    def at_start(self) -> list[NoDerivative]:
        """Return by what there are none, as the run starts on a condition that it moves."""
        source, sides = self.differentiated.sides.source, self.differentiated.sides.sides
        levels = [source.graph.item(s.here.level, k) for s in sides for k in range(s.rows)]
        values = self._at_start(levels)
        met = [level for level, v in zip(levels, values, strict=True) if np.all(v == 0.0)]
        zero, without = source.graph.const(0.0), []
        for name, seed in zip(self.names, self.differentiated.saltation.seeds, strict=True):
            moves = [
                e or zero
                for level in met
                for e in self.differentiated.saltation.change(level, seed)
            ]
            if any(np.any(v != 0.0) for v in self._at_start(moves)):
                without.append(name)
        if not without:
            return []
        time = float(self.given[0][0])
        return [NoDerivative(time=time, where="", why=_START, with_respect_to=tuple(without))]

    def _at_start(self, exprs: list) -> list[np.ndarray]:
        """Return the values of expressions where the run starts."""
        times, start, p, u = self.given
        wide = np.zeros((self.differentiated.extended.schedule.ninputs, 1))
        wide[: u.shape[0], 0] = u[:, 0]
        arrays = {"t": times[:1, None], "x": start[:, None], "u": wide, "p": p[:, None]}
        return evaluate_expressions(
            exprs, arrays, searches_of(self.differentiated.sides.source.equations)
        )

    def _lack(self, time: float, why: str) -> NoDerivative:
        """Return it with the names of what happens then."""
        when, labels = self._events
        happened = dict.fromkeys(labels[k][:2] for k in np.flatnonzero(when == time))
        where = ", ".join(f"{which} of '{block}'" for block, which in happened if block)
        return NoDerivative(time=time, where=where, why=why, with_respect_to=self.names)

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
        conditions, happened = self.compiled.equations.conditions, self.trajectory.happened
        labels = row_labels(self.compiled, conditions)
        first = self.compiled.program.switching + conditions.rows
        watching = len(self.differentiated.saltation.turning) + bool(
            self.differentiated.sides.source.driven
        )
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
