"""Whether the switches of a lane accumulate in the steps that it has tried, see `accumulation`.

Two things together tell that from an oscillation:

* between two switches what is compared changes by no more than some tolerances;
* each period from switch to switch is shorter than the one before, by more than a switch is
  located to, and at that pace there are too many to come.

Where there have been very many, and the times in which they become twice as fast become shorter as
well, they have no end, however well they are resolved.
"""

from typing import Any

import numpy as np

from ...accumulation import AT_LEAST, WITHIN, Crowd, crowd_of, reached, tolerance_of
from .progress import rows_that_go_on
from .steps import Attempt, Jump, LaneEquations

_RATE = 1e-3  # of what is compared (1/s): an ideal relay that comes to rest has done so by then
_MANY = 3e4  # switches, of a sequence of periods as 1 / n, after which it is enough
_STEPS = 20  # accepted for each event: with more it does not switch all the time
_MORE = 1e6  # switches to come that are too many
_VERY_MANY = 30_000  # switches after which their pace alone says that they have no end
_SPAN = 100  # switches whose time is a period there, so that none alone counts
_HALVINGS, _SHORTER = 13, 0.9  # of periods, each in so much of the time of the one before
_RESOLVED = 1e-4  # part of the longest period: shorter ones may be rounding where a run stays


def accumulating(evaluated: LaneEquations, attempts: list[Attempt]) -> Jump | None:
    """Return the last switch of a lane whose switches accumulate in the steps that it has tried."""
    run, j = evaluated.run, evaluated.j
    lane = run.lanes[j]
    if not run.task.taylor.highest and lane["accepted"] > _STEPS * lane["events"]:
        return None  # at once: what usual runs take must not cost them anything
    way = evaluated.way(attempts)
    points, g = way.points, way.g
    if not g.shape[1]:
        return None
    row = int(np.argmax([way.switches(i).size for i in range(g.shape[1])]))
    places = way.switches(row)
    if not places.size:
        return None
    place = points[places[-1]]
    crowd = _finite(run, j, row)
    if crowd is None:
        switches = _noted(run, j, row, np.array([points[k][0] for k in places]))
        crowd = crowd_of(switches, row, run.task.times[-1], run.task.rtol, _MORE)
        if crowd is None or not _is_small(evaluated, place, way.rates[places[-1]], crowd):
            return None
        if not np.abs(g[:, row]).max() <= WITHIN * _tolerance(evaluated, place, row):
            return None
    (before, x, _), (after, x_2, u) = points[places[-1] - 1], place
    return Jump(
        times=(before, after), before=x, after=x_2, inputs=u, crowd=crowd,
        accumulates=True, goes_on=bool(rows_that_go_on(evaluated, way)[row]),
    )  # fmt: skip


def _come_to_an_end(times: np.ndarray) -> bool:
    """Whether switches at some times accumulate before a time, as jumps do, see `jumps_end`."""
    # Backwards from the last: how long ago so many took twice as long, four times as long, ...
    periods, halvings = times[_SPAN:] - times[:-_SPAN], np.arange(1, _HALVINGS + 2)
    longer = np.maximum.accumulate(periods[::-1]) >= 2.0 ** halvings[:, None] * periods[-1]
    if not longer[-1, -1] or not periods[-1] > 0.0:
        return False
    took = np.diff(times[-1 - longer.argmax(axis=1)][::-1])
    return bool(np.all(took[1:] < _SHORTER * took[:-1]))


def _finite(run: Any, j: int, row: int) -> Crowd | None:
    """Return how very many switches of a condition have come ever faster, to before a time."""
    rows, times = _log(run, j)
    own = times[rows == row]
    if own.size < _VERY_MANY or not _come_to_an_end(own):
        return None
    period, before = own[-1] - own[-3], own[-3] - own[-5]
    return Crowd(
        row=row, last=float(own[-1]), period=float(period), ratio=float(period / before),
        more=np.inf,
    )  # fmt: skip


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
