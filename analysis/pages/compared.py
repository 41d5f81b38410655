"""Reports compared: two as a page, with signals of both, and one over its revisions."""

import json
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nlctl.attributes import described_record
from nlctl.wording import counted

from .. import figures
from ..report.changes import ClaimChange, Curves, Trend, claim_changes, curves_of, figure_changes
from ..report.compare import ABSENT, Difference, differing_numbers, read_report
from ..report.document import (
    Claim,
    Figure,
    Headline,
    Item,
    Paragraph,
    Report,
    Section,
    Table,
    captioned,
    versions,
)
from ..report.outline import claim_status, sort_key, summary
from ..report.render import render_json
from ..studies import load_result, origin_differences
from ..studies.differences import long_table_differences
from .study.report import study_report

_LISTED = 100  # numbers of a table
_DRAWN = 4  # signals of a figure
_CLAIM_COLUMNS = (
    "before", "after", "claim", "found before", "found after", "limit before", "limit after",
)  # fmt: skip
_NUMBER_COLUMNS = (
    "number", "before", "after", "after − before", "share of the larger", "tolerance",
)  # fmt: skip
_LINE = re.compile(r"^numbers\.(study\.)?(tables|running estimate)\b")  # of a table of a study
_NO_SIGNALS = "No chart of signals over time is next to both pages (signals.json)."
_TOLD_APART = ("title", "verdict", "question", "revision", "date")


@described_record
class Compared:
    """A report that is compared."""

    name: str  # As the command names it.
    content: Mapping[str, Any]  # What is in its ``report.json``.
    # Where its page lies, with its signals; None where it was made for this comparison.
    folder: Path | None = None


def comparison_page(
    first: Compared,
    second: Compared,
    *,
    rtol: float = 0.0,
    common: bool = False,
    others: Sequence[str] = (),
    command: str = "",
) -> Report:
    """Compose the page; `others` are differences that the reports lack, such as of long tables."""
    differences = differing_numbers(first.content, second.content, rtol, common=common)
    claims = claim_changes(first.content["claims"], second.content["claims"])
    numbers, words = _sorted_out(differences)
    folders = (first.folder, second.folder)
    pictures = [*figure_changes((first.content, second.content), folders)]
    curves = [*_signal_items(curves_of(first.folder), curves_of(second.folder), rtol)]
    sections = [
        _claims_section(claims),
        _numbers_section(numbers, rtol),
        _section("signal_changes", "Signals of both over time", curves, _NO_SIGNALS),
        _figures_section(pictures),
        _words_section(words, others),
        _compared_section(first, second),
    ]
    titles = dict.fromkeys(str(c.content["title"]) for c in (first, second))
    count = len(numbers) + len(words) + len(others) + sum(c.is_changed for c in claims)
    return Report(
        title=f"Compared: {', and '.join(titles)}",
        question="what does the second report say that the first did not?",
        verdict=_verdict(claims, numbers, pictures, curves),
        headline=_headline(claims, count),
        claims=[],
        sections=sections,
        command=command,
        provenance=versions(),
        numbers={"differences": count, "rtol": rtol},
    )


def _headline(claims: Sequence[ClaimChange], count: int) -> Headline:
    """Return how the claims changed, or that nothing differs."""
    moved: dict[tuple[str, str], list[ClaimChange]] = {}
    for change in claims:
        if change.statuses[0] != change.statuses[1]:
            moved.setdefault(change.statuses, []).append(change)
    if not moved:
        same = (
            f"All {counted(len(claims), 'claim')} end as before"
            if len(claims) > 1
            else ("The claim ends as before" if claims else "Neither report makes a claim")
        )
        differ = f"; {counted(count, 'difference')}" if count else ", and nothing differs"
        return Headline(look="neutral" if count else "pass", text=f"{same}{differ}.")
    sentences = [f"{counted(len(c), 'claim')}: {_moved(*s)}" for s, c in moved.items()]
    worst = max(change.worse for change in claims)
    looks = {2: "fail", 1: "caution", 0: "neutral"}
    return Headline(look=looks.get(worst, "pass"), text=f"{'; '.join(sentences)}.")


def _moved(before: str, after: str) -> str:
    """Return a change of status in words."""
    if before == "new":
        return f"new: {after}"
    return f"gone, once: {before}" if after == "gone" else f"{before} → {after}"


def _verdict(
    claims: Sequence[ClaimChange],
    numbers: Sequence[Difference],
    pictures: Sequence[tuple[str, str, str]],
    curves: Sequence[Item],
) -> str:
    """Return the claims that became worse, and how much else differs."""
    worse = [f"{c.ids + ': ' if c.ids else ''}{c.text}" for c in claims if c.worse > 0]
    sentences = [f"Worse: {'; '.join(worse)}."] * bool(worse)
    other = [what for *_, what in pictures if not what.endswith("as before")]
    sentences.append(
        f"{counted(len(numbers), 'number')} and {counted(len(other), 'figure')} of "
        f"{len(pictures)} differ."
    )
    if not curves:
        sentences.append("No signals over time are there of both.")
    return " ".join(sentences)


