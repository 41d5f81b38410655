"""A page that a command writes: its options, checks before, what is printed; a loop's own page."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from .loops import AskedRun, simulated
from .printing import say

if TYPE_CHECKING:
    from ..report.document import Claim, Report


@dataclass(frozen=True, kw_only=True)
class PageOptions:
    """What the options of a command say of its page."""

    out: Path | None = None
    threads: int | None = None
    pdf: bool = False
    interactive: bool = False
    force: bool = False
    trust: bool = False
    live: bool | Sequence[str] = False  # what the sliders move, or whether there are any
    stamp: Mapping[str, str] = field(default_factory=dict)  # revision and date, as far as given


@dataclass(frozen=True)
class WrittenPage:
    """A page that was written: its verdict, its claims, and the exit code of the command."""

    verdict: str
    title: str
    claims: Sequence[Claim]
    page: Path
    code: int


def stamped(report: Report, options: PageOptions) -> Report:
    """Return a report with its revision and date, and with the command that gives them."""
    words = [part for name, text in options.stamp.items() for part in (f"--{name}", text)]
    command = " ".join(filter(None, (report.command, shlex.join(words))))
    return replace(report, command=command, **options.stamp)


def check_report_options(folder: Path, options: PageOptions) -> None:
    """Refuse, before anything is computed, what could not be written afterwards."""
    from ..report.page import check_report_folder
    from .terminal import check_writable

    check_writable(folder)
    if not options.force:
        check_report_folder(folder)
    if options.pdf:
        from ..report.browser import find_browser

        find_browser()


def finish_report(page: Path, *, pdf: bool, open_: bool) -> None:
    """Print where the page is; print it to PDF and show it, as wanted."""
    from ..report.browser import write_pdf
    from ..studies.intact import recorded_print

    say(page)
    if pdf:
        with recorded_print(page.parent):
            say(write_pdf(page, page.with_name("report.pdf")))
    show_page(page, open_)


def show_page(page: Path, open_: bool) -> None:
    """Show a page in a browser, if that is wanted."""
    from ..report.browser import open_page

    if open_ and not open_page(page):
        say("no browser was found to show it")


def is_loop_name(text: str) -> bool:
    """Whether a text is ``file.py:function`` or ``package.module:function``, and no path."""
    place, colon, function = text.rpartition(":")
    return bool(colon and place) and function.isidentifier() and not Path(text).exists()


def is_paper_name(text: str) -> bool:
    """Whether a text is a bare word, as names of papers are, and no file or folder."""
    return text.replace("-", "_").isidentifier() and not Path(text).exists()


def page_folder(name: str) -> Path:
    """Return where the page of a loop is kept by default."""
    place, _, function = name.rpartition(":")
    stem = Path(place).stem if place.endswith(".py") else place.rpartition(".")[2]
    return Path("reports") / (stem if function == "make" else f"{stem}-{function}")


def compose_page(asked: AskedRun, live: bool | Sequence[str], required: Sequence[str]) -> Report:
    """Run a loop, check what can be checked of any, and compose its page."""
    from ..robustness.stl.spec import requirements_of

    requirements = requirements_of([(text, "") for text in required], asked.until)
    if live:
        from nlctl.export.web import check_linker

        check_linker()
    run = simulated(asked)
    from ..loop_checks import (
        LoopCheck,
        checks_of,
        checks_section,
        headline,
        in_sentences,
        proof_check,
        proof_of,
    )
    from ..loop_report import loop_report
    from .progress import progress_bar

    with progress_bar("checking the loop", 2) as advance:
        checks = checks_of(run.loop, run.response, run.params)
        advance(1)
        proof = proof_of(run.loop, asked.until, run.start, run.params)
        advance(1)
    applies = not isinstance(proof, LoopCheck)
    every = [*checks, proof_check(proof) if applies else proof]
    page = loop_report(
        run.loop,
        title=run.loop.name,
        response=run.response,
        params=run.params,
        ledger=proof if applies else None,
        sections=[checks_section(every)],
        command=shlex.join(asked.command("report")) + live_words(live, required),
        live=live,
        requirements=requirements,
        repeat=asked.command("simulate"),
    )
    return replace(page, verdict=f"{page.verdict} {in_sentences(every)}", headline=headline(every))


def live_words(live: bool | Sequence[str], required: Sequence[str] = ()) -> str:
    """Return the options of a page that runs."""
    words = [] if isinstance(live, bool) else [w for name in live for w in ("--move", name)]
    words = ["--live"] * (live is True) + words + [w for r in required for w in ("--require", r)]
    return "".join(f" {shlex.quote(word)}" for word in words)
