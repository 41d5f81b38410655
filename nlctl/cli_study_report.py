"""The body of ``nlctl report study.toml`` and ``nlctl report RUN``: a study's results as a page."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .cli_studies import run_folder

if TYPE_CHECKING:
    from analysis.report.document import Section
    from analysis.report.robustness_histories import Histories
    from analysis.robustness import Prepared
    from analysis.studies.result import Result
    from analysis.studies.run import Watch

__all__ = ["compile_shipped", "report_study", "run_shipped", "studies_part"]


def report_study(
    path: Path,
    out: Path | None = None,
    *,
    threads: int | None = None,
    watch: Watch | None = None,
    interactive: bool = False,
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

    Returns
    -------
    page : Path
    result : Result

    Raises
    ------
    UsageError
        If the study has mistakes, or the folder holds no run, or another one.
    """
    from analysis.report.render import write_report
    from analysis.report.robustness_part import study_report
    from analysis.report.study_loop import loop_of
    from analysis.studies import load_result

    result = _run(path, threads, watch) if path.suffix == ".toml" else load_result(path)
    command = f"nlctl report {shlex.quote(path.as_posix())}" + " --interactive" * interactive
    prepared = _prepared(result)
    loop = None if prepared is None else loop_of(prepared)
    made = study_report(result, _histories(result, prepared, threads), command, loop)
    if out is not None:  # the data stay with the run
        data = Path(os.path.relpath(result.folder, out))
        made = replace(made, files={(data / k).as_posix(): v for k, v in made.files.items()})
    folder = result.folder if out is None else out
    return write_report(made, folder, interactive=interactive), result


def compile_shipped(names: Sequence[str]) -> None:
    """Compile what `run_shipped` needs besides the integrators: diagrams and metrics."""
    from analysis.robustness import prepare
    from analysis.robustness.experiment import compile_ahead
    from analysis.studies import read_study, shipped

    for name in names:
        compile_ahead(prepare(read_study(shipped(name)).experiment))


def run_shipped(names: Sequence[str], folder: Path, threads: int | None = None) -> None:
    """Run studies that come with nlctl, each in ``folder/name``; a run that is there is replaced.

    It can be called in another process: what it finds is on the disk.

    Raises
    ------
    KeyboardInterrupt
        If a study was interrupted; those after it are not begun.
    """
    from analysis.studies import read_study, run, shipped

    for name in names:
        if (folder / name / "run.json").exists():
            shutil.rmtree(folder / name)
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
    from analysis.report.robustness_part import study_part
    from analysis.studies import load_result

    results = [load_result(folder) for folder in folders]
    return study_part([(r, _histories(r, _prepared(r), threads)) for r in results])


def _run(path: Path, threads: int | None, watch: Watch | None) -> Result:
    from analysis.studies import read_study, run

    how: dict[str, Any] = {} if watch is None else {"watch": watch}
    return run(read_study(path), run_folder(path), resume=True, threads=threads, **how)


def _prepared(result: Result) -> Prepared | None:
    """Return the loop of a run again; None, with a word on it, if the loop has gone.

    Raises
    ------
    RunFolderError
        If the results were computed from another loop than today's: nothing is drawn from it.
    """
    from analysis.studies import RunFolderError
    from analysis.studies.run import reopened

    from ._errors import UsageError

    try:
        run = reopened(result.folder)
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
    from analysis.report.robustness_histories import histories

    if prepared is None or result.rows is None or not result.rows.done:
        return None
    searched = [f.numbers for f in result.findings if f.kind == "worst case" and f.is_answered]
    witness = min(
        ((n["witness"], n["margin"]) for n in searched), key=lambda pair: pair[1], default=None
    )
    return histories(prepared, result.rows.table, witness, threads=threads)
