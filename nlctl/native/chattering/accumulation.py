"""Switches that accumulate: they come ever closer together, and there is no end of them.

Behind a lag, or with u'' as the first derivative of its input that it acts on, a relay drives its
input back and forth through 0 (second-order sliding).  Where every way back is shorter than the
one before, the switches are so many that no run comes to its end: in a geometric sequence, whose
sum is finite, or as exp(t).  Two things together tell that from an oscillation:

* between two switches what is compared changes by no more than some tolerances;
* each period from switch to switch is shorter than the one before, by more than a switch is
  located to, and at that pace there are too many to come.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..integrate.workspace import TAYLOR
from .steps import Attempt, Crowd, Jump, LaneEquations

__all__ = ["accumulating"]

_RATE = 1e-3  # of what is compared (1/s): an ideal relay that comes to rest has done so by then
_MANY = 3e4  # switches, of a sequence of periods as 1 / n, after which it is enough
_STEPS = 20  # accepted for each event: with more it does not switch all the time
_LEAST = 5  # switches that are looked at
_WITHIN = 100.0  # tolerances that what is compared changes by in between
_LOCATED = 50.0  # relative tolerances by which periods fall at least; switches are located to 10
_FALLS = 0.2  # part by which it is enough that they fall, whatever the tolerance is
_MORE = 1e6  # switches to come that are too many


def accumulating(evaluated: LaneEquations, attempts: list[Attempt]) -> Jump | None:
    """Return the last switch of a lane whose switches accumulate in the steps that it has tried."""
    run, j = evaluated.run, evaluated.j
    lane = run.lanes[j]
    if run.task.method != TAYLOR and lane["accepted"] > _STEPS * lane["events"]:
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
    crowd = _crowd(_noted(run, row, t[first][places]), row, run.task)
    if crowd is None or not _is_small(evaluated, points[places[-1]], rates[places[-1]], crowd):
        return None
    if not np.abs(g[:, row]).max() <= _WITHIN * _tolerance(evaluated, points[places[-1]], row):
        return None
    (before, x, _), (after, x_2, u) = points[places[-1] - 1], points[places[-1]]
    return Jump(times=(float(before), float(after)), before=x, after=x_2, inputs=u, crowd=crowd)


def _noted(run: Any, row: int, times: np.ndarray) -> np.ndarray:
    """Return the last times at which a condition was at 0: of a single run they are all noted."""
    if times.size >= _LEAST or not run.task.alone:
        return times
    log = slice(int(run.lanes["noted"][0]))
    rows, noted = run.work.log_row[log] // 2, run.work.log_t[log]
    return noted[rows == row][-2 * _LEAST :]


def _crowd(times: np.ndarray, row: int, task: Any) -> Crowd | None:
    """Return how switches at some times accumulate, if they do."""
    if times.size < _LEAST:
        return None
    periods = times[2:] - times[:-2]
    enough = min(_FALLS, _LOCATED * task.rtol)
    if not (np.all(periods[2:] < periods[:-2]) and periods[-1] < (1 - enough) * periods[0]):
        return None
    fall = np.log(periods[0] / periods[-1])
    pace = fall / (times[-1] - times[-1 - periods.size])
    with np.errstate(over="ignore"):
        more = 2.0 * np.expm1(pace * (task.times[-1] - times[-1])) / (pace * periods[-1])
    if not more > _MORE:
        return None
    ratio = float(np.exp(-2.0 * fall / (periods.size - 1)))
    return Crowd(row=row, period=float(periods[-1]), ratio=ratio, more=float(more))


def _is_small(evaluated: LaneEquations, point: tuple, rates: np.ndarray, crowd: Crowd) -> bool:
    """Whether from one switch to the next what is compared stays within tolerances.

    On a parabola it comes as far as its rate after the switch takes it in a quarter of the way.
    It is slow as well, or there have been many: periods as 1 / n fall by 2 / n in two switches.
    """
    t, x, u = point
    ahead = crowd.period / 8
    there = abs(evaluated.switching(t + ahead, x + ahead * rates, u)[crowd.row])
    settled = there < _RATE * ahead or _MANY * (1 - crowd.ratio) < 2
    return bool(settled and there <= _WITHIN * _tolerance(evaluated, point, crowd.row))


def _tolerance(evaluated: LaneEquations, point: tuple, row: int) -> float:
    """Return by how much a switching function changes where states change by their tolerances."""
    t, x, u = point
    task = evaluated.run.task
    away = task.atol + task.rtol * np.abs(x)
    away[task.memory] = 0.0
    here = evaluated.switching(t, x, u)[row]
    moved = [
        evaluated.switching(t, x + away[i] * (np.arange(x.size) == i), u)[row] - here
        for i in np.flatnonzero(away)
    ]
    return float(np.abs(moved).sum())
