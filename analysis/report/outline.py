"""Where everything stands on the page: unique anchors, cells of tables, colours of statuses."""

import re
import unicodedata
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from numbers import Real

import numpy as np

from nlctl.wording import counted, some_of

from .document import Claim, Figure, Headline, History, Item, Live, Report, Section, Table

SHELL = frozenset(
    ["claims", "contents", "provenance", "files", "lead", "lead-title", "lead-desc"]
)  # anchors of the page itself
_LONG = 36  # characters of a word that must be broken to fit a column
_NOT_FINITE = {"nan": "NaN", "inf": "∞", "-inf": "−∞"}
_SHORT = 24  # characters of a text that stays on one line

# Statuses by the look of their badge.  What is proved never looks like what is sampled.
LIGHTS = {
    "pass": ("pass", "passes", "hold", "holds", "ok", "reached", "confirmed", "held"),
    "proved": ("proved", "computed"),
    "checked": ("checked", "sampled", "shown"),
    "caution": (
        "undecided",
        "open",
        "inconclusive",
        "not confirmed",
        "not shown yet",
        "no claim",
        "not run yet",
    ),
    "refuted": ("refuted", "violated as printed"),
    "fail": ("fail", "fails", "failed", "violated", "missed", "diverged"),
}
MEANINGS = {  # of the statuses of claims, as the page explains them
    "holds": "the result is within the limit",
    "proved": "for all cases of the claim, by rigorous computation",
    "computed": "in closed form",
    "checked": "at every sample of one simulated run, which proves nothing about others",
    "sampled": "found by simulated runs, at most with a stated confidence, which is not proof",
    "shown": "by simulated runs, at most with a stated confidence, which is not proof",
    "refuted": "there is a run that contradicts it, or many with a stated confidence; the claim "
    "is wrong, and nothing of this report failed",
    "not shown yet": "the runs neither show nor refute it",
    "undecided": "the runs do not decide it",
    "not confirmed": "a violation was found, but not by other integrators",
    "violated": "there is a counterexample",
    "fails": "the result is beyond the limit",
}
ANSWERS = ("shown", "refuted", "not shown yet")  # to the claims of studies
_LIGHT_OF = {status: light for light, statuses in LIGHTS.items() for status in statuses}


@dataclass(frozen=True, kw_only=True)
class TableCell:
    """One cell of a table as shown: text, number to sort by, look of its badge, its link."""

    text: str
    value: str = ""
    badge: str = ""
    target: str = ""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """A section with its anchor, the level of its heading, and its items with theirs."""

    anchor: str
    level: int
    section: Section
    items: Sequence[tuple[str, str, Item]]


def place_anchors(report: Report) -> list[Placed]:
    """Give sections, tables, figures and histories anchors that nothing else on the page has."""
    taken = set(SHELL)
    taken |= {name for name in ("methods", "limits", "references") if getattr(report, name)}
    headings = [_anchor(section.key, taken, ()) for section in report.sections]
    placed = []
    for section, heading in zip(report.sections, headings, strict=True):
        items = []
        for item in section.items:
            anchor = ""
            if isinstance(item, Table | Figure | History | Live):
                key = f"{heading}-table" if isinstance(item, Table) else item.key
                anchor = _anchor(key, taken, ("-title", "-desc"))
            items.append((anchor, kind(item), item))
        level = min(max(section.level, 2), 6)
        placed.append(Placed(anchor=heading, level=level, section=section, items=items))
    return placed


def evidence_anchors(placed: Sequence[Placed]) -> Mapping[str, str]:
    """Return the anchor of each key that a claim may name; a section's wins over a figure's."""
    figures = {i.key: a for p in placed for a, _, i in p.items if isinstance(i, Figure)}
    return figures | {p.section.key: p.anchor for p in reversed(placed)}


def kind(item: Item) -> str:
    """Return what an item is, as the template and ``report.json`` call it."""
    return type(item).__name__.lower()


def _anchor(key: str, taken: set[str], endings: Sequence[str]) -> str:
    """Return `key` as an id: a few harmless characters, and a number where it is taken."""
    plain = unicodedata.normalize("NFKD", key)
    base = re.sub(r"[^A-Za-z0-9_.-]+", "-", plain).strip("-")[:60] or "part"
    number, name = 1, base
    while not taken.isdisjoint({name, *(name + end for end in endings)}):
        number += 1
        name = f"{base}-{number}"
    taken |= {name, *(name + end for end in endings)}
    return name


def cells(table: Table) -> list[list[TableCell]]:
    """Return the rows of a table as they are shown, all of one length."""
    width = max([len(table.columns), *map(len, table.rows)])
    titles = [*table.columns, *[""] * (width - len(table.columns))]
    badges = (table.status,) if isinstance(table.status, str) else table.status
    return [
        [
            TableCell(text=_shown(value), target=_shown(value))
            if table.links and title == table.links  # it holds the key of a section or figure
            else _cell(value, bool(title) and title in badges)
            for title, value in zip_longest(titles, row, fillvalue="")
        ]
        for row in table.rows
    ]


def numeric(table: Table) -> list[bool]:
    """Return for each column whether all its cells are numbers or empty, and not all empty."""
    # Units are words, also where each of them is 1.
    rows = cells(table)
    if not rows:
        return [False] * len(table.columns)
    return [
        any(cell.value for cell in column)
        and all(cell.value or not cell.text for cell in column)
        and title != "unit"
        for title, column in zip_longest(table.columns, zip(*rows, strict=True))
    ]


def _cell(value: object, is_status: bool) -> TableCell:
    text = _shown(value)
    if is_status:
        return TableCell(text=text, badge=light(text))
    return TableCell(text=text, value=sort_key(value))


