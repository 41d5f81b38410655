"""One row of a run again, bit for bit, with everything that can be seen of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.plotting.axes import BLUE, ORANGE, TIME, stacked_axes
from nlctl.wording import counted

from ..json_values import as_json
from ..robustness import Experiment, Prepared, evaluate, prepare
from ..robustness.runs.experiment import by_diagram, simulate_rows
from ..robustness.stl.formula import Band, parts_of
from .file.schema import keyed
from .folder import load_finding, load_rows, load_run
from .reading.parse import StudyFile
from .run import reopened
from .sealed import RunFolderError, origin_key

_MOST = 8  # panels of a figure


@described_record(eq=False, made_by="replay")
class Replay:
    """A row that was run again."""

    row: int
    stored: Mapping[str, Any]  # The row of the folder, and what came out now.
    again: Mapping[str, Any]
    differences: tuple[str, ...]  # Columns in which a bit differs.
    experiment: Experiment
    time: np.ndarray  # (m,)
    # (m,): All outputs; NaN after the end of a run that diverged.
    signals: Mapping[str, np.ndarray]
    versions: str = ""  # Which versions differ from those of the run, in words.

    def plain(self) -> dict[str, Any]:
        """Return the two rows and whether they are the same, as JSON can hold them.

        Returns
        -------
        dict
            Numbers that are not finite are text.
        """
        content = {key: getattr(self, key) for key in ("row", "stored", "again", "differences")}
        return as_json({"same": not self.differences, **content})

    def __str__(self) -> str:
        margins = ", ".join(
            f"{r.key} {self.again[r.key]:.6g}" for r in self.experiment.spec.requirements
        )
        outcome = f"Row {self.row}: {self.again['status']}, margins {margins}."
        if not self.differences:
            count = len(self.again)
            return f"{outcome} All {count} columns are those of the folder, bit for bit."
        first = self.differences[0]
        return (
            f"{outcome} {counted(len(self.differences), 'column differs', 'columns differ')} from "
            f"the folder, the first is '{first}', {self.stored[first]!r} there and "
            f"{self.again[first]!r} now. The loop is the same; "
            f"{self.versions or 'so are all versions: another processor?'}"
        )


@as_annotated
def replay(folder: str | Path, row: int, part: str = "", *, trust: bool = False) -> Replay:
    """Run one row of a run folder again.

    Parameters
    ----------
    folder : str or Path
        Where `run` has kept its results.
    row : int
        Number of the row, from 0.
    part : str, optional
        Key of an analysis that keeps rows of its own; by default the main table.
    trust : bool, optional
        As in `read_study`.

    Raises
    ------
    RunFolderError, StudyError
        If the folder holds no run, or one of another loop, or the loop no longer fits the study.
    ParameterError
        If the row is not there.

    Examples
    --------
    One second after a step the lag is at 1 - exp(-1 / T):

    >>> import math
    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.studies import read_study, replay, replay_figure, run, shipped
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = run(read_study(shipped("lag")), Path(folder, "run"))
    ...     last = replay(Path(folder, "run"), 1)
    >>> error = last.signals["v"][10] - (1 - math.exp(-1 / last.stored["lag.T"]))
    >>> bool(abs(error) < 1e-7), last.differences
    (True, ())
    >>> replay_figure(last).axes[0].get_title(loc="left")
    'rises: always from 1 s on v >= 0.9'
    """
    folder = Path(folder)
    run = reopened(folder, trust=trust)
    table = _table(folder, part)
    if row not in table.index:
        where = f"of '{part}'" if part else "of the main table"
        raise ParameterError(f"row {row} {where} is not there: it has {counted(len(table), 'row')}")
    wide = _widened(run.file, part)
    prepared = run.prepared if wide is None else prepare(wide)
    chosen = table.loc[[row], prepared.experiment.space.names]
    stored = table.loc[row].to_dict()
    again = evaluate(prepared, chosen).iloc[0].to_dict()
    time, signals = _signals(prepared, chosen)
    return Replay(
        row=row,
        stored=stored,
        again=again,
        differences=tuple(name for name in again if not _same(stored[name], again[name])),
        experiment=prepared.experiment,
        time=time,
        signals=signals,
        versions=run.versions,
    )


def _table(folder: Path, part: str) -> pd.DataFrame:
    origin = origin_key(load_run(folder)["origin"])
    finding = load_finding(folder, part, origin) if part else None
    if finding is not None and "rows" in finding.tables:
        return finding.tables["rows"]
    rows = load_rows(folder / part, origin)
    if rows is None:
        raise RunFolderError(f"'{folder / part}' keeps no rows")
    return rows.table


def _widened(file: StudyFile, part: str) -> Experiment | None:
    """Return what the rows of a part were run with, where it is not the study's experiment."""
    asked = keyed(file.study).get(part)
    experiment = None if asked is None else asked.definition.experiment
    if experiment is None:
        return None
    return experiment(asked, file)


def _same(one: Any, other: Any) -> bool:
    """Whether two values are equal to the last bit; NaN equals NaN."""
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    return np.float64(one).tobytes() == np.float64(other).tobytes() or (one != one != other)


def _signals(prepared: Prepared, row: pd.DataFrame) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return all outputs of a row over time."""
    ((loop, _),) = by_diagram(prepared, row)
    run = simulate_rows(prepared.experiment, loop, row, keep=loop.system.output_labels)
    return run.time, {name: samples[0] for name, samples in run.signals.items()}


@as_annotated
def replay_figure(replayed: Replay) -> Figure:
    """Draw the signals that requirements look at, with their bounds, above the other outputs.

    The bounds are drawn over the whole time; when they count, the titles say.

    Parameters
    ----------
    replayed : Replay
        As `replay` returns it.

    Returns
    -------
    Figure
        Of matplotlib; nothing is written or shown.

    Examples
    --------
    See `replay`.
    """
    bounds: dict[str, set[float]] = {}
    texts: dict[str, list[str]] = {}
    for requirement in replayed.experiment.spec.requirements:
        for band in parts_of(requirement.formula):
            if isinstance(band, Band):
                ends = {end for end in (band.lower, band.upper) if np.isfinite(end)}
                bounds.setdefault(band.signal, set()).update(ends)
        for signal in requirement.signals:
            texts.setdefault(signal, []).append(f"{requirement.key}: {requirement.formula}")
    names = [*bounds, *(name for name in replayed.signals if name not in bounds)][:_MOST]
    figure, axes = stacked_axes(rows=len(names), height=1.7)
    for ax, name in zip(axes, names, strict=True):
        ax.plot(replayed.time, replayed.signals[name], color=BLUE, linewidth=1.2)
        for end in bounds.get(name, ()):
            ax.axhline(end, color=ORANGE, linestyle="--", linewidth=1.0)
        ax.set_ylabel(name)
        ax.set_title("; ".join(texts.get(name, ())), fontsize="small", loc="left")
    axes[-1].set_xlabel(TIME)
    return figure
