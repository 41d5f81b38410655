"""What the command line prints, and the checks it makes before any work is done."""

from __future__ import annotations

import os
import sysconfig
import tempfile
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from nlctl.errors import ParameterError
from nlctl.host.checkout import SOURCES
from nlctl.host.files import replace_file

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

FIGURE_FORMATS = (".svg", ".png", ".pdf")


def check_writable(folder: Path) -> None:
    """Refuse a folder that cannot be written to, before anything is computed."""
    existing = next(p for p in (folder, *folder.absolute().parents) if p.exists())
    if not existing.is_dir():
        raise ParameterError(f"cannot write to '{folder}': '{existing}' is not a folder")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise ParameterError(f"cannot write to '{folder}': no permission for '{existing}'")
    try:
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:  # /proc, a full disk, a file system that is read-only
        why = error.strerror or error
        raise ParameterError(f"cannot write to '{folder}': {why} ('{existing}')") from None


def check_file(path: Path) -> None:
    """Refuse a file that could not be written, before anything is computed."""
    if path.is_dir():
        raise ParameterError(f"cannot write '{path}': it is a folder")
    check_writable(path.parent)
    if not path.parent.is_dir():
        raise ParameterError(f"cannot write '{path}': there is no folder '{path.parent}'")


def check_figure(path: Path) -> None:
    """Refuse a figure format that cannot be written, or a folder that cannot be written to."""
    if path.suffix.lower() not in FIGURE_FORMATS:
        raise ParameterError(
            f"cannot write figure '{path}': its name must end in {', '.join(FIGURE_FORMATS)}"
        )
    check_file(path)


def write_figure(path: Path, figure: Figure) -> None:
    """Write a matplotlib figure in one step, in the format that its name ends in."""
    replace_file(path, lambda file: figure.savefig(file, format=path.suffix[1:].lower()))


def show_metrics(times: np.ndarray, signals: Mapping[str, np.ndarray]) -> None:
    """Print peak, last half's peak and RMS, and final value of every signal."""
    from ..metrics import final, over, peak, rms

    half = times[-1] / 2
    table = Table("signal", "max |.|", f"max |.|, t ≥ {half:g} s", f"RMS, t ≥ {half:g} s", "at end")
    for name, y in signals.items():
        late = over(times, y, half, times[-1])
        numbers = (peak(times, y), peak(*late), rms(*late), final(times, y))
        table.add_row(name, *(f"{v + 0.0:.6g}" for v in numbers))  # no -0
    Console().print(table)


def trace_of(error: BaseException) -> str:
    """Return what is printed of an error that is not a mistake of usage."""
    # Where it comes from a function of the user's, that is its kind, its message and the lines of
    # the user's files; otherwise the whole trace.
    frames = traceback.extract_tb(error.__traceback__)
    users = [frame for frame in frames if _is_users(Path(frame.filename))]
    if not users:
        return "".join(traceback.format_exception(error)).rstrip()
    lines = [f"nlctl: {type(error).__name__}: {error}"]
    for frame in users:
        lines.append(f'  File "{frame.filename}", line {frame.lineno}, in {frame.name}')
        lines += [f"    {frame.line}"] if frame.line else []
    return "\n".join(lines)


def _is_users(path: Path) -> bool:
    """Whether a file is neither nlctl's, nor of an installed package or Python's own."""
    if not path.is_file() or {"site-packages", "dist-packages"} & set(path.parts):
        return False
    installed = {Path(part) for key, part in sysconfig.get_paths().items() if "lib" in key}
    roots = [*SOURCES, *installed]
    places = {path, path.resolve()}
    return not any(place.is_relative_to(root) for place in places for root in roots)