def _sorted_out(differences: Sequence[Difference]) -> tuple[list[Difference], list[Difference]]:
    """Return differences of numbers, those with the largest share first, and the others."""
    # Those of claims are in their own table; a number that a table shows as well is named once, as
    # there.
    numbers, words = [], []
    cells = [d for d in differences if d.where.startswith("section '")]
    in_tables = {_pair(cell) for cell in cells if not _LINE.search(cell.where)}
    for one in differences:
        if one.where.startswith("claim '"):
            continue
        if not (sort_key(one.first) and sort_key(one.second)):
            words.append(one)
        elif one.where.startswith("section '") or _pair(one) not in in_tables:
            numbers.append(one)
    return sorted(numbers, key=lambda d: -np.nan_to_num(_share(d), nan=np.inf)), words


def _pair(one: Difference) -> tuple[str, str]:
    return sort_key(one.first), sort_key(one.second)


def _share(one: Difference) -> float:
    """Return how far two numbers are apart, as a share of the larger one."""
    a, b = float(sort_key(one.first)), float(sort_key(one.second))
    scale = max(abs(a), abs(b))
    return abs(a - b) / scale if np.isfinite(scale) and scale else np.nan


def _claims_section(claims: Sequence[ClaimChange]) -> Section:
    changed = [change for change in claims if change.is_changed]
    kept = [change for change in claims if not change.is_changed]
    items: list[Item] = []
    if changed:
        items.append(_claims_table("Claims that changed, those that became worse first.", changed))
    else:
        items.append(Paragraph(text="No claim changed." if claims else "There are no claims."))
    if kept:
        items.append(_claims_table("Claims that are as before.", kept, folded=bool(changed)))
    return Section(key="claim_changes", title="Claims", items=items)


def _claims_table(caption: str, claims: Sequence[ClaimChange], folded: bool = False) -> Table:
    ids = any(change.ids for change in claims)
    return Table(
        caption=caption,
        columns=("id",) * ids + _CLAIM_COLUMNS,
        rows=[
            (
                *(change.ids,) * ids, *change.statuses, change.text,
                *(_of(c, "measured") for c in (change.first, change.second)),
                *(_of(c, "limit") for c in (change.first, change.second)),
            )
            for change in claims
        ],
        status=("before", "after"),
        folded=folded,
    )  # fmt: skip


def _of(claim: Claim | None, field: str) -> str:
    return "" if claim is None else str(getattr(claim, field))


def _numbers_section(numbers: Sequence[Difference], rtol: float) -> Section:
    """Return the numbers that differ: first those that stand alone, then cells of tables."""
    close = f"further apart than {rtol:g} of the larger" if rtol else "that are not equal"
    lines = [one for one in numbers if _LINE.search(one.where)]
    main = [one for one in numbers if not _LINE.search(one.where)]
    items = [
        _numbers_table(f"{what} {close}", these, rtol, folded=these is lines)
        for what, these in (("Numbers", main), ("Lines of tables", lines))
        if these
    ]
    none = f"No two numbers are {close.removeprefix('that are ')}."
    return _section("number_changes", "Numbers", items, none)


def _numbers_table(
    caption: str, numbers: Sequence[Difference], rtol: float, *, folded: bool
) -> Table:
    more = f" The first {_LISTED} of {len(numbers)}; nlctl compare prints all."
    return Table(
        caption=f"{caption}, the largest share first.{more * (len(numbers) > _LISTED)}",
        columns=_NUMBER_COLUMNS,
        rows=[_number_row(one, rtol) for one in numbers[:_LISTED]],
        folded=folded,
    )


def _number_row(one: Difference, rtol: float) -> tuple[Any, ...]:
    a, b = float(sort_key(one.first)), float(sort_key(one.second))
    return _place(one.where), one.first, one.second, b - a, _share(one), rtol


def _place(where: str) -> str:
    """Return the place of a number in words: which section, which row, which column."""
    cell = re.fullmatch(r"section '(.*)', table (\d+), row '(.*)', column '(.*)'", where)
    if cell is None:
        return where.removeprefix("numbers.")
    section, table, row, column = cell.groups()
    return f"{section}, {row}: {column}" + f" (table {table})" * (table != "1")


def _signal_items(
    first: Mapping[str, Curves], second: Mapping[str, Curves], rtol: float
) -> Iterator[Item]:
    """Yield an overlay of each chart that both pages have, and how far its signals are apart."""
    for key in (key for key in first if key in second):
        one, other = first[key], second[key]
        apart = {n: one.largest_difference(other, n) for n in one.signals if n in other.signals}
        names = sorted(apart, key=lambda n: -np.nan_to_num(_range_share(one, n, apart[n][0])))
        if not names:
            continue
        both = [(c.time, {n: c.signals[n] for n in names[:_DRAWN]}) for c in (one, other)]
        drawn = figures.overlaid(*both, unit=one.unit, bands=(one.bands, other.bands))
        caption = f"{key.removesuffix('-history')}: {', '.join(names[:_DRAWN])} before and after."
        if any(name in one.bands and name in other.bands for name in names[:_DRAWN]):
            caption += " Bands hold 90 % of the rows at each time: filled before, hatched after."
        largest = (f"{n} {apart[n][0]:.4g} at {apart[n][1]:.4g} s" for n in names[:_DRAWN])
        values = f"Largest differences: {'; '.join(largest)}"
        yield captioned(f"overlaid-{key}", caption, values, drawn)
        yield Table(
            caption="How far the signals are apart at most, and when; to 6 digits.",
            columns=("signal", "largest difference", "at (s)", "share of its range before",
                     "tolerance"),
            rows=[(n, *apart[n], _range_share(one, n, apart[n][0]), rtol) for n in names],
            folded=True,
        )  # fmt: skip


