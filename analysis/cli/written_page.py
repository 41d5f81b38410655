"""A page that a command writes: what its options say, checks before, and what is printed then."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

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
    from ..studies.intact.contents import recorded_print

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
