"""The commands about reports: make, show, compare, list them."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nlctl.errors import UsageError
from nlctl.wording import counted

from ..papers import paper_key
from . import studies, written_page
from .loops import USUAL_HORIZON, USUAL_STEP, AskedRun, given_tolerances
from .memory import TO_BEGIN, check_memory
from .printing import error_line, in_json, notify, say
from .written_page import compose_page, is_loop_name, is_paper_name, page_folder

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..report.document import Report

Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help='A parameter ("actuator.b_r=0.6") or an initial state ("plant.x1(0)=0.8") of a loop.',
    ),
]
Input = Annotated[
    list[str] | None,
    typer.Option("--input", metavar="NAME=VALUE", help="A constant input of a loop; 0 by default."),
]
Rtol = Annotated[
    float | None, typer.Option(help="Relative tolerance of a run of a loop; 1e-8 by default.")
]
Atol = Annotated[
    float | None,
    typer.Option(help="The absolute one, in the units of states; 1e-10 by default."),
]
Open = Annotated[bool, typer.Option("--open", help="Show the page in a browser.")]
Pdf = Annotated[bool, typer.Option("--pdf", help="Also print it to report.pdf.")]
Interactive = Annotated[
    bool, typer.Option("--interactive", help="Add charts to zoom in and to read values from.")
]
Force = Annotated[
    bool, typer.Option("--force", help="Replace files of others in the folder of the page.")
]


def report(
    what: Annotated[
        Path | None,
        typer.Argument(
            metavar="WHAT",
            help="A study file (.toml), which is run or taken up, the folder of a run, a loop: "
            "path/to/file.py:function or package.module:function, or a paper such as "
            "tabuada_2007. Without it, lv_2017: both examples, the proof, a quick study of each.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the report; reports/paper, reports/FILE, or that of the run."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=0, help="Threads; 0: one per core.")] = 0,
    far: Annotated[
        bool,
        typer.Option("--far", help="Run Example 2 to its burst instead of showing the record."),
    ] = False,
    set_: Set = None,
    input_: Input = None,
    until: Annotated[float | None, typer.Option(help="Horizon of a loop in s; 20.")] = None,
    step: Annotated[
        float | None, typer.Option(help="Sampling interval of a loop, s; 0.01.")
    ] = None,
    rtol: Rtol = None,
    atol: Atol = None,
    open_: Open = False,
    pdf: Pdf = False,
    junit: studies.Junit = None,
    interactive: Interactive = False,
    live: Annotated[
        bool,
        typer.Option("--live", help="Let the page run what it shows, with sliders."),
    ] = False,
    move: Annotated[
        list[str] | None,
        typer.Option(
            "--move",
            metavar="NAME[=LOW:HIGH]",
            help='What the sliders move: "plant.a", "plant.x1(0)", an input, the block of a '
            "fault; a sensible few by default.",
        ),
    ] = None,
    require: Annotated[
        list[str] | None,
        typer.Option(
            "--require",
            metavar="TEXT",
            help='What the page watches: "always from 5 s on |e| <= 0.1", as in a study.',
        ),
    ] = None,
    revision: Annotated[
        str, typer.Option(help="Of what is reported; it stands on the page and in galleries.")
    ] = "",
    date: Annotated[str, typer.Option(help="The same for a date.")] = "",
    force: Force = False,
    trust: studies.Trust = False,
) -> None:
    """Write a report, one page that needs nothing else.  Exit 1 if a claim of it fails.

    Rows of a study are drawn from its loop: the code that the study names is run.
    """
    options = written_page.PageOptions(
        out=out,
        threads=jobs or None,
        pdf=pdf,
        interactive=interactive,
        force=force,
        trust=trust,
        live=move or live,
        stamp={k: v for k, v in (("revision", revision), ("date", date)) if v},
    )
    with studies.exit_codes(json=False):
        is_loop = what is not None and is_loop_name(str(what))
        _check_loop_options(is_loop, set_, input_, until, step, rtol, atol, require)
        studies.check_junit(junit)
        if what is None or is_paper_name(str(what)):
            _check_nothing_moves(move)
            key = "lv_2017" if what is None else paper_key(str(what), "file, folder or paper")
            folder = out or Path("reports", "paper" if what is None else key)
            written = _paper(key, folder, options, far=far)
        elif is_loop:
            run = AskedRun(
                loop=str(what),
                settings=set_ or [],
                inputs=input_ or [],
                until=USUAL_HORIZON if until is None else until,
                step=USUAL_STEP if step is None else step,
                tolerances=given_tolerances(rtol, atol),
            )
            written = _loop(run, require or [], options)
        else:
            written = _study(what, options)
        from ..report.typography import plain_text

        say(plain_text(written.verdict))
        written_page.finish_report(written.page, pdf=pdf, open_=open_)
        studies.write_claims(junit, written.title, written.claims)
        if written.code:
            raise typer.Exit(written.code)


def _check_loop_options(is_loop: bool, *options: object) -> None:
    """Refuse what is set of a loop where there is none."""
    if not is_loop and any(option is not None for option in options):
        raise UsageError(
            "--set, --input, --until, --step, --rtol, --atol and --require are of a loop, "
            "path/to/file.py:function; a study has them in its file"
        )


def _check_nothing_moves(move: Sequence[str] | None) -> None:
    """Refuse sliders of one's own on the page of a paper."""
    if move:
        raise UsageError(
            "--move is of a loop or a study; the page of a paper has its own sliders, with --live"
        )


