"""The body of ``nlctl report study.toml`` and ``nlctl report RUN``: a study's results as a page."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .studies import run_folder

if TYPE_CHECKING:
    from analysis.report.document import Section
    from analysis.robustness import Prepared
    from analysis.studies.page.histories import Histories
    from analysis.studies.result import Result
    from analysis.studies.run import Watch

__all__ = ["clear_shipped", "compile_shipped", "report_study", "run_shipped", "studies_part"]


def report_study(
    path: Path,
    out: Path | None = None,
    *,
    threads: int | None = None,
    watch: Watch | None = None,
    interactive: bool = False,
    force: bool = False,
    trust: bool = False,
) -> tuple[Path, Result]:
    """Write the report of a study.

    Parameters
    ----------
    path : Path
        A study file, which is run in ``reports/<name>`` or taken up there, or the folder of a run.
    out : Path, optional
        Folder of the report; by default that of the run.
    threads : int, optional
    watch : callable, optional
        Shows how far the rows are, see `analysis.studies.run.Watch`.
    interactive : bool, optional
        As in `analysis.report.render_html`.
    force : bool, optional
        Whether files of others are replaced, see `analysis.report.write_report`.
    trust : bool, optional
        As in `analysis.studies.read_study`.

    Returns
    -------
    page : Path
    result : Result

    Raises
    ------
    UsageError
        If the study has mistakes, or the folder holds no run, or another one.
    """
    from analysis.paper.page.text import PUBLISHED
    from analysis.report.render import write_report
    from analysis.studies import load_result
    from analysis.studies.page.loop import loop_of
    from analysis.studies.page.report import study_report

    result = (
        _run(path, threads, watch, force, trust)
        if path.suffix == ".toml"
        else load_result(path, trust=trust)
    )
    command = f"nlctl report {shlex.quote(path.as_posix())}" + " --interactive" * interactive
    prepared = _prepared(result, trust)
    loop = None if prepared is None else loop_of(prepared)
    published = PUBLISHED.get(result.study.loop)
    made = study_report(result, _histories(result, prepared, threads), command, loop, published)
    if out is not None:  # the data stay with the run
        data = Path(os.path.relpath(result.folder, out))
        made = replace(made, files={(data / k).as_posix(): v for k, v in made.files.items()})
    folder = result.folder if out is None else out
    return write_report(made, folder, interactive=interactive, force=force), result


def compile_shipped(names: Sequence[str]) -> None:
    """Compile what `run_shipped` needs besides the integrators: diagrams and metrics."""
    from analysis.robustness import prepare
    from analysis.robustness.runs.experiment import compile_ahead
    from analysis.studies import read_study, shipped

    for name in names:
        compile_ahead(prepare(read_study(shipped(name)).experiment))


def clear_shipped(names: Sequence[str], folder: Path, *, force: bool = False) -> None:
    """Remove the runs of studies that come with nlctl, to make them anew: runs and nothing else.

    Raises
    ------
    UsageError
        If a folder of such a name holds something else; with `force` that goes as well.
    """
    from analysis.studies.folder import remove_run

    for name in names:
        if (folder / name).exists():
            remove_run(folder / name, force=force)


def run_shipped(names: Sequence[str], folder: Path, threads: int | None = None) -> None:
    """Run studies that come with nlctl, each in ``folder/name``, see `clear_shipped`.

    It can be called in another process: what it finds is on the disk.

    Raises
    ------
    KeyboardInterrupt
        If a study was interrupted; those after it are not begun.
    """
    from analysis.studies import read_study, run, shipped

    for name in names:
        if run(read_study(shipped(name)), folder / name, threads=threads).interrupted:
            raise KeyboardInterrupt


def studies_part(folders: Sequence[Path], *, threads: int | None = None) -> list[Section]:
    """Return runs of studies as a part of another report.

    Parameters
    ----------
    folders : sequence of Path
        See `run_shipped`.
    threads : int, optional
        For the rows that are simulated again to be drawn.
    """
    from analysis.paper.page.text import PUBLISHED
    from analysis.studies import load_result
    from analysis.studies.page.report import study_part

    results = [load_result(folder) for folder in folders]
    found = [(r, _histories(r, _prepared(r, False), threads)) for r in results]
    return study_part(found, published=PUBLISHED)


def _run(path: Path, threads: int | None, watch: Watch | None, force: bool, trust: bool) -> Result:
    from analysis.studies import read_study, run

    how: dict[str, Any] = {} if watch is None else {"watch": watch}
    folder = run_folder(path)
    file = read_study(path, trust=trust)
    return run(file, folder, resume=True, force=force, threads=threads, **how)


def _prepared(result: Result, trust: bool) -> Prepared | None:
    """Return the loop of a run again; None, with a word on it, if the loop has gone.

    Raises
    ------
    RunFolderError
        If the results were computed from another loop than today's: nothing is drawn from it.
    """
    from analysis.studies import RunFolderError
    from analysis.studies.run import reopened
    from nlctl.errors import UsageError

    try:
        run = reopened(result.folder, trust=trust)
    except RunFolderError:
        raise
    except UsageError as error:  # what was found is shown all the same
        print(f"nlctl: the report has no fans and no diagram: {error}", file=sys.stderr)
        return None
    if run.versions:
        told = f"computed with other versions ({run.versions}): fans are drawn with those of today"
        print(f"nlctl: '{result.folder}' was {told}", file=sys.stderr)
    return run.prepared


def _histories(result: Result, prepared: Prepared | None, threads: int | None) -> Histories | None:
    """Simulate some rows of the main table again; None without rows or loop."""
    from analysis.studies.page.histories import histories

    if prepared is None or result.rows is None or not result.rows.done:
        return None
    told = [
        look(f)
        for f in result.findings
        if (look := result.asked[f.key].definition.witness) is not None and f.is_answered
    ]
    witness = min(told, key=lambda pair: pair[1], default=None)
    return histories(prepared, result.rows.table, witness, threads=threads)
