"""How far a part of the work is: a bar in a terminal, and lines on stderr for a log."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from nlctl.wording import counted

from .printing import error_line

if TYPE_CHECKING:
    from ..robustness.runs.progress import Progress as SweepProgress

FIRST_LINE, NEXT_LINE = 2.0, 10.0  # s: what is done sooner needs no line
PERIOD = 0.25  # s between updates: drawing a bar takes as long as a run


@contextmanager
def progress_lines(what: str, progress: Callable[[], str]) -> Iterator[None]:
    """Print what is being done after two seconds, and then every ten, until the body is done."""
    begun, done = time.monotonic(), threading.Event()
    shown = threading.Event()

    def line(text: str) -> None:
        error_line(f"{what}: {text}, {time.monotonic() - begun:.0f} s")

    def watch() -> None:
        pause = FIRST_LINE
        while not done.wait(pause):
            shown.set()
            line(progress())
            pause = NEXT_LINE

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
    if shown.is_set():
        line("done")


@contextmanager
def _bar(
    what: str, console: Console, line: Callable[[], str], *columns: Any, **task: Any
) -> Iterator[Callable[..., object]]:
    """Show a bar with more columns while the body runs; elsewhere a line now and then."""
    if not console.is_terminal:
        with progress_lines(what, line):
            yield lambda **_: None
        return
    begins = (TextColumn("{task.description}"), BarColumn())
    with Progress(*begins, *columns, console=console, refresh_per_second=1 / PERIOD) as bar:
        yield partial(bar.update, bar.add_task(what, **task))


@contextmanager
def progress_bar(what: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show how much of a total is done."""
    done, columns = [0.0], (TimeElapsedColumn(), TimeRemainingColumn())

    def add(amount: float) -> None:
        done[0] += amount
        update(completed=done[0])

    with _bar(
        what, Console(stderr=True), lambda: f"{100 * done[0] / total:.0f} %", *columns, total=total
    ) as update:
        yield add


@contextmanager
def sweep_bar(
    what: str, console: Console | None = None, confidence: float = 0.99
) -> Iterator[Callable[[SweepProgress], None]]:
    """Show how far a sweep is, and what it has found."""
    # With the bar stand the rows, the rate, the remaining time, the violations so far and, for
    # independent draws, bounds of their probability that hold at any time.
    now: list[SweepProgress] = []
    shown = float("-inf")

    def line() -> str:
        return f"{rows_text(now[-1])}, {found_text(now[-1], confidence)}" if now else "begun"

    def show(progress: SweepProgress) -> None:
        nonlocal shown
        now[:] = [progress]
        if time.monotonic() < shown + PERIOD and progress.done < progress.total:
            return
        shown = time.monotonic()
        update(
            total=progress.total, completed=progress.done, rows=rows_text(progress),
            found=found_text(progress, confidence),
        )  # fmt: skip

    columns = (
        TextColumn("{task.fields[rows]}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[found]}"),
    )
    console = console or Console(stderr=True)
    with _bar(what, console, line, *columns, total=None, rows="", found="") as update:
        yield show


def rows_text(progress: SweepProgress) -> str:
    """Return how many rows are done, and how fast."""
    return f"{progress.done}/{counted(progress.total, 'row')}, {progress.rate:.3g}/s"


def found_text(progress: SweepProgress, confidence: float = 0.99) -> str:
    """Return violations so far and their running interval."""
    counted = f"{progress.violations} of {progress.runs} violate"
    bounds = progress.interval(confidence)
    if bounds is None:
        return counted
    return f"{counted}, p in [{bounds[0]:.2g}, {bounds[1]:.2g}] at {100 * confidence:.10g} %"