def _loop(
    run: AskedRun, required: Sequence[str], options: written_page.PageOptions
) -> written_page.WrittenPage:
    """Report a loop of the user's."""
    folder = options.out or page_folder(run.loop)
    written_page.check_report_options(folder, options)
    from ..report.render import write_report

    composed = written_page.stamped(compose_page(run, options.live, required), options)
    page = write_report(composed, folder, interactive=options.interactive, force=options.force)
    code = int(not all(claim.holds for claim in composed.claims))
    return _written(composed, page, code)


def _paper(
    name: str, out: Path, options: written_page.PageOptions, *, far: bool
) -> written_page.WrittenPage:
    """Reproduce a paper."""
    with _other_process() as beside:
        beside.submit(_import_ahead, name)  # first of all: imports there and here take seconds
        written_page.check_report_options(out, options)
        from ..papers import named_paper
        from ..report.render import write_report
        from ..reproductions.page import compose_paper
        from .progress import progress_bar

        paper = named_paper(name)
        if options.live:
            from ..reproductions.live import check_moved, with_parts_live

            check_moved(paper)
        if paper.clear is not None:
            paper.clear(out, force=options.force)
        composed = compose_paper(
            paper, out, whole=far, threads=options.threads, beside=beside, watch=progress_bar,
            notify=notify,
        )  # fmt: skip
        report = composed.report
        if options.live:
            report = with_parts_live(paper, report)
        words = " --far" * far + " --interactive" * options.interactive
        words += " --live" * bool(options.live)
        report = written_page.stamped(replace(report, command=report.command + words), options)
        page = write_report(
            report, out, interactive=options.interactive, force=options.force, pool=beside,
            drawn=composed.drawn,
        )  # fmt: skip
    return _written(report, page, int(not composed.passed))


def _written(report: Report, page: Path, code: int) -> written_page.WrittenPage:
    return written_page.WrittenPage(report.verdict, report.title, report.claims, page, code)


def _import_ahead(name: str) -> None:
    from ..papers import named_paper

    named_paper(name)


@contextmanager
def _other_process() -> Iterator[Executor]:
    """Lend a process for the other core; it ends when the body fails, whatever it is doing."""
    from multiprocessing import active_children

    from nlctl.host.workers import process_pool

    with process_pool(1) as pool:
        try:
            yield pool
        except BaseException:
            for process in active_children():
                process.terminate()
            raise


def _study(study: Path, options: written_page.PageOptions) -> written_page.WrittenPage:
    """Report a study."""
    check_memory(TO_BEGIN)
    from ..pages.study.claims import claims
    from .study_report import report_study

    is_file = study.suffix == ".toml"
    if is_file:
        studies.check_study_path(study)
    elif study.is_file():
        studies.check_run_path(study)
    kept = studies.run_folder(study) if is_file else study
    written_page.check_report_options(options.out or kept, options)
    page, result = report_study(study, options)
    if is_file and not result.complete:
        error_line("nlctl: incomplete; the same command resumes")
    title = result.study.study.title
    return written_page.WrittenPage(
        result.verdict, title, claims(result), page, studies.exit_code(result)
    )


