"""Whether the switches of a lane accumulate in the steps that it has tried, see `accumulation`.

Two things together tell that from an oscillation:

* between two switches what is compared changes by no more than some tolerances;
* each period from switch to switch is shorter than the one before, by more than a switch is
  located to, and at that pace there are too many to come.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...accumulation import AT_LEAST, WITHIN, Crowd, crowd_of, reached, tolerance_of
from .steps import Attempt, Jump, LaneEquations

_RATE = 1e-3  # of what is compared (1/s): an ideal relay that comes to rest has done so by then
_MANY = 3e4  # switches, of a sequence of periods as 1 / n, after which it is enough
_STEPS = 20  # accepted for each event: with more it does not switch all the time
_MORE = 1e6  # switches to come that are too many
_RESOLVED = 1e-4  # part of the longest period: shorter ones may be rounding where a run stays


def accumulating(evaluated: LaneEquations, attempts: list[Attempt]) -> Jump | None:
    """Return the last switch of a lane whose switches accumulate in the steps that it has tried."""
    run, j = evaluated.run, evaluated.j
    lane = run.lanes[j]
    if not run.task.taylor.highest and lane["accepted"] > _STEPS * lane["events"]:
        return None  # at once: what usual runs take must not cost them anything
    t = np.array([a.t[j] for a in attempts])
    first = np.flatnonzero(np.diff(t, prepend=-np.inf) > 0)  # rejected steps begin where others do
    points = [(t[i], attempts[i].x[:, j], attempts[i].u[:, j]) for i in first]
    g = np.array([evaluated.switching(*point) for point in points])
    if not g.shape[1]:
        return None
    rates = np.array([attempts[i].first[:, j] for i in first])
    sides = np.sign(g)
    turns = (sides[1:] * sides[:-1] < 0).sum(axis=0)
    row = int(turns.argmax())
    places = 1 + np.flatnonzero(sides[1:, row] * sides[:-1, row] < 0)
    if not places.size:
        return None
    switches = _noted(run, j, row, t[first][places])
    crowd = crowd_of(switches, row, run.task.times[-1], run.task.rtol, _MORE)
    if crowd is None or not _is_small(evaluated, points[places[-1]], rates[places[-1]], crowd):
        return None
    if not np.abs(g[:, row]).max() <= WITHIN * _tolerance(evaluated, points[places[-1]], row):
        return None
    (before, x, _), (after, x_2, u) = points[places[-1] - 1], points[places[-1]]
    return Jump(times=(float(before), float(after)), before=x, after=x_2, inputs=u, crowd=crowd)


def accumulated(run: Any, j: int, end: float) -> Crowd | None:
    """Return how the switches of a lane have accumulated before the jump where it stays."""
    rows, times = _log(run, j)
    if not rows.size:
        return None
    row = int(np.bincount(rows).argmax())
    own = times[rows == row]
    periods = own[2:] - own[:-2]
    last = np.flatnonzero(periods > _RESOLVED * periods.max(initial=0.0))[-2 * AT_LEAST :]
    if not last.size:
        return None
    crowd = crowd_of(own[last[0] : last[-1] + 3], row, run.task.times[-1], run.task.rtol, _MORE)
    return crowd if crowd and abs(crowd.end - end) <= crowd.period else None


def _log(run: Any, j: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which conditions of a lane were at 0, and when."""
    log = slice(int(run.lanes["noted"][j]))
    rows, times = run.work.log.row[log, j] // 2, run.work.log.t[log, j]
    return rows[rows >= 0], times[rows >= 0]


def _noted(run: Any, j: int, row: int, times: np.ndarray) -> np.ndarray:
    """Return the last times at which a condition was at 0."""
    if times.size >= AT_LEAST:
        return times
    rows, noted = _log(run, j)
    return noted[rows == row][-2 * AT_LEAST :]


def _is_small(evaluated: LaneEquations, point: tuple, rates: np.ndarray, crowd: Crowd) -> bool:
    """Whether from one switch to the next what is compared stays within tolerances."""
    # On a parabola it comes as far as its rate after the switch takes it in a quarter of the way.
    # It is slow as well, or there have been many: periods as 1 / n fall by 2 / n in two switches.
    t, x, u = point
    ahead = crowd.period / 8
    there = reached(lambda s, z: evaluated.switching(s, z, u)[crowd.row], t, x, rates, ahead)
    settled = there < _RATE * ahead or _MANY * (1 - crowd.ratio) < 2
    return bool(settled and there <= WITHIN * _tolerance(evaluated, point, crowd.row))


def _tolerance(evaluated: LaneEquations, point: tuple, row: int) -> float:
    """Return by how much a switching function changes where states change by their tolerances."""
    t, x, u = point
    task = evaluated.run.task
    away = task.atol + task.rtol * np.abs(x)
    away[task.rows.memory] = 0.0
    return tolerance_of(lambda s, z: evaluated.switching(s, z, u)[row], t, x, away)
