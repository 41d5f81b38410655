"""An index page over several reports."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nlctl.annotations import as_annotated
from nlctl.errors import UsageError

from .changes import STATUS_RANK, Revision, Trend, trends
from .compare import read_report
from .document import Claim, Figure, Headline
from .outline import claim_status, summary
from .page import check_gallery_folder, fill, write_files
from .svg import inline_drawings


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One report of a gallery: its folder, what it says, and its traffic light.

    `requirements` has the id of each, and look and status of the claim that answers it.
    """

    folder: str
    title: str
    verdict: str
    light: str
    tally: str
    readable: bool = False
    revision: str = ""
    requirements: Sequence[tuple[str, str, str]] = ()
    content: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def link(self) -> str:
        """Address of the report's page, seen from the gallery."""
        return quote(f"{self.folder}/index.html", errors="surrogateescape")


def _unchecked(folder: Path) -> None:
    """Accept a report without a check."""


def entries(
    folder: str | os.PathLike[str], check: Callable[[Path], object] = _unchecked
) -> list[Entry]:
    """Return the reports below a folder, by the names of their folders."""
    # A ``report.json`` that cannot be read, has no page next to it, or that `check` refuses is
    # listed as such.
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
        claims = [Claim(**claim) for claim in report["claims"]]
        headline = report.get("headline")
        light, text = summary(claims, None if headline is None else Headline(**headline))
        if not (folder / "index.html").is_file():
            raise UsageError("a page is missing")
    except (UsageError, OSError, TypeError):
        reason = "The report is damaged, was edited, or its page is missing."
        return Entry(folder=name, title=name, verdict=reason, light="fail", tally="Cannot be read.")
    return Entry(
        folder=name,
        title=str(report["title"]),
        verdict=str(report["verdict"]),
        light=light,
        tally=text,
        readable=True,
        revision=", ".join(filter(None, (report.get("revision", ""), report.get("date", "")))),
        requirements=_requirements(claims),
        content=report,
    )


def _requirements(claims: Sequence[Claim]) -> list[tuple[str, str, str]]:
    """Return each requirement once, with look and status of the worst claim that answers it."""
    worst: dict[str, tuple[str, str]] = {}
    for claim in claims:
        status, look = claim_status(claim)
        for one in claim.ids:
            if one not in worst or STATUS_RANK[look] > STATUS_RANK[worst[one][0]]:
                worst[one] = (look, status)
    return [(one, *ended) for one, ended in worst.items()]


@as_annotated
def write_gallery(
    folder: str | os.PathLike[str],
    *,
    force: bool = False,
    check: Callable[[Path], object] = _unchecked,
    draw: Callable[[Trend], Figure] | None = None,
) -> Path:
    """Write FOLDER/index.html: every report below it with its verdict and a link.

    Where several reports have one title, as of one study at several revisions, the page shows
    their claims and main numbers by date, revision and folder.

    Parameters
    ----------
    folder : path
        Where reports lie, at any depth.
    force : bool, optional
        Whether an ``index.html`` is replaced that is not a gallery.
    check : callable, optional
        Takes the folder of a report, and raises UsageError where it is not to be believed.
    draw : callable, optional
        Takes the trend of one study, and returns its figure; without it there are tables.

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
    listed = entries(folder, check)
    if not force:
        check_gallery_folder(folder)
    page = fill("gallery.html", entries=listed, **_history(listed, draw))
    write_files(Path(folder), {"index.html": page})
    return Path(folder) / "index.html"


def _history(listed: Sequence[Entry], draw: Callable[[Trend], Figure] | None) -> dict[str, Any]:
    """Return what the page shows of studies with several reports."""
    several = trends(
        Revision(folder=e.folder, label=e.revision or e.folder, content=e.content)
        for e in listed
        if e.readable
    )
    pictures = [] if draw is None else [draw(trend) for trend in several]
    keyed = {f"trend-{number}": figure for number, figure in enumerate(pictures, 1)}
    drawings, shapes = inline_drawings(keyed)
    drawn = list(drawings.values())
    return {"trends": several, "pictures": pictures, "drawn": drawn, "shapes": shapes}
