"""A sweep's progress in a terminal."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from nlctl.wording import counted

from .progress_lines import progress_lines

if TYPE_CHECKING:
    from ..robustness.runs.progress import Progress as SweepProgress

PERIOD = 0.25  # s between updates: drawing a bar takes as long as a run


@contextmanager
def sweep_bar(
    what: str, console: Console | None = None, confidence: float = 0.99
) -> Iterator[Callable[[SweepProgress], None]]:
    """Show a bar on stderr while the body runs; elsewhere a line now and then."""
    # With the bar stand the rows, the rate, the remaining time, the violations so far and, for
    # independent draws, bounds of their probability that hold at any time.
    console = console or Console(stderr=True)
    if not console.is_terminal:
        now: list[SweepProgress] = []

        def line() -> str:
            return f"{rows_text(now[-1])}, {found_text(now[-1], confidence)}" if now else "begun"

        with progress_lines(what, line):
            yield lambda progress: now.__setitem__(slice(None), [progress])
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[rows]}"))
    with Progress(
        *columns,
        TimeRemainingColumn(),
        TextColumn("{task.fields[found]}"),
        console=console,
        refresh_per_second=1 / PERIOD,
    ) as bar:
        task = bar.add_task(what, total=None, rows="", found="")
        shown = float("-inf")

        def show(progress: SweepProgress) -> None:
            nonlocal shown
            if time.monotonic() < shown + PERIOD and progress.done < progress.total:
                return
            shown = time.monotonic()
            bar.update(
                task,
                total=progress.total,
                completed=progress.done,
                rows=rows_text(progress),
                found=found_text(progress, confidence),
            )

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
