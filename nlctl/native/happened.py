"""What has happened in a run of machine code: a table of its events."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..responses.event_log import EventLog
from ..wording import numbered
from .compiled import Compiled
from .diagram.program import count_guards, count_switching_functions
from .equations.located import Conditions
from .integrate.log import OF_TIME, log_room
from .integrate.memory import grown, with_fields
from .integrate.workspace import Task, Work

_WORDS = {
    "lt": "comparison", "le": "comparison", "gt": "comparison", "ge": "comparison",
    "absolute": "abs", "minimum": "minimum", "maximum": "maximum", "remainder": "%",
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
        labels += [(node.path, name) for name in numbered("switching", count)]
    for each in conditions.located:
        what: str = each.what
        names = numbered(_WORDS.get(what, what), each.rows)
        labels += [(each.block, name) for name in names]
    for node in nodes:
        count = count_guards(node)
        labels += [(node.path, name) for name in numbered("guard", count)]
    return labels


def happened(compiled: Compiled, run: Any, j: int = 0) -> EventLog:
    """Return what has happened in lane `j` of a run."""
    rows = row_labels(compiled, run.machine.lowered.conditions)
    labels = [(*row, direction) for row in rows for direction in ("falling", "rising")]
    count = int(run.lanes["noted"][j])
    coded = run.work.log.row[:count, j]
    return EventLog(
        time=run.work.log.t[:count, j].copy(),
        label=np.where(coded // 2 == OF_TIME, len(labels), coded),
        labels=(*labels, ("", "condition of t", "")),
    )
