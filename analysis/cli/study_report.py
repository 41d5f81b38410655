"""The body of ``nlctl report study.toml`` and ``nlctl report RUN``: a study's results as a page."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from .own_page import live_words
from .printing import error_line
from .studies import run_folder

if TYPE_CHECKING:
    from ..report.document import Report
    from ..studies.result import Result
    from ..studies.run import Watch

Stamp = Mapping[str, str]  # revision and date, as far as they are given
NO_STAMP: Stamp = MappingProxyType({})


def stamped(report: Report, stamp: Stamp) -> Report:
    """Return a report with its revision and date, and with the command that gives them."""
    options = [part for name, text in stamp.items() for part in (f"--{name}", text)]
    command = " ".join(filter(None, (report.command, shlex.join(options))))
    return replace(report, command=command, **stamp)


def report_study(
    path: Path,
    out: Path | None = None,
    *,
    threads: int | None = None,
    watch: Watch | None = None,
    interactive: bool = False,
    force: bool = False,
    trust: bool = False,
    stamp: Stamp = NO_STAMP,
    live: bool | Sequence[str] = False,
) -> tuple[Path, Result]:
    """Write the report of a study."""
    from ..pages.study.histories import loop_again, rows_again
    from ..pages.study.loop import loop_of
    from ..pages.study.report import study_report
    from ..paper.page.text import PUBLISHED
    from ..report.render import write_report
    from ..studies import load_result
    from ..studies.intact.contents import recorded_page

    if live:
        from nlctl.export.web import check_linker

        check_linker()
    result = (
        _run(path, threads, watch, force, trust)
        if path.suffix == ".toml"
        else load_result(path, trust=trust)
    )
    command = f"nlctl report {shlex.quote(path.as_posix())}" + " --interactive" * interactive
    prepared = loop_again(result, trust=trust, notify=notify)
    loop = None if prepared is None else loop_of(prepared)
    published = PUBLISHED.get(result.study.loop)
    runs = rows_again(result, prepared, threads)
    report = study_report(result, runs, command + live_words(live), loop, published)
    if live and prepared is not None:
        from ..pages.study.live import with_study_live

        report = with_study_live(report, result, prepared, runs, [] if live is True else live)
    report = stamped(report, stamp)
    if out is not None:  # the data stay with the run
        data = Path(os.path.relpath(result.folder, out))
        report = replace(report, files={(data / k).as_posix(): v for k, v in report.files.items()})
    folder = result.folder if out is None else out
    is_in_run = folder.resolve() == result.folder.resolve()  # in whose record it is then kept
    with recorded_page(folder) if is_in_run else nullcontext():
        return write_report(report, folder, interactive=interactive, force=force), result


def _run(path: Path, threads: int | None, watch: Watch | None, force: bool, trust: bool) -> Result:
    from ..studies import read_study, run

    how: dict[str, Any] = {} if watch is None else {"watch": watch}
    folder = run_folder(path)
    file = read_study(path, trust=trust)
    return run(file, folder, resume=True, force=force, threads=threads, **how)


def notify(words: str) -> None:
    """Print what a page will lack."""
    error_line(f"nlctl: {words}")
