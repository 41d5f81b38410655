"""What a report is made of: plain records, no HTML.

Text is plain text; a formula inside it stands between ``\\(`` and ``\\)``, in LaTeX.

A report is data until the last step; `nlctl.analysis.report.render` turns it into a page and into
``report.json``, so that every number on the page is also in the file next to it.
"""

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.names import check_known
from nlctl.params import checked_times


@as_annotated
@described_record(made_by="Report")
class Paragraph:
    """A paragraph of plain text, and what is to be typed below it, such as a command."""

    text: str
    code: str = ""


@as_annotated
@described_record(made_by="Report")
class Equation:
    """A formula in LaTeX, with the paper's number where it has one."""

    latex: str
    number: str = ""


@as_annotated
@described_record(made_by="Report")
class Table:
    """A table: column titles, rows of text or numbers, and a caption."""

    caption: str  # What it shows, above it.
    columns: Sequence[str]  # Titles.
    rows: Sequence[Sequence[Any]]  # Text or numbers.
    # Title of a column that holds ``"pass"``, ``"fail"`` and the like, drawn as badges; or of
    # several.
    status: str | Sequence[str] = ""
    # Whether the page shows the caption only until it is opened; paper shows all.
    folded: bool = False
    # Title of a column that holds keys of sections or figures of the report, drawn as links.
    links: str = ""


@as_annotated
@dataclass(frozen=True, kw_only=True)
class Figure:
    """A matplotlib figure with its caption and a description for those who cannot see it.

    `key` is its anchor, unless a section or another figure has it already.

    Examples
    --------
    >>> import matplotlib.figure
    >>> from nlctl.analysis.report import Figure, Report, Section, render_html
    >>> drawn = matplotlib.figure.Figure(figsize=(3, 2))
    >>> lines = drawn.add_subplot().plot([0, 1], [0, 1])
    >>> figure = Figure(key="line", caption="A line", description="From 0 to 1", figure=drawn)
    >>> shown = Section(key="lines", title="Lines", items=[figure])
    >>> report = Report(title="Lines", verdict="", claims=[], sections=[shown], command="")
    >>> "<svg" in render_html(report)
    True
    """

    key: str
    caption: str
    description: str
    figure: MatplotlibFigure


def captioned(key: str, caption: str, values: str, figure: MatplotlibFigure) -> Figure:
    """Return a figure that is described by its caption and the values that it shows."""
    return Figure(key=key, caption=caption, description=f"{caption} {values}", figure=figure)