def _range_share(curves: Curves, name: str, apart: float) -> float:
    samples = curves.signals[name]
    known = samples[np.isfinite(samples)]
    span = float(np.ptp(known)) if known.size else 0.0
    return apart / span if span else (0.0 if apart == 0 else np.nan)


def _section(
    key: str, title: str, items: Sequence[Item], none: str, *, folded: bool = False
) -> Section:
    """Return a section; one without items says so."""
    return Section(key=key, title=title, items=items or [Paragraph(text=none)], folded=folded)


def _figures_section(pictures: Sequence[tuple[str, str, str]]) -> Section:
    other = [row for row in pictures if not row[2].endswith("as before")]
    table = Table(caption="Figures that differ.", columns=("figure", "caption", "is"), rows=other)
    none = "Every figure is as before." if pictures else "There are no figures."
    return _section("figure_changes", "Figures", [table] * bool(other), none)


def _words_section(words: Sequence[Difference], others: Sequence[str]) -> Section:
    more = f" The first {_LISTED} of {len(words)}." * (len(words) > _LISTED)
    table = Table(
        caption=f"Words, and what only one report has ({ABSENT} in the other).{more}",
        columns=("place", "before", "after"),
        rows=[(_place(d.where), d.first, d.second) for d in words[:_LISTED]],
    )
    items = [table] * bool(words) + [Paragraph(text=f"{text}.") for text in others]
    none, folded = "Nothing else differs.", len(words) > 10
    return _section("word_changes", "What else differs", items, none, folded=folded)


def _compared_section(first: Compared, second: Compared) -> Section:
    both = (first, second)
    summaries = [summary([Claim(**c) for c in one.content["claims"]])[1] for one in both]
    rows = [("report", *(one.name for one in both)), ("claims", *summaries)]
    rows += [(key, *(str(c.content.get(key, "")) for c in both)) for key in _TOLD_APART]
    provenances = [dict(one.content.get("provenance", {})) for one in both]
    rows += [
        (key, *(str(one.get(key, "")) for one in provenances))
        for key in dict.fromkeys([*provenances[0], *provenances[1]])
        if provenances[0].get(key) != provenances[1].get(key)
    ]
    table = Table(
        caption="What was compared, and what made each of them that differs.",
        columns=("what", "before", "after"),
        rows=[row for row in rows if any(row[1:])],
    )
    return Section(key="compared", title="The two reports", items=[table])


def compose_comparison(first: Path, second: Path, out: Path, rtol: float) -> Report:
    """Compose the page of two reports or runs, which have been checked."""
    both = (first, second)
    are_runs = all((path / "results.json").exists() for path in both)
    others = []
    if are_runs:
        others = [*long_table_differences(first, second, rtol)]
        if origins := origin_differences(first, second):
            others.insert(0, f"The runs were not computed from the same: {origins}")
    command = ["nlctl", "compare", *(path.as_posix() for path in both)]
    command += ["--rtol", f"{rtol:g}"] * (rtol > 0) + ["--out", out.as_posix()]
    return comparison_page(
        *(_compared(path) for path in both),
        rtol=rtol,
        common=are_runs,
        others=others,
        command=shlex.join(command),
    )


def _compared(path: Path) -> Compared:
    """Return what is compared; a run without a page has what its page would say without figures."""
    if path.is_dir() and not (path / "report.json").exists():
        page = json.loads(render_json(study_report(load_result(path))))
        return Compared(name=path.as_posix(), content=page)
    folder = path if path.is_dir() else path.parent
    return Compared(name=path.as_posix(), content=read_report(path), folder=folder)


_ENDS = {
    **dict.fromkeys(("pass", "proved", "checked"), "holds"),
    **dict.fromkeys(("refuted", "fail"), "fails"),
}


def trend_figure(trend: Trend) -> Figure:
    """Return the figure: how each claim ended, and the first of the main numbers."""
    claims = {  # how each ended, in one of the words of the figure
        name: ["" if c is None else _ENDS.get(claim_status(c)[1], "open") for c in row]
        for name, row in trend.claims.items()
    }
    numbers = dict(list(trend.numbers.items())[:_DRAWN])
    ended = "; ".join(
        f"{name}: {', '.join(end or 'not made' for end in ends)}" for name, ends in claims.items()
    )
    return Figure(
        key="trend",
        caption=f"{trend.title}: its claims and main numbers over {', '.join(trend.labels)}.",
        description=f"Claims over {', '.join(trend.labels)}. {ended}",
        figure=figures.trend(trend.labels, claims, numbers),
    )