def compare_command(
    first: Annotated[Path, typer.Argument(help="report.json, its folder, or that of a run.")],
    second: Annotated[Path, typer.Argument(help="Another one.")],
    rtol: Annotated[float, typer.Option(help="Numbers this close count as equal.")] = 0.0,
    out: Annotated[
        Path | None, typer.Option(help="Folder for a page of what differs; none by default.")
    ] = None,
    open_: Open = False,
    pdf: Pdf = False,
    force: Force = False,
    json: studies.Json = False,
) -> None:
    """Say what differs between two reports or two runs of studies; exit 1 if anything does.

    With --out a page shows it: claims, numbers, figures, and signals of both.
    """
    _check_page_options(out, pdf=pdf, open_=open_, force=force)
    same = compare_reports(first, second, rtol=rtol, as_json=json)
    if out is not None:
        from ..pages.compared import compose_comparison
        from ..report.render import write_report

        comparison = compose_comparison(first, second, out, rtol)
        page = write_report(comparison, out, force=force)
        with redirect_stdout(sys.stderr):  # what differs, alone, is on stdout
            written_page.finish_report(page, pdf=pdf, open_=open_)
    if not same:
        raise typer.Exit(1)


def _check_page_options(out: Path | None, *, pdf: bool, open_: bool, force: bool) -> None:
    """Refuse what is set of a page where none is made, or where it could not be written."""
    if out is not None:
        written_page.check_report_options(out, written_page.PageOptions(pdf=pdf, force=force))
    elif pdf or open_ or force:
        raise UsageError("--pdf, --open and --force are of a page: say where, with --out DIR")


def write_gallery_of(
    folder: Annotated[Path, typer.Argument(help="Folder with reports below it.")],
    open_: Open = False,
    force: Force = False,
) -> None:
    """Write FOLDER/index.html: every report below it with its verdict.

    Reports of one title are shown over their dates and revisions.
    """
    from ..pages.compared import trend_figure
    from ..report.gallery import write_gallery
    from ..studies.intact import check_page
    from .terminal import check_writable

    check_writable(folder)
    page = write_gallery(folder, force=force, check=check_page, draw=trend_figure)
    say(page)
    written_page.show_page(page, open_)


def compare_reports(first: Path, second: Path, *, rtol: float, as_json: bool) -> bool:
    """Print what differs, one thing a line; return whether nothing does."""
    # Two runs are compared by their results where one of them has no report. The folder of a run
    # has to be whole.
    from ..report.compare import compare_contents
    from ..studies import origin_differences, run_differences
    from ..studies.differences import long_table_differences

    paths = (first, second)
    for path in paths:
        _check_run(path)
    without = [p for p in paths if p.is_dir() and not (p / "report.json").exists()]
    as_runs = bool(without) and all((p / "results.json").exists() for p in paths)
    if not as_runs:
        for path in (p for p in paths if p in without or not p.exists()):
            raise _no_report(path)
    are_runs = all((path / "results.json").exists() for path in paths)
    differences: list[Any] = (
        run_differences(first, second)
        if as_runs
        else compare_contents(first, second, rtol=rtol, common=are_runs)
    )
    if are_runs and not as_runs:
        differences += long_table_differences(first, second, rtol)
    if as_runs and (origins := origin_differences(first, second)):
        error_line(f"nlctl: the two runs were not computed from the same: {origins}")
    if as_json:
        origins = [text if isinstance(text, str) else vars(text) for text in differences]
        print(in_json(origins))
        return not differences
    for difference in differences:
        say(difference)
    say(counted(len(differences), "difference") if differences else "no difference")
    return not differences


def _check_run(path: Path) -> None:
    """Refuse a run, or its page, of which something was lost or edited."""
    from ..studies import load_result
    from ..studies.intact import check_page, is_run

    folder = path if path.is_dir() else path.parent
    has_page = (folder / "report.json").exists()
    if (folder / "results.json").exists() or (is_run(folder) and has_page):
        load_result(folder)  # of a damaged folder nothing is believed
        if has_page:
            check_page(folder)


def _no_report(path: Path) -> UsageError:
    """Return why a path cannot be compared, with the next step."""
    if not path.exists():
        return UsageError(f"there is no '{path}': compare needs two reports, or two runs")
    run = shlex.quote(str(path))
    if (path / "results.json").exists():
        return UsageError(f"'{path}' is a run without a report: make it with 'nlctl report {run}'")
    if (path / "study.toml").exists():
        return UsageError(
            f"'{path}' is a run that is not done: finish it with 'nlctl run STUDY --resume'"
        )
    return UsageError(f"'{path}' holds neither a report nor a run of a study")
