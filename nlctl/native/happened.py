"""What has happened in a run of machine code: a table of its events."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..expressions.evaluate import evaluate_expressions
from ..responses.event_log import EventLog
from ..wording import numbered
from .compiled import Compiled
from .diagram.program import count_guards, count_switching_functions
from .equations.located import Conditions
from .integrate.events.location import behind_event
from .integrate.log import OF_TIME, log_room
from .integrate.memory import grown, with_fields
from .integrate.workspace import Task, Work

_DIRECTIONS = ("falling", "rising")
_AROUND = 1e-13  # of a time: where it is looked at before and behind a switch
_WORDS = {
    "lt": "comparison", "le": "comparison", "gt": "comparison", "ge": "comparison",
    "absolute": "abs", "minimum": "minimum", "maximum": "maximum", "remainder": "%",
    "floor_divide": "//",
}  # fmt: skip


def with_log(task: Task, work: Work) -> Any:
    """Return a workspace with room for what happens next; what is noted stays."""
    free = work.log.t.shape[0] - int(work.lanes["noted"].max())
    least = log_room(task, work.events.g.shape[0])
    if not least or free >= least:
        return work
    room = 2 * work.log.t.shape[0] + 2 * least
    return with_fields(work, log=grown(work.log, ("t", "row"), room))


class _Labelled(NamedTuple):
    """What rows are called, with the conditions that they are of."""

    conditions: Conditions
    rows: list[tuple[str, str]]


def row_labels(compiled: Compiled, conditions: Any) -> list[tuple[str, str]]:
    """Return block and name of each row of g that is noted."""
    return compiled.cache.found(
        _Labelled,
        lambda each: each.conditions is conditions,
        lambda: _Labelled(conditions, _labelled(compiled, conditions)),
    ).rows


def _labelled(compiled: Compiled, conditions: Conditions) -> list[tuple[str, str]]:
    labels: list[tuple[str, str]] = []
    nodes = compiled.schedule.nodes
    for node in nodes:
        count = count_switching_functions(node)
        names = numbered("switching", count)
        if node.slide is not None:
            what = node.slide.what[1]
            names = [what, *[f"{what}: end of sliding"] * (count - 1)]
        labels += [(node.path, name) for name in names]
    for each in conditions.located:
        names = numbered(word_of(each.what), each.rows)
        labels += [(each.block, name) for name in names]
    for node in nodes:
        count = count_guards(node)
        labels += [(node.path, name) for name in numbered("guard", count)]
    return labels


def word_of(op: str) -> str:
    """Return what an operation that switches is called."""
    return _WORDS.get(op, op)


def happened(compiled: Compiled, run: Any, j: int = 0) -> EventLog:
    """Return what has happened in lane `j` of a run."""
    conditions = run.machine.lowered.conditions
    rows = row_labels(compiled, conditions)
    labels = [(*row, direction) for row in rows for direction in _DIRECTIONS]
    count = int(run.lanes["noted"][j])
    time, coded = _resolved(compiled, run, run.work.log.t[:count, j], run.work.log.row[:count, j])
    label = np.where(coded // 2 == OF_TIME, len(labels), coded)
    if conditions.declared_of_time:
        time, label = _with_declared(conditions, run.task, j, time, label, len(labels))
    return EventLog(time=time, label=label, labels=(*labels, ("", "condition of t", "")))


def _resolved(
    compiled: Compiled, run: Any, time: np.ndarray, coded: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return events without those that come as soon behind another as location can tell."""
    # A run meets what it stays at by a small way to and fro: where it begins to slide, or comes to
    # rest at sign(0) = 0.  Twice might be a touch, where nothing says that it slides.
    late = getattr(behind_event, "py_func", behind_event)  # compiled for machine code alone
    soon = 2.0 * late(run.task.rtol)  # there and back, of the time since the event before
    row, stays, slides = coded // 2, np.ones(time.size, dtype=bool), slide_rows(compiled)
    slid = [k for rows in slides for k in rows]
    alone = set(row[coded >= 0].tolist()) & set(range(run.task.rows.watched)) - {*slid}
    for rows in (*slides, *([k] for k in alone)):
        places = np.flatnonzero(np.isin(row, rows))
        gaps = np.diff(time[places], prepend=run.task.times[0])
        for first, last in _crowds(gaps, soon):
            if last - first > (1 if len(rows) > 1 else 2):
                stays[places[first + 1 : last]] = gaps[first + 1 : last] == 0.0
    return time[stays], coded[stays]


def slide_rows(compiled: Compiled) -> list[range]:
    """Return the rows of each relay that stands for a condition: where it is met, and two ends."""
    nodes = compiled.schedule.nodes
    begins = np.cumsum([0, *map(count_switching_functions, nodes)])
    slides = (i for i, node in enumerate(nodes) if node.slide is not None)
    return [range(begins[i], begins[i + 1]) for i in slides]


def _crowds(gaps: np.ndarray, soon: float) -> Iterator[tuple[int, int]]:
    """Yield the first of events that come soon behind another, and the first behind these."""
    last = 0
    for first in np.flatnonzero(gaps[1:] <= soon * gaps[:-1]).tolist():
        if first >= last:
            further = np.flatnonzero(gaps[first + 1 :] > soon * gaps[first])
            last = first + 1 + int(further[0]) if further.size else gaps.size
            yield first, last


def _with_declared(
    conditions: Conditions, task: Task, j: int, time: np.ndarray, label: np.ndarray, of_time: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return events with what blocks declare of t, where that has switched."""
    column, times = task.p[:, j], []
    for t, code in zip(time.tolist(), label.tolist(), strict=True):
        crossed = declared_switches(conditions, column, t) if code == of_time else []
        times += [(t, 2 * row + rises) for row, rises in crossed] or [(t, code)]
    found = np.array(times, dtype=float).reshape(-1, 2)
    return found[:, 0], found[:, 1].astype(np.int64)


def declared_switches(conditions: Conditions, p: np.ndarray, t: float) -> list[tuple[int, bool]]:
    """Return which declared functions of t switch at a time: their rows, and whether they rise."""
    functions = conditions.declared_of_time
    around = t + _AROUND * max(abs(t), 1e-300) * np.array([-1.0, 1.0])
    given = {"t": around[None, :], "p": p[:, None]}
    sides = [
        np.broadcast_to(v, (1, 2))[0] for v in evaluate_expressions([*functions.values()], given)
    ]
    return [
        (row, bool(after > before))
        for row, (before, after) in zip(functions, sides, strict=True)
        if np.sign(before) != np.sign(after)
    ]
