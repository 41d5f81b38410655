"""Files that this package has made, told from those of others: only those are replaced."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path

from nlctl._errors import UsageError

__all__ = ["PARTS", "check_gallery_folder", "check_report_folder", "generator"]

PARTS = ("title", "verdict", "claims", "numbers", "sections")  # of a report.json
MADE = re.compile(r'<meta name="generator" content="(nlctl \w+)">')
HEAD = 4096  # bytes of a page in which its generator stands


def generator(template: str) -> str:
    """Return what the page of a template says of who made it."""
    return f"nlctl {Path(template).stem}"


def check_report_folder(folder: str | os.PathLike[str]) -> None:
    """Refuse a folder whose files a report would replace, unless a report has made them.

    Raises
    ------
    UsageError
        With the file, and what to do.
    """
    folder = Path(folder)
    page, content, print_ = (folder / n for n in ("index.html", "report.json", "report.pdf"))
    is_own = _maker(page) == generator("report.html")
    foreign = [p for p, own in ((page, is_own), (content, _is_report(content))) if not own]
    foreign += [] if is_own else [print_]
    _refuse([path for path in foreign if path.exists()], "take another folder with --out")


def check_gallery_folder(folder: str | os.PathLike[str]) -> None:
    """Refuse a folder whose ``index.html`` is not that of a gallery.

    Raises
    ------
    UsageError
        With the file, and what to do.
    """
    page = Path(folder) / "index.html"
    if page.exists() and _maker(page) != generator("gallery.html"):
        _refuse([page], "move it away")


def _refuse(foreign: Sequence[Path], remedy: str) -> None:
    if foreign:
        raise UsageError(
            f"'{foreign[0]}' would be replaced, and this command has not made it: {remedy}, or "
            "replace it with --force"
        )


def _maker(page: Path) -> str:
    """Return who made a page; nothing if it does not say, or cannot be read."""
    try:
        with page.open("rb") as file:
            found = MADE.search(file.read(HEAD).decode(errors="replace"))
    except OSError:
        return ""
    return found[1] if found else ""


def _is_report(path: Path) -> bool:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(content, dict) and all(part in content for part in PARTS)