def is_long(text: str) -> bool:
    """Whether a text has a word that no column is wide enough for."""
    return max(map(len, text.split()), default=0) > _LONG


def is_short(text: str) -> bool:
    """Whether a text is better not broken into lines."""
    return len(text) <= _SHORT


def _shown(value: object) -> str:
    """Return a cell's text: numbers with the digits that a reader can use."""
    text = f"{value + 0.0:.6g}" if isinstance(value, float | np.floating) else str(value)
    return "" if value is None else _NOT_FINITE.get(text, text)


def sort_key(value: object) -> str:
    """Return the number that a cell holds, also in %, as a browser reads it; empty without one."""
    if isinstance(value, bool | np.bool_):
        return ""
    if isinstance(value, str):
        try:
            value = float(value.strip().removesuffix(" %").replace("−", "-"))
        except ValueError:
            return ""
    if not isinstance(value, Real):
        return ""
    return {"inf": "Infinity", "-inf": "-Infinity", "nan": "NaN"}.get(
        repr(float(value)), repr(float(value))
    )


def light(status: str) -> str:
    """Return the look of a status: pass, proved, checked, caution, refuted, fail, or neutral."""
    return _LIGHT_OF.get(status.strip().lower(), "neutral")


def claim_status(claim: Claim) -> tuple[str, str]:
    """Return a claim's status and its look; one that does not hold never looks well."""
    status = claim.status or ("holds" if claim.holds else "fails")
    look = light(status)
    if not claim.holds and look != "caution":
        if claim.by or look == "refuted":
            return "refuted", "refuted"
        return status if look == "fail" else "fails", "fail"
    return status, look


def meanings(claims: Sequence[Claim]) -> Mapping[str, str]:
    """Return what the statuses of the claims mean, as far as they are the usual ones."""
    used = {claim_status(claim)[0] for claim in claims}
    return {status: meaning for status, meaning in MEANINGS.items() if status in used}


def summary(claims: Sequence[Claim], headline: Headline | None = None) -> tuple[str, str]:
    """Return the report's traffic light, and the sentence that it stands for."""
    # Without claims that is the `headline`, if there is one.
    looks = [claim_status(claim)[1] for claim in claims]
    failed, refuted, open_ = (looks.count(look) for look in ("fail", "refuted", "caution"))
    total = len(claims)
    if failed:
        return "fail", f"{some_of(failed, total, 'claim', 'fails', 'fail')}."
    if refuted:
        return "refuted", _refuted(claims)
    if open_:
        waiting = _waiting(claims)
        return "caution", f"{some_of(open_, total, 'claim', 'is', 'are')} {waiting}."
    if not claims:
        look = (
            Headline(look="neutral", text="No claims are made.") if headline is None else headline
        )
        return look.look, look.text
    hold = "The claim holds" if total == 1 else f"All {total} claims hold"
    return "pass", f"{hold}{_known(claims, ': ')}."


def _waiting(claims: Sequence[Claim]) -> str:
    """Return what claims without an answer are: those of studies may still be shown."""
    statuses = {claim_status(claim)[0] for claim in claims}
    return "not shown yet" if statuses <= set(ANSWERS) else "open"


def _known(claims: Sequence[Claim], before: str, after: str = "") -> str:
    """Return how claims are known, 2 checked, 1 proved; nothing where they just hold."""
    statuses = [claim_status(claim) for claim in claims]
    kinds = Counter(status for status, look in statuses if look in ("proved", "checked"))
    kept = ", ".join(f"{number} {status}" for status, number in kinds.items())
    return f"{before}{kept}{after}" if kept else ""


def _refuted(claims: Sequence[Claim]) -> str:
    """Return how many claims hold where some are refuted; somebody's and ours apart."""
    whose = {claim.by for claim in claims if claim_status(claim)[1] == "refuted"}
    by = whose.pop() if len(whose) == 1 else None
    theirs = [claim for claim in claims if claim.by == by] if by else claims
    looks = [claim_status(claim)[1] for claim in theirs]
    refuted, open_ = looks.count("refuted"), looks.count("caution")
    held = len(theirs) - refuted - open_
    waiting = [f"{open_} {'is' if open_ == 1 else 'are'} {_waiting(claims)}"] * bool(open_)
    are = "is" if refuted == 1 else "are"
    if by:
        parts = [f"{counted(refuted, 'claim')} of {by} {are} refuted", *waiting]
        parts += [f"{held} {'holds' if held == 1 else 'hold'}"] * bool(held)
        return f"{', '.join(parts)}{_ours([claim for claim in claims if claim.by != by])}."
    first = f"{counted(refuted, 'claim')} {are} refuted"
    if by is not None:
        first = f"{some_of(refuted, len(claims), 'claim', 'is', 'are')} refuted"
    others = f"{held} {'other holds' if held == 1 else 'others hold'}{_known(claims, ' (', ')')}"
    return f"{'; '.join([first, *waiting, *[others] * bool(held)])}."


def _ours(claims: Sequence[Claim]) -> str:
    """Return how many of our own claims hold, of which none fails or is refuted."""
    held = [claim for claim in claims if claim_status(claim)[1] != "caution"]
    left = len(claims) - len(held)
    parts = []
    if held:
        every = "all " if not left and len(held) > 1 else ""
        verb = "holds" if len(held) == 1 else "hold"
        parts.append(f"{every}{len(held)} {verb}{_known(held, ' (', ')')}")
    if left:
        parts.append(f"{left} {'is' if left == 1 else 'are'} {_waiting(claims)}")
    return f"; of ours {', '.join(parts)}" if parts else ""
