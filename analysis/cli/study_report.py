"""The body of ``nlctl report study.toml`` and ``nlctl report RUN``: a study's results as a page."""

import os
import shlex
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from ..pages.study.histories import loop_again, rows_again
from ..pages.study.loop import loop_of
from ..pages.study.report import study_report
from ..paper.page.text import PUBLISHED
from ..report.render import write_report
from ..studies import Result, load_result, read_study, run
from ..studies.intact import recorded_page
from .printing import notify
from .progress import sweep_bar
from .studies import run_folder
from .written_page import PageOptions, live_words, stamped


def report_study(path: Path, options: PageOptions) -> tuple[Path, Result]:
    """Write the report of a study."""
    live, threads, trust = options.live, options.threads, options.trust
    if live:
        from nlctl.export.web import check_linker

        check_linker()
    if path.suffix == ".toml":
        file, folder = read_study(path, trust=trust), run_folder(path)
        result = run(
            file, folder, resume=True, force=options.force, threads=threads, watch=sweep_bar
        )
    else:
        result = load_result(path, trust=trust)
    words = " --interactive" * options.interactive + live_words(live)
    command = f"nlctl report {shlex.quote(path.as_posix())}{words}"
    prepared = loop_again(result, trust=trust, notify=notify)
    loop = None if prepared is None else loop_of(prepared)
    published = PUBLISHED.get(result.study.loop)
    runs = rows_again(result, prepared, threads)
    report = study_report(result, runs, command, loop, published)
    if live and prepared is not None:
        from ..pages.live import with_study_live

        report = with_study_live(report, result, prepared, runs, [] if live is True else live)
    report = stamped(report, options)
    if options.out is not None:  # the data stay with the run
        data = Path(os.path.relpath(result.folder, options.out))
        report = replace(report, files={(data / k).as_posix(): v for k, v in report.files.items()})
    folder = options.out or result.folder
    is_in_run = folder.resolve() == result.folder.resolve()  # in whose record it is then kept
    with recorded_page(folder) if is_in_run else nullcontext():
        page = write_report(report, folder, interactive=options.interactive, force=options.force)
    return page, result
