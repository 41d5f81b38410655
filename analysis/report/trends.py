"""One study at several revisions: its claims and its main numbers over them."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nlctl.attributes import described_record

from .changes import claim_changes
from .compare import placed_values
from .document import Claim, Table
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
