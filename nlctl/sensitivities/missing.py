"""Where a run has no derivative: when, at what, and why."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..expressions.evaluate import evaluate_expressions
from ..native import Compiled
from ..native.happened import row_labels
from ..native.integrate.results import Trajectory
from ..native.integrate.state import Status
from ..native.jacobians import searches_of
from .program import Differentiated
from .record import NoDerivative

__all__ = ["missing"]

_TOGETHER = "two things happen at one instant, and each alone at another if it is moved"
_GRAZING = "it is met at a rate of 0 (grazing), and may not be met if it is moved"
_RETURNS = "a jump at a time that moves comes back through a delay"
_ENDLESS = "switches follow each other without end"
_START = "the run starts on a condition, and on either side of it if it is moved"


def missing(
    made: Differentiated, compiled: Compiled, found: Trajectory, given: tuple[np.ndarray, ...]
) -> list[NoDerivative]:
    """Return why there are no derivatives from some time on, in the order of time.

    Parameters
    ----------
    made : Differentiated
    compiled : Compiled
        The diagram.
    found : Trajectory
    given : tuple of ndarray
        Times, initial state, parameters and inputs of the run.
    """
    places, times = made.places, given[0]
    lacks = [*_at_start(made, given)]
    last = found.states[:, -1] if found.time.size else given[1]
    end = float(found.statistics.time)
    first = {name: float(last[getattr(places, name)]) for name in _NAMES}
    for name, why in (("together", _TOGETHER), ("at_reset", _TOGETHER), ("grazing", _GRAZING)):
        if first[name] <= end:
            lacks.append(_lack(made, compiled, found, first[name], why))
    if first["jumped"] <= end and made.extended.lines:
        back = first["jumped"] + _shortest(made, given[2])
        if back <= end:
            lacks.append(NoDerivative(time=back, where="", why=_RETURNS))
    both = _resets_together(made, compiled, found)
    if both is not None:
        lacks.append(_lack(made, compiled, found, both, _TOGETHER))
    if found.statistics.status in (Status.ZENO, Status.CHATTERING):
        since = found.since if found.statistics.status is Status.ZENO else end
        lacks.append(_lack(made, compiled, found, since, _ENDLESS))
    lacks = [each for each in lacks if each.time <= times[-1]]
    return sorted(lacks, key=lambda each: each.time)[:1]


_NAMES = ("together", "at_reset", "grazing", "jumped")


def _lack(
    made: Differentiated, compiled: Compiled, found: Trajectory, time: float, why: str
) -> NoDerivative:
    """Return it with the names of what happens then."""
    when, labels = _events(made, compiled, found)
    names = dict.fromkeys(labels[k][:2] for k in np.flatnonzero(when == time))
    where = ", ".join(f"{which} of '{block}'" for block, which in names if block)
    return NoDerivative(time=time, where=where, why=why)


def _shortest(made: Differentiated, p: np.ndarray) -> float:
    """Return the shortest delay in s, 0 if one varies."""
    nodes, delays = made.extended.schedule.nodes, []
    for line in made.extended.schedule.lines[: made.extended.lines]:
        spec = nodes[line.block or 0].system.current_spec
        slot = made.extended.layout[line.block or 0]["delay"]
        delays.append(p[slot.offset] if spec.varying is None else 0.0)
    return float(min(delays))


def _events(
    made: Differentiated, compiled: Compiled, found: Trajectory
) -> tuple[np.ndarray, list[tuple[str, ...]]]:
    """Return what has happened to the diagram itself: when, and block, which, direction."""
    conditions = compiled.equations.conditions
    labels, first = row_labels(compiled, conditions), compiled.program.switching + conditions.rows
    own = 1 if made.sides.source.carried else 0
    when, names = [], []
    for time, k in zip(found.happened.time, found.happened.label // 2, strict=True):
        row = k if k < first else k - own
        if not first - own <= row < first and row < len(labels):
            when.append(time)
            names.append(labels[row])
    return np.array(when), names


def _resets_together(made: Differentiated, compiled: Compiled, found: Trajectory) -> float | None:
    """Return when two guards have first fallen at one instant."""
    when, labels = _events(made, compiled, found)
    rows = [k for k, each in enumerate(labels) if each[1].startswith("guard")]
    for one, other in pairwise(rows):
        if when[one] == when[other] and labels[one] != labels[other]:
            return float(when[one])
    return None


def _at_start(made: Differentiated, given: tuple[np.ndarray, ...]) -> list[NoDerivative]:
    """Return whether a run starts on a condition that what is differentiated by moves."""
    times, start, p, u = given
    source, seeds = made.sides.source, made.saltation.seeds
    levels = [
        source.graph.item(side.here.level, k) for side in made.sides.sides for k in range(side.rows)
    ]
    if not levels:
        return []
    wide = np.zeros((made.extended.schedule.ninputs, 1))
    wide[: u.shape[0], 0] = u[:, 0]
    arrays = {"t": times[:1, None], "x": start[:, None], "u": wide, "p": p[:, None]}
    searches = searches_of(source.found)
    zero = source.graph.const(0.0)
    values = evaluate_expressions(levels, arrays, searches)
    met = [level for level, v in zip(levels, values, strict=True) if np.all(v == 0.0)]
    for level in met:
        moves = [e or zero for seed in seeds for e in made.saltation.change(level, seed)]
        if any(np.any(v != 0.0) for v in evaluate_expressions(moves, arrays, searches)):
            return [NoDerivative(time=float(times[0]), where="", why=_START)]
    return []
