"""Which claims of a report changed in another one, which drawings, and which signals: as data."""

import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nlctl.attributes import described_record

from ..json_values import from_json
from ..loop_record import text_key
from .compare import placed_values
from .document import Claim, Table
from .history import SIGNALS_FILE
from .outline import claim_status, sort_key

NUMBERS = 8  # that are followed
_PARTS = re.compile(
    r"\b(tables|running estimate|quantities|requirements|metrics|seed|rows|witness)\b"
)

_FINDING = re.compile(r"^study\.findings\[([^\]]*)\]")


@dataclass(frozen=True, kw_only=True, eq=False)
class Revision:
    """One report of several about the same: its folder, how it is called, what it says."""

    folder: str
    label: str
    content: Mapping[str, Any]

    @property
    def order(self) -> tuple[Any, ...]:
        """By date, then by revision, then by folder; numbers in names count as numbers."""
        return tuple(
            tuple((not part.isdigit(), int(part) if part.isdigit() else 0, part) for part in parts)
            for name in (self.content.get("date"), self.content.get("revision"), self.folder)
            for parts in [re.findall(r"\d+|\D+", str(name or ""))]
        )


@described_record(eq=False)
class Trend:
    """Claims and main numbers of one study over its revisions."""

    title: str
    labels: Sequence[str]  # The revisions, the oldest first.
    # By id and text: the claim at each revision, None where there is none.
    claims: Mapping[str, Sequence[Claim | None]]
    numbers: Mapping[str, Sequence[float]]  # By name; NaN where a revision has none.

    @property
    def table(self) -> Table:
        """Statuses of the claims, and below them the numbers, a column for each revision."""
        rows: list[tuple[Any, ...]] = [
            (name, *("" if c is None else claim_status(c)[0] for c in claims))
            for name, claims in self.claims.items()
        ]
        return Table(
            caption="Claims at each revision.",
            columns=("claim", *self.labels),
            rows=rows,
            status=tuple(self.labels),
        )

    @property
    def number_table(self) -> Table:
        """The main numbers."""
        return Table(
            caption="Main numbers at each revision: those of what is claimed, then others that "
            "change.",
            columns=("number", *self.labels),
            rows=[
                (name, *("" if math.isnan(x) else x for x in row))
                for name, row in self.numbers.items()
            ],
        )


def trends(revisions: Iterable[Revision]) -> list[Trend]:
    """Return a trend for each study of which there are several reports, found by title."""
    by_title: dict[str, list[Revision]] = {}
    for revision in revisions:
        by_title.setdefault(str(revision.content["title"]), []).append(revision)
    return [
        _trend(title, sorted(these, key=lambda one: one.order))
        for title, these in by_title.items()
        if len(these) > 1
    ]


def _trend(title: str, these: Sequence[Revision]) -> Trend:
    labels = [one.label for one in these]
    if len(set(labels)) < len(labels):
        labels = [one.folder for one in these]
    return Trend(
        title=title, labels=labels, claims=_claims_over(these), numbers=_numbers_over(these)
    )


def _claims_over(these: Sequence[Revision]) -> dict[str, list[Claim | None]]:
    """Return each claim at each revision: from one to the next they are matched as in compare."""
    rows: list[list[Claim | None]] = [[Claim(**c)] for c in these[0].content["claims"]]
    for place, (one, other) in enumerate(itertools.pairwise(these), 1):
        changes = claim_changes(one.content["claims"], other.content["claims"])
        for change in changes:
            row = next((r for r in rows if change.first is not None and r[-1] == change.first
                        and len(r) == place), None)  # fmt: skip
            if row is not None:
                row.append(change.second)
            elif change.second is not None:
                rows.append([None] * place + [change.second])
        for row in rows:
            row += [None] * (place + 1 - len(row))
    named: dict[str, list[Claim | None]] = {}
    for row in rows:
        last = next(claim for claim in reversed(row) if claim is not None)
        name = f"{', '.join(last.ids)}: {last.text}" if last.ids else last.text
        named[f"{name} ({len(named) + 1})" if name in named else name] = row
    return named


