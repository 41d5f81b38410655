"""The loop of a run made again, and some of its rows simulated again, with signals kept."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
import pandas as pd

from nlctl.attributes import described_record
from nlctl.errors import UsageError
from nlctl.native import Status

from ... import metrics
from ...figures import Limit
from ...robustness.runs.experiment import Prepared, signals_of_rows
from ...robustness.search.evaluation import as_table, margins_of
from ...robustness.uncertainty.space import nominal
from ...studies.result import Result
from ...studies.run import reopened
from ...studies.sealed import RunFolderError, as_written

_MOST = 4  # signals that the spec looks at
IN_UNIT = (  # metrics whose unit is that of their signal
    *(metrics.peak, metrics.rms, metrics.highest, metrics.spread, metrics.ultimate_bound),
    metrics.total_variation,
)


@described_record(eq=False)
class Histories:
    """Signals of some rows."""

    time: np.ndarray  # (m,): In s.
    # (rows, m): What the spec looks at, NaN after the end of a run.
    signals: Mapping[str, np.ndarray]
    # (m,): The same of the nominal values, and of the row with the lowest margin that is known.
    nominal: Mapping[str, np.ndarray]
    worst: Mapping[str, np.ndarray]
    margin: float  # That margin.
    ended: int  # How many of the rows did not reach their end.
    # By signal what the spec always requires: value, and from when to when (s).
    limits: Mapping[str, Sequence[Limit]] = field(default_factory=dict)
    # By signal, as far as a metric of the study has a unit.
    units: Mapping[str, str] = field(default_factory=dict)
    # Options of each row, where the study chooses between some; else empty.
    groups: tuple[str, ...] = ()


def histories(
    prepared: Prepared,
    table: pd.DataFrame,
    witness: tuple[Mapping[str, Any], float] | None = None,
    *,
    most: int = 200,
    threads: int | None = None,
) -> Histories:
    """Simulate the first rows of a table again, the nominal one, and the worst one."""
    space = prepared.experiment.space
    margins = margins_of(table)
    lowest = int(np.argmin(margins))
    worst, margin = table.iloc[lowest].to_dict(), float(margins[lowest])
    if witness is not None and not witness[1] >= margin:
        worst, margin = nominal(space) | dict(witness[0]), float(witness[1])
    first = table.iloc[:most]
    options = first[[choice.name for choice in space.choices]].astype(str)
    both = as_table(space, [nominal(space), {name: worst[name] for name in space.names}])
    rows = pd.concat([both, first[space.names]], ignore_index=True)
    requirements = prepared.experiment.spec.requirements
    names = list(dict.fromkeys(s for r in requirements for s in r.signals))[:_MOST]
    signals, status = signals_of_rows(prepared, rows, names, threads)
    return Histories(
        time=np.asarray(prepared.experiment.timepts, dtype=float),
        signals={name: samples[2:] for name, samples in signals.items()},
        nominal={name: samples[0] for name, samples in signals.items()},
        worst={name: samples[1] for name, samples in signals.items()},
        margin=margin,
        ended=int(np.sum(status[2:] != Status.OK.name)),
        limits=prepared.experiment.spec.limits,
        units={m.signals[0]: m.unit for m in prepared.experiment.metrics if m.function in IN_UNIT},
        groups=tuple(options.agg(", ".join, axis=1)) if space.choices else (),
    )


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
