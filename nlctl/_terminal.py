"""What the command line prints, and the checks it makes before any work is done."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from ._errors import ParameterError
from ._files import replace_file
from ._param import declared_params

FIGURE_FORMATS = (".svg", ".png", ".pdf")


@contextmanager
def progress_bar(what: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show a bar on stderr while the body runs, if that is a terminal."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(
        *columns, TimeRemainingColumn(), console=console, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task(what, total=total)
        yield lambda amount: bar.advance(task, amount)


def check_writable(folder: Path) -> None:
    """Refuse a folder that cannot be written to, before anything is computed.

    Raises
    ------
    ParameterError
        With the path and the reason.
    """
    existing = next(p for p in (folder, *folder.absolute().parents) if p.exists())
    if not existing.is_dir():
        raise ParameterError(f"cannot write to '{folder}': '{existing}' is not a folder")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise ParameterError(f"cannot write to '{folder}': no permission for '{existing}'")


def check_figure(path: Path) -> None:
    """Refuse a figure format that cannot be written, or a folder that cannot be written to.

    Raises
    ------
    ParameterError
        With the path and the rule.
    """
    if path.suffix.lower() not in FIGURE_FORMATS:
        raise ParameterError(
            f"cannot write figure '{path}': its name must end in {', '.join(FIGURE_FORMATS)}"
        )
    check_writable(path.parent)


def write_figure(path: Path, figure: Any) -> None:
    """Write a matplotlib figure in one step, in the format that its name ends in."""
    replace_file(path, lambda file: figure.savefig(file, format=path.suffix[1:].lower()))


def show_metrics(times: np.ndarray, signals: Mapping[str, np.ndarray]) -> None:
    """Print peak, last half's peak and RMS, and final value of every signal."""
    from analysis.metrics import final, over, peak, rms

    half = times[-1] / 2
    table = Table("signal", "max |.|", f"max |.|, t ≥ {half:g} s", f"RMS, t ≥ {half:g} s", "at end")
    for name, y in signals.items():
        late = over(times, y, half, times[-1])
        numbers = (peak(times, y), peak(*late), rms(*late), final(times, y))
        table.add_row(name, *(f"{v:.6g}" for v in numbers))
    Console().print(table)


def show_blocks(name: str | None) -> None:
    """Print the parameter table of one block, or of all, and the examples."""
    from ._catalogue import block_records, named_block

    console = Console()
    records = block_records() if name is None else {name: named_block(name)}
    for key, record in records.items():
        summary = (record.__doc__ or "").strip().splitlines()[0]
        table = Table("parameter", "default", "unit", "bounds", "meaning", title=None)
        defaults = {f.name: f.default for f in dataclasses.fields(record)}
        for field, rule in declared_params(record).items():
            default = np.asarray(defaults[field])
            text = str(defaults[field]) if default.size <= 4 else f"{default.shape} values"
            table.add_row(field, text, rule.unit, rule.bounds, rule.meaning)
        console.print(f"[bold]{key}[/bold]  {summary}", highlight=False)
        if table.row_count:
            console.print(table)
        console.print()
    if not name:
        console.print("[bold]Examples[/bold]  example-1 (dead zone), example-2 (backlash)")