def _numbers_over(these: Sequence[Revision]) -> dict[str, list[float]]:
    """Return the numbers to follow: margins of claims, then those that change most."""
    every = [_main(one.content) for one in these]
    names = list(dict.fromkeys(itertools.chain(*every)))
    rows = {name: [numbers.get(name, math.nan) for numbers in every] for name in names}
    moved = {name: row for name, row in rows.items() if _spread(row)}
    first = [name for name in moved if name.startswith("margin: ")]
    others = sorted((n for n in moved if n not in first), key=lambda name: -_spread(moved[name]))
    return {name: moved[name] for name in [*first, *others][:NUMBERS]}


def _spread(row: Sequence[float]) -> float:
    """Return how far a number moves, as a share of its largest magnitude."""
    known = [x for x in row if math.isfinite(x)]
    top = max(map(abs, known), default=0.0)
    return (max(known) - min(known)) / top if top else 0.0


def _main(content: Mapping[str, Any]) -> dict[str, float]:
    """Return margins of claims and the numbers of a report that are not lines of its tables."""
    numbers = {
        f"margin: {claim['text']}": float(sort_key(claim["margin"]))
        for claim in content["claims"]
        if sort_key(claim.get("margin", ""))
    }
    for place, value in placed_values("", content["numbers"]).items():
        name = re.sub(r"\bnumbers\.", "", _FINDING.sub(r"\1", place.removeprefix(".")))
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if is_number and not _PARTS.search(name):
            numbers[name] = float(value)
    return numbers


STATUS_RANK = {
    "pass": 0,
    "proved": 0,
    "checked": 0,
    "neutral": 1,
    "caution": 1,
    "refuted": 2,
    "fail": 2,
}
_GONE, _NEW = "gone", "new"


@dataclass(frozen=True, kw_only=True)
class ClaimChange:
    """One claim in two reports; None where a report lacks it."""

    first: Claim | None
    second: Claim | None

    @property
    def statuses(self) -> tuple[str, str]:
        """Its status in both."""
        before = _NEW if self.first is None else claim_status(self.first)[0]
        return before, _GONE if self.second is None else claim_status(self.second)[0]

    @property
    def worse(self) -> int:
        """How much worse it is: from shown to refuted 2, from refuted to shown -2."""
        ranks = [
            1 if c is None else STATUS_RANK[claim_status(c)[1]] for c in (self.first, self.second)
        ]
        return ranks[1] - ranks[0]

    @property
    def is_changed(self) -> bool:
        """Whether its status, what was measured, its limit or its words differ."""
        return self.first != self.second

    @property
    def text(self) -> str:
        """The claim; both texts where they differ."""
        texts = dict.fromkeys(c.text for c in (self.first, self.second) if c is not None)
        return " → ".join(texts)

    @property
    def ids(self) -> str:
        """Ids of its requirements."""
        every = [i for c in (self.first, self.second) if c is not None for i in c.ids]
        return ", ".join(dict.fromkeys(every))


def claim_changes(
    first: Sequence[Mapping[str, Any]], second: Sequence[Mapping[str, Any]]
) -> list[ClaimChange]:
    """Return the claims of two reports, those that became worse first."""
    # Claims belong together that say the same, or else have their evidence at the same place.
    one, other = ([Claim(**claim) for claim in claims] for claims in (first, second))
    changes, left = [], list(other)
    alone = []
    for claim in one:
        same = next((c for c in left if c.text == claim.text), None)
        if same is None:
            alone.append(claim)
            continue
        left.remove(same)
        changes.append(ClaimChange(first=claim, second=same))
    for claim in alone:
        same = next((c for c in left if c.evidence and c.evidence == claim.evidence), None)
        if same is not None:
            left.remove(same)
        changes.append(ClaimChange(first=claim, second=same))
    changes += [ClaimChange(first=None, second=claim) for claim in left]
    return sorted(
        changes, key=lambda change: (-change.worse, change.statuses[0] == change.statuses[1])
    )


