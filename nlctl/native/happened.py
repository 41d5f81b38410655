"""What has happened in a single run of machine code: a table of its events."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..wording import numbered
from .codegen.program import count_guards, count_switching_functions
from .compiled import Compiled
from .integrate.log import OF_TIME
from .integrate.memory import with_table
from .integrate.workspace import WORK, Work

EventRow = tuple[float, str, str, str]  # time (s), block, which, direction
_WORDS = {
    "lt": "comparison", "le": "comparison", "gt": "comparison", "ge": "comparison",
    "absolute": "abs", "minimum": "minimum", "maximum": "maximum", "remainder": "%",
}  # fmt: skip


def with_log(task: Any, work: Any) -> Any:
    """Return a workspace with room for what happens next, in a single run.

    What has been noted stays; the room grows with it.

    Parameters
    ----------
    task, work : Task, Work
        See `workspace`.
    """
    least = 8 * work.g.shape[0] + 256
    free = work.log_t.size - int(work.lanes["noted"][0])
    if not task.alone or not _notes(task) or free >= least:
        return work
    room, given = 2 * work.log_t.size + 2 * least, work._asdict()
    del given["table"]
    for name in ("log_t", "log_row"):
        before = given[name]
        given[name] = np.zeros(room, dtype=before.dtype)
        given[name][: before.size] = before
    return with_table(Work, like=WORK, **given)


def _notes(task: Any) -> bool:
    return bool(task.switching or task.jumps.shape[1])


def row_labels(compiled: Compiled, conditions: Any) -> list[tuple[str, str]]:
    """Return block and name of each row of g that is noted.

    Parameters
    ----------
    compiled : Compiled
    conditions : Conditions
        Those of the program that runs.
    """
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


def happened(compiled: Compiled, run: Any) -> tuple[EventRow, ...]:
    """Return what has happened in a single run, in the order of time.

    Parameters
    ----------
    compiled : Compiled
    run : Run
    """
    labels = row_labels(compiled, run.machine.lowered.conditions)
    count = int(run.lanes["noted"][0])
    found = []
    for t, coded in zip(run.work.log_t[:count], run.work.log_row[:count].tolist(), strict=True):
        row, rises = divmod(coded, 2)
        if row == OF_TIME:
            found.append((float(t), "", "condition of t", ""))
        else:
            found.append((float(t), *labels[row], "rising" if rises else "falling"))
    return tuple(found)
