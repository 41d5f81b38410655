"""What a page draws from the loop of a run: it is made again, and some rows are simulated again."""

from __future__ import annotations

from collections.abc import Callable

from nlctl.errors import UsageError

from ...robustness import Prepared
from ...studies.result import Result
from ...studies.run import reopened
from ...studies.sealed import RunFolderError, as_written
from .histories import Histories, histories


def loop_again(
    result: Result, *, trust: bool = False, notify: Callable[[str], object]
) -> Prepared | None:
    """Return the loop of a run again; None if it has gone."""
    try:
        run = reopened(result.folder, trust=trust)
    except RunFolderError:
        raise
    except UsageError as error:  # what was found is shown all the same
        notify(f"the report has no fans and no diagram: {error}")
        return None
    if run.versions:
        notify(
            f"'{result.folder}' was computed with other versions ({run.versions}): fans are drawn "
            "with those of today"
        )
    return run.prepared


def rows_again(
    result: Result, prepared: Prepared | None, threads: int | None = None
) -> Histories | None:
    """Simulate some rows of the main table again; None without rows or loop."""
    if prepared is None or result.rows is None or not result.rows.done:
        return None
    with as_written(f"'{result.folder}'"):
        witnesses = [
            look(f)
            for f in result.findings
            if (look := result.asked[f.key].definition.witness) is not None and f.is_answered
        ]
    witness = min(witnesses, key=lambda pair: pair[1], default=None)
    return histories(prepared, result.rows.table, witness, threads=threads)
