"""Report -> one self-contained HTML file, and ``report.json`` next to it.

Text is escaped by Jinja2.  The only markup that passes unescaped is what this package makes
itself: figures (`svg`), formulas through a whitelist (`formula`), the page's own style and
script (`page`).  The page's content policy allows exactly those two, by hash, and nothing from
outside.
"""

import hashlib
import html
import json
import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record, with_parameters_of
from nlctl.errors import ParameterError

from ..json_values import as_json
from .document import Figure, History, Item, Live, Report, Table
from .history import SIGNALS_FILE, chart, signals_json
from .outline import evidence_anchors, kind, meanings, place_anchors, summary
from .page import check_report_folder, fill, to_bytes, write_files
from .svg import NONE_DRAWN, Drawn, inline_drawings
from .typography import plain_text

RARE = ("ids", "links")
DRAWN = ("figure", "time", "signals", "bands", "program")  # curves are on the page only
_IN_FILE = (  # in this order
    *("title", "question", "verdict", "author", "revision", "date", "lead", "claims", "sections"),
    *("numbers", "command", "methods", "limits", "references", "provenance", "inputs", "files"),
)
_TITLES = {
    "methods": "Methods",
    "limits": "Limits of validity",
    "references": "References",
    "provenance": "Reproducing this report",
}


@as_annotated
def render_html(
    report: Report,
    *,
    interactive: bool = False,
    pool: Executor | None = None,
    drawn: Drawn = NONE_DRAWN,
) -> str:
    """Return the report as one HTML page without references to anything outside.

    Parameters
    ----------
    report : Report
        What is on the page.
    interactive : bool, optional
        Whether its `History` items become charts, drawn by a script inside the page.
    pool : concurrent.futures.Executor, optional
        Processes that help with drawing the figures.
    drawn : mapping, optional
        Figures that are drawn already, see `nlctl.analysis.report.svg.draw_ahead`.

    Returns
    -------
    str
        The page.

    Examples
    --------
    See `Report`.
    """
    placed = place_anchors(report)
    light, text = summary(report.claims, report.headline)
    items = {anchor: item for part in placed for anchor, _, item in part.items}
    figures = {} if report.lead is None else {"lead": report.lead}
    figures |= {anchor: item for anchor, item in items.items() if isinstance(item, Figure)}
    drawings, shapes = inline_drawings(figures, pool, drawn)
    shown = items.items() if interactive else ()
    charts = {anchor: chart(item) for anchor, item in shown if isinstance(item, History)}
    texts = _texts_of(report).items()
    data_files = {name: hashlib.sha256(to_bytes(text)).hexdigest() for name, text in texts}
    return fill(
        "report.html",
        interactive=bool(charts),
        live=any(isinstance(item, Live) for item in items.values()),
        charts=charts,
        report=report,
        byline=_byline(report),
        placed=placed,
        drawings=drawings,
        shapes=shapes,
        evidence=evidence_anchors(placed),
        extra={k: t for k, t in _TITLES.items() if getattr(report, k) or k == "provenance"},
        light=light,
        tally=text,
        margins=any(claim.margin for claim in report.claims),
        meanings=meanings(report.claims),
        has_signals=SIGNALS_FILE in data_files,
        made_by=_pairs("What made it.", ("what", "version or value"), report.provenance),
        beside=_pairs(
            "Files that belong to this page, with their places as seen from it.",
            ("file", "SHA-256"),
            data_files | dict(report.files),
        ),
    )


def _texts_of(report: Report) -> dict[str, str]:
    """Return the files next to a page."""
    texts = {"report.json": render_json(report), SIGNALS_FILE: signals_json(report)}
    return {name: text for name, text in texts.items() if text}


def _byline(report: Report) -> str:
    """Return what stands below the title: who, which revision, when."""
    revision = f"Revision {report.revision}" if report.revision else ""
    return ", ".join(filter(None, (report.author, revision, report.date)))


def _pairs(caption: str, columns: tuple[str, str], values: Mapping[str, str]) -> Table:
    return Table(caption=caption, columns=columns, rows=list(values.items()))