@described_record(eq=False)
class History:
    """Signals over time for a chart to zoom in and to read values from.

    It is on the page only if that is asked for, and only where scripts run.  Hence it shows
    nothing of its own: a figure next to it shows the same signals.

    Raises
    ------
    ParameterError
        If the times do not increase, a signal or an end of a band is not as long as they are, or
        a name in `shown` or `bands` is that of no signal.

    Examples
    --------
    >>> from nlctl.analysis.report import History
    >>> History(key="x", caption="x", description="x", time=[0.0, 1.0], signals={"x": [1.0]})
    Traceback (most recent call last):
    nlctl.errors.ParameterError: signal 'x' of history 'x' has shape (1,), its time (2,)
    """

    key: str  # As those of a `Figure`.
    caption: str
    description: str
    time: Sequence[float] | np.ndarray  # (m,): In s, increasing.
    # (m,): What is not finite is drawn as a gap.
    signals: Mapping[str, Sequence[float] | np.ndarray]
    unit: str = ""  # Unit of all signals.
    shown: Sequence[str] = ()  # Signals that are drawn at first; all of them if it is empty.
    # (m,): By signal the lower and the upper end of a band of an ensemble around it, which
    # comparisons of two pages draw.
    bands: Mapping[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        shape = checked_times(self.time).shape
        ends = ((name, end) for name, band in self.bands.items() for end in band)
        for name, samples in (*self.signals.items(), *ends):
            if np.shape(samples) != shape:
                raise ParameterError(
                    f"signal '{name}' of history '{self.key}' has shape {np.shape(samples)}, "
                    f"its time {shape}"
                )
        for name in (*self.shown, *self.bands):
            check_known("signal", name, self.signals)


@described_record(eq=False)
class Live:
    """A loop that the page runs itself, in WebAssembly, with sliders.

    Where no script runs it shows nothing: figures next to it show the run as reported.

    Examples
    --------
    See `nlctl.analysis.loop_report`.
    """

    key: str  # As those of a `Figure`.
    caption: str
    description: str
    program: Mapping[str, Any]  # What ``live.js`` needs, see `nlctl.analysis.pages.live`.


Item = Paragraph | Equation | Table | Figure | History | Live


@as_annotated
@described_record(made_by="Report")
class Section:
    """A headed part of a report; `key` is its anchor."""

    key: str  # Its anchor.
    title: str  # Its heading.
    items: Sequence[Item]
    level: int = 2  # Of the heading.
    # Whether the page shows the heading only, until it is opened or something inside is linked to;
    # paper shows all.
    folded: bool = False


@as_annotated
@described_record
class Claim:
    """One line of the verdict: what was asked, what was found, the limit, where the evidence is.

    Examples
    --------
    A claim of ours that does not hold has failed, one of somebody else is refuted:

    >>> from nlctl.analysis.report import Claim, Report, render_html
    >>> def verdict(by=""):
    ...     claim = Claim(
    ...         text="|e| <= 0.1", measured="0.2", limit="0.1", holds=False, evidence="", by=by
    ...     )
    ...     report = Report(title="Arm", verdict="", claims=[claim], sections=[], command="")
    ...     return render_html(report).split("<strong>")[1].split("</strong>")[0]
    >>> verdict(), verdict("the paper")
    ('1 of 1 claim fails.', '1 claim of the paper is refuted.')
    """

    text: str  # What was asked.
    measured: str  # What was found.
    limit: str  # What it must not exceed.
    holds: bool
    evidence: str  # Key of the section or figure that shows it.
    margin: str = ""  # How far the measured value is from the limit.
    # What kind of statement it is, such as ``"proved"``, ``"checked"`` or ``"undecided"``; where it
    # is empty, the page says that the claim holds or fails. A claim that does not hold is drawn as
    # failed, or as open where its status says so; never as one that holds.
    status: str = ""
    # Who else claims it, such as ``"the paper"``: where it does not hold, they are refuted and
    # nothing of ours has failed, which the page says in another colour.
    by: str = ""
    ids: Sequence[str] = ()  # Ids of the requirements that it answers, such as ``["REQ-12"]``.


@as_annotated
@described_record(made_by="Report")
class Headline:
    """What a report without claims is headed with."""

    look: str  # Its colour and its sign.
    text: str  # A sentence.


@as_annotated
@described_record
class Report:
    """A whole report.

    Examples
    --------
    A page with one claim and its evidence, and one that claims nothing and has a headline:

    >>> from nlctl.analysis.report import Claim, Equation, Headline, Paragraph, Report, Section
    >>> from nlctl.analysis.report import Table, render_html
    >>> words = Paragraph(text="Two and two are four.")
    >>> law = Equation(latex="2 + 2 = 4", number="(1)")
    >>> table = Table(caption="Sums", columns=["sum", "value"], rows=[["2 + 2", 4.0]])
    >>> shown = Section(key="one", title="A sum", items=[words, law, table])
    >>> claim = Claim(text="2 + 2 = 4", measured="4", limit="4", holds=True, evidence="one")
    >>> report = Report(title="Sum", verdict="Known.", claims=[claim], sections=[shown], command="")
    >>> page = render_html(report)
    >>> [part in page for part in ("Two and two are four.", "(1)", "<caption", "https://")]
    [True, True, True, False]
    >>> headline = Headline(look="pass", text="3 of 3 checks hold.")
    >>> other = Report(
    ...     title="Sum", verdict="", claims=[], sections=[], command="", headline=headline
    ... )
    >>> "<strong>3 of 3 checks hold.</strong>" in render_html(other)
    True
    """

    title: str  # The verdict is what was found, in a sentence or two, and comes first.
    verdict: str
    claims: Sequence[Claim]
    sections: Sequence[Section]
    command: str  # Command that makes the report again; empty where there is none.
    provenance: Mapping[str, str] = field(default_factory=dict)  # Versions of what made it.
    # Name and text of each study file that the report is made from.
    inputs: Mapping[str, str] = field(default_factory=dict)
    # Every number of the report, for ``report.json``.
    numbers: Mapping[str, Any] = field(default_factory=dict)
    # Paragraphs on how it was found and what it does not show, and the sources; a DOI in them
    # (``doi 10...``) becomes a link, the only kind that leads out of the page.
    methods: Sequence[str] = ()
    limits: Sequence[str] = ()
    references: Sequence[str] = ()
    # Name and SHA-256 of each data file next to the page (`nlctl.analysis.report.file_hashes`).
    files: Mapping[str, str] = field(default_factory=dict)
    question: str = ""  # The question that the report answers; it precedes the verdict.
    lead: Figure | None = None  # The picture next to the verdict that shows the main result.
    # Below the title. They are only what is given: a report that is made twice is the same to the
    # byte.
    author: str = ""
    revision: str = ""
    date: str = ""
    headline: Headline | None = None  # What stands above the verdict where nothing is claimed.


PACKAGES = ("nlctl", "control", "numpy", "scipy", "pandas", "numba", "matplotlib")


def versions(*others: str) -> dict[str, str]:
    """Return the machine, Python, and the versions of the packages that every report needs."""
    platform_ = {"system": f"{platform.system()} {platform.machine()}"}
    platform_["Python"] = platform.python_version()
    return platform_ | {name: version(name) for name in (*PACKAGES, *others)}
