"""An index page over several reports."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from nlctl.annotations import as_annotated
from nlctl.errors import UsageError

from .compare import read_report
from .document import Claim
from .outline import summary
from .page import check_gallery_folder, fill, write_files

__all__ = ["Entry", "entries", "write_gallery"]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One report of a gallery: its folder, what it says, and its traffic light."""

    folder: str
    title: str
    verdict: str
    light: str
    told: str
    readable: bool = False

    @property
    def link(self) -> str:
        """Address of the report's page, seen from the gallery."""
        return quote(f"{self.folder}/index.html", errors="surrogateescape")


def _unchecked(folder: Path) -> None:
    """Believe a report as it stands."""


def entries(
    folder: str | os.PathLike[str], check: Callable[[Path], object] = _unchecked
) -> list[Entry]:
    """Return the reports below a folder, by the names of their folders.

    A ``report.json`` that cannot be read, has no page beside it, or that `check` refuses is listed
    as such.
    """
    folder = Path(folder)
    files = sorted(p for p in folder.rglob("report.json") if p.parent != folder)
    if not files:
        raise UsageError(f"no report (a folder with report.json) below '{folder}'")
    return [
        _entry(path.parent, path.parent.relative_to(folder).as_posix(), check) for path in files
    ]


def _entry(folder: Path, name: str, check: Callable[[Path], object]) -> Entry:
    try:
        check(folder)
        report = read_report(folder)
        light, told = summary([Claim(**claim) for claim in report["claims"]])
        if not (folder / "index.html").is_file():
            raise UsageError("a page is missing")
    except (UsageError, OSError, TypeError):
        reason = "The report is damaged, was edited, or its page is missing."
        return Entry(folder=name, title=name, verdict=reason, light="fail", told="Cannot be read.")
    return Entry(
        folder=name,
        title=str(report["title"]),
        verdict=str(report["verdict"]),
        light=light,
        told=told,
        readable=True,
    )


@as_annotated
def write_gallery(
    folder: str | os.PathLike[str],
    *,
    force: bool = False,
    check: Callable[[Path], object] = _unchecked,
) -> Path:
    """Write FOLDER/index.html: every report below it with its verdict and a link.

    Parameters
    ----------
    folder : path
        Where reports lie, at any depth.
    force : bool, optional
        Whether an ``index.html`` is replaced that is not a gallery.
    check : callable, optional
        Takes the folder of a report, and raises UsageError where it is not to be believed.

    Returns
    -------
    pathlib.Path
        Of the page.

    Raises
    ------
    UsageError
        If there is no report, or an ``index.html`` that is not a gallery.
    OSError
        If the folder cannot be written to.

    Examples
    --------
    See `write_report`.
    """
    found = entries(folder, check)
    if not force:
        check_gallery_folder(folder)
    page = fill("gallery.html", entries=found)
    write_files(Path(folder), {"index.html": page})
    return Path(folder) / "index.html"