@as_annotated
def render_json(report: Report) -> str:
    """Return every number and table of the report as JSON.

    Parameters
    ----------
    report : Report
        Whose numbers are written.

    Returns
    -------
    str
        JSON; numbers that are not finite are text.

    Examples
    --------
    >>> import json, math
    >>> from nlctl.analysis.report import Report, render_json
    >>> numbers = {"e": 0.14, "settling": math.inf}
    >>> report = Report(
    ...     title="Arm", verdict="", claims=[], sections=[], command="", numbers=numbers
    ... )
    >>> json.loads(render_json(report))["numbers"]
    {'e': 0.14, 'settling': 'inf'}
    """
    content = {name: getattr(report, name) for name in _IN_FILE} | {
        "lead": None if report.lead is None else _plain(report.lead),
        "claims": [_said(vars(claim)) for claim in report.claims],
        "sections": {
            part.anchor: {
                "title": part.section.title,
                "items": [_plain(item) for _, _, item in part.items],
            }
            for part in place_anchors(report)
        },
    }
    if report.headline is not None:
        content["headline"] = vars(report.headline)
    return json.dumps(as_json(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(item: Item) -> dict[str, Any]:
    return {"kind": kind(item)} | _said({k: v for k, v in vars(item).items() if k not in DRAWN})


def _said(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out what most items lack, where it is empty."""
    return {name: value for name, value in fields.items() if value or name not in RARE}


@as_annotated
@with_parameters_of(render_html)
def write_report(
    report: Report,
    folder: str | os.PathLike[str],
    *,
    interactive: bool = False,
    force: bool = False,
    pool: Executor | None = None,
    drawn: Drawn = NONE_DRAWN,
) -> Path:
    """Write ``index.html``, ``report.json``, and ``signals.json`` where the report has histories.

    Nothing is half written.

    Parameters
    ----------
    folder : path
        Made where it does not exist.
    interactive : bool, optional
        As in `render_html`; ``report.json`` is the same either way.
    force : bool, optional
        Whether files of these names are replaced that no report has made.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    UsageError
        If it would replace files that no report has made.
    OSError
        If the folder cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.report import Report, compare_contents, write_gallery, write_report
    >>> report = Report(title="Nothing", verdict="Nothing.", claims=[], sections=[], command="")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     pages = [write_report(report, Path(folder, name)) for name in ("one", "two")]
    ...     names = sorted(path.name for path in pages[0].parent.iterdir())
    ...     differ = compare_contents(*(page.parent for page in pages))
    ...     gallery = write_gallery(folder).read_text(encoding="utf-8")
    >>> print(names, differ, gallery.count("Nothing.") >= 2)
    ['index.html', 'report.json'] [] True
    """
    folder = Path(folder)
    if not force:
        check_report_folder(folder)
    page = render_html(report, interactive=interactive, pool=pool, drawn=drawn)
    texts = _texts_of(report)
    write_files(folder, texts | {"index.html": page})
    if SIGNALS_FILE not in texts:
        (folder / SIGNALS_FILE).unlink(missing_ok=True)  # of a page that was here before
    return folder / "index.html"


@described_record(repr=False)
class Framed:
    """A page in a frame; a notebook shows it."""

    title: str
    page: str  # HTML.

    def __repr__(self) -> str:
        return f"report '{self.title}', {len(self.page) / 1000:.0f} kB"

    def _repr_html_(self) -> str:
        return (
            f'<iframe title="{html.escape(self.title)}" sandbox="allow-scripts" '
            f'srcdoc="{html.escape(self.page)}" style="width:100%;height:40rem;border:0"></iframe>'
        )


@as_annotated
def framed(report: Report) -> Framed:
    """Return a report as a notebook shows it: the whole page, in a frame.

    The page's content policy holds inside of the frame, and its script reaches nothing outside.

    Parameters
    ----------
    report : Report
        What is shown.

    Examples
    --------
    >>> from nlctl.analysis.report import Report, framed
    >>> report = Report(title="Nothing", verdict="Nothing.", claims=[], sections=[], command="")
    >>> framed(report)
    report 'Nothing', ... kB
    """
    return Framed(title=plain_text(report.title), page=render_html(report))


@as_annotated
def file_hashes(paths: Iterable[str | os.PathLike[str]]) -> dict[str, str]:
    """Return name and SHA-256 of data files, for `Report.files`.

    Parameters
    ----------
    paths : iterable of path
        Data files.

    Returns
    -------
    dict of str to str
        Hexadecimal digests by file name.

    Raises
    ------
    OSError
        If a file cannot be read.
    ParameterError
        If two files have one name: they could not both lie next to the page.

    Examples
    --------
    >>> import hashlib, tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.report import file_hashes
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "rows.csv").write_bytes(b"1,2")
    ...     hashes = file_hashes([Path(folder, "rows.csv")])
    >>> hashes == {"rows.csv": hashlib.sha256(b"1,2").hexdigest()}
    True
    """
    hashes: dict[str, str] = {}
    for path in map(Path, paths):
        if path.name in hashes:
            raise ParameterError(f"two data files of the report are called '{path.name}'")
        with path.open("rb") as file:
            hashes[path.name] = hashlib.file_digest(file, "sha256").hexdigest()
    return hashes