def figure_changes(
    reports: Sequence[Mapping[str, Any]], folders: Sequence[Path | None]
) -> Iterator[tuple[str, str, str]]:
    """Yield key, caption and change of every figure of two reports."""
    one, other = (_figures(report) for report in reports)
    drawn = [{} if folder is None else drawings(folder / "index.html") for folder in folders]
    for key in dict.fromkeys([*one, *other]):
        caption = (other.get(key) or one[key])["caption"]
        if key not in one or key not in other:
            yield key, caption, _NEW if key in other else _GONE
        elif all(key in pictures for pictures in drawn):
            is_same = drawn[0][key] == drawn[1][key]
            yield key, caption, "as before" if is_same else "drawn differently"
        else:
            is_same = one[key]["description"] == other[key]["description"]
            yield key, caption, "described as before" if is_same else "described differently"


def _figures(report: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the figures of a report.json by key, the one at its top first."""
    lead = report.get("lead")
    items = [item for section in report["sections"].values() for item in section["items"]]
    figures = [item for item in items if item["kind"] == "figure"]
    return ({} if lead is None else {"lead": lead}) | {item["key"]: item for item in figures}


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """Signals of one chart of a page: times (s), samples by name, their unit, bands by name."""

    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    unit: str = ""
    bands: Mapping[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def largest_difference(self, other: "Curves", name: str) -> tuple[float, float]:
        """Return how far a signal is from the same of another run at most (1), and when (s)."""
        start, end = max(self.time[0], other.time[0]), min(self.time[-1], other.time[-1])
        every = np.union1d(self.time, other.time)
        both = every[(every >= start) & (every <= end)]
        if not both.size:
            return np.nan, np.nan
        apart = np.abs(
            np.interp(both, self.time, self.signals[name])
            - np.interp(both, other.time, other.signals[name])
        )
        if np.all(np.isnan(apart)):
            return np.nan, np.nan
        at = int(np.nanargmax(apart))
        return float(apart[at]), float(both[at])


def curves_of(folder: Path | None) -> dict[str, Curves]:
    """Return the charts next to a page by key; nothing where there are none, or none to be read."""
    try:
        charts = {} if folder is None else json.loads((folder / SIGNALS_FILE).read_text("utf-8"))
        return {key: _curves(from_json(chart)) for key, chart in charts.items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return {}


def _curves(chart: Mapping[str, Any]) -> Curves:
    time, *samples = map(_samples, chart["data"])
    bands = {name: (_samples(a), _samples(b)) for name, (a, b) in chart.get("bands", {}).items()}
    signals = dict(zip(chart["names"], samples, strict=True))
    return Curves(time=time, signals=signals, unit=str(chart["unit"]), bands=bands)


def _samples(row: Sequence[float | None]) -> np.ndarray:
    return np.array([np.nan if x is None else x for x in row], dtype=float)


_SHAPE = re.compile(
    r'<(?:path|g) id="(g:\d+)"(.*?)(?=<(?:path|g) id="g:|</defs>)', re.DOTALL
)  # letters, words and marks that all figures of a page share, numbered as they came
_FIGURE = re.compile(r'<figure id="([^"]*)"><div class="drawing".*?(<svg .*?</svg>)', re.DOTALL)
_WORDS = re.compile(r"<(title|desc)[ >].*?</\1>", re.DOTALL)
_USED = re.compile(r'"#(g:\d+)"')


def drawings(page: Path) -> dict[str, str]:
    """Return a key of every drawing of a page by its anchor; none of a page that is not there."""
    # Shared shapes count by what they are, words about a figure do not count.
    try:
        text = page.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    shapes = dict(_SHAPE.findall(text[text.rfind('<svg class="shapes"') :]))
    letters = {name: text_key(drawn) for name, drawn in shapes.items()}  # words are made of them
    shapes = {name: text_key(_with_shapes(drawn, letters)) for name, drawn in shapes.items()}
    return {
        anchor: text_key(_with_shapes(_WORDS.sub("", drawn), shapes).replace(f'"{anchor}-', '"'))
        for anchor, drawn in _FIGURE.findall(text)
    }


def _with_shapes(drawn: str, shapes: dict[str, str]) -> str:
    return _USED.sub(lambda match: f'"{shapes.get(match[1], "")}"', drawn)
