"""A robustness study as a report, or as sections of another one."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import robustness_methods as how
from . import robustness_text as text
from .document import Item, Paragraph, Report, Section, Table
from .outline import summary
from .paper_text import EXAMPLES
from .render import file_hashes
from .robustness_claims import STATEMENTS, claims, verdict
from .robustness_histories import Histories
from .robustness_rankings import compare, morris, regional, sobol
from .robustness_rows import (
    fan_items,
    loop_items,
    margin_items,
    row_items,
    running,
    setup_items,
    statement_items,
)
from .robustness_searches import degradation, failure_map, radius, worst_case
from .versions import versions

if TYPE_CHECKING:
    from analysis.studies.result import Finding, Result

__all__ = ["study_part", "study_report", "study_sections"]

LISTED = 400  # lines of a table that report.json holds as well; longer ones are files beside it
Items = Callable[["Finding", "Result", Any, str], Iterator[Item]]
KINDS: dict[str, Items] = {  # in the order of the report
    "worst case": worst_case,
    "radius": radius,
    "degradation": degradation,
    "morris": morris,
    "sobol": sobol,
    "regional": regional,
    "failure map": failure_map,
    "compare": compare,
}
OUTCOMES = {  # by the light
    "pass": "shown",
    "caution": "not shown yet",
    "fail": "refuted",
    "neutral": "no claims",
}


def study_report(
    result: Result, kept: Histories | None = None, command: str = "nlctl report RUN"
) -> Report:
    """Compose the report of a study.

    Parameters
    ----------
    result : Result
        Of `analysis.studies`, also an incomplete one.  If ``result.rows`` has its design, the
        report can say why the rows support no guarantee.
    kept : Histories, optional
        Signals of some rows; without them there are no fans.
    command : str, optional
        What makes the report again.
    """
    paragraphs, sources = how.methods(result)
    return Report(
        title=result.study.study.title,
        verdict=verdict(result),
        claims=claims(result),
        sections=study_sections(result, kept, limits=False),
        command=command,
        provenance=_provenance(result),
        numbers=numbers(result),
        methods=paragraphs,
        limits=[*how.limits(result), *result.notes],
        references=sources,
        inputs=_study_file(result.folder),
        files=data_files(result.folder),
    )


def _provenance(result: Result) -> dict[str, str]:
    """Return what made the numbers: the versions of the run, not those that draw the page."""
    then = {"Python" if k == "python" else k: v for k, v in result.made_with.items()}
    seed = {"seed": str(result.study.study.seed)}
    return versions("cma") | then | seed | _table_hash(result)


def study_sections(
    result: Result,
    kept: Histories | None = None,
    *,
    prefix: str = "",
    level: int = 2,
    limits: bool = True,
) -> list[Section]:
    """Compose the sections of a study.

    Parameters
    ----------
    result, kept
        As in `study_report`.
    prefix : str, optional
        In front of every key, so that several studies can stand in one report.
    level : int, optional
        Of the headings.
    limits : bool, optional
        Whether what the study does not show is a section as well.
    """
    table = None if result.rows is None or not result.rows.done else result.rows.table
    made = [("study_asked", "What was asked", [*setup_items(result)])]
    if result.study.loop in EXAMPLES:
        made.append(
            ("study_loop", "The loop as published", [*loop_items(EXAMPLES[result.study.loop])])
        )
    if table is not None:
        key = "study_rows"  # no analysis is called that: keys of these have hyphens only
        made.append((key, "How the runs ended", [*row_items(result, table, f"{prefix}{key}")]))
        margins = table["spec"].to_numpy(dtype=float)
        statements = [f for f in _answered(result) if f.kind in STATEMENTS]
        made += [_statement(f, result, margins, prefix) for f in statements]
    if kept is not None:
        shown = [*fan_items(kept, f"{prefix}study")]
        made.append(("study_fans", "The runs over time", shown))
    made += _findings(result, prefix)
    if limits:
        told: list[Item] = [Paragraph(text=words) for words in how.limits(result)]
        made.append(("study_limits", "What this study does not show", told))
    return [
        Section(key=f"{prefix}{key}", title=title, items=items, level=level)
        for key, title, items in made
    ]


def study_part(
    studies: Sequence[tuple[Result, Histories | None]], key: str = "robustness"
) -> list[Section]:
    """Compose several studies, in short, as a part of another report: first the verdicts.

    Parameters
    ----------
    studies : sequence of (Result, Histories or None)
    key : str, optional
        Anchor of the part; those of the studies begin with it.
    """
    rows = []
    for result, _ in studies:
        look, told = summary(claims(result))
        outcome = OUTCOMES.get(look, look)
        rows.append((result.study.study.title, outcome, f"{told} {verdict(result)}"))
    overview = Table(
        caption="The studies and their verdicts.",
        columns=("study", "outcome", "verdict"),
        rows=rows,
        status="outcome",
    )
    return [
        Section(key=key, title="Robustness", items=[Paragraph(text=text.PART), overview]),
        *(
            Section(
                key=f"{key}-{number}",
                title=result.study.study.title,
                items=[*_brief(result, kept, f"{key}-{number}")],
                level=3,
            )
            for number, (result, kept) in enumerate(studies, 1)
        ),
    ]


def _brief(result: Result, kept: Histories | None, key: str) -> Iterator[Item]:
    """Yield a study in short: margins, fans, what each analysis found, and the failure map."""
    yield from setup_items(result)
    if result.rows is not None and result.rows.done:
        yield from margin_items(result, result.rows.table, key)
    if kept is not None:
        yield from fan_items(kept, key)
    asked = result.asked
    for finding in result.findings:
        title, told = _title(finding, result), _told(finding, asked[finding.key])
        yield Paragraph(text=f"{title}{'' if title.endswith(('?', '!', '.')) else '.'} {told}")
        if finding.kind == "failure map" and finding.is_answered:
            yield from failure_map(finding, result, asked[finding.key], f"{key}-{finding.key}")
    yield Paragraph(text=f"What this does not show. {' '.join(how.limits(result))}")


def _statement(
    finding: Finding, result: Result, margins: np.ndarray, prefix: str
) -> tuple[str, str, list[Item]]:
    limit = result.asked[finding.key].limit
    shown = statement_items(finding, limit, margins, f"{prefix}{finding.key}")
    return finding.key, _title(finding, result), [Paragraph(text=finding.sentence), *shown]


def _told(finding: Finding, asked: Any) -> str:
    """Return what was found, and what was varied if that is not everything."""
    some = getattr(asked, "quantities", ())
    if not some:
        return finding.sentence
    return f"{finding.sentence} Here only {', '.join(some)} vary, all others are nominal."


def _title(finding: Finding, result: Result) -> str:
    """Return the heading that the study file gives an analysis, or one by its kind."""
    asked = result.asked[finding.key]
    of = getattr(asked, "of", "spec")
    return asked.title or text.TITLES[finding.kind] + ("" if of == "spec" else f" of {of}")


def _findings(result: Result, prefix: str) -> list[tuple[str, str, list[Item]]]:
    """Return key, title and items of every other analysis, in the order of `KINDS`.

    Those without an answer come last, with the sentence that says why.
    """
    asked = result.asked
    made = []
    for kind, items in KINDS.items():
        for f in _answered(result):
            if f.kind == kind:
                shown = items(f, result, asked[f.key], f"{prefix}{f.key}")
                told = Paragraph(text=_told(f, asked[f.key]))
                made.append((f.key, _title(f, result), [told, *shown]))
    return made + [
        (f.key, _title(f, result), [Paragraph(text=f.sentence)])
        for f in result.findings
        if not f.is_answered
    ]


def _answered(result: Result) -> list[Finding]:
    return [finding for finding in result.findings if finding.is_answered]


def numbers(result: Result) -> dict[str, Any]:
    """Return every number of a study for ``report.json``; long tables are files beside it."""
    tables = {
        finding.key: {
            name: table.reset_index().to_dict("records")
            for name, table in sorted(finding.tables.items())
            if len(table) <= LISTED
        }
        for finding in result.findings
    }
    curves = {}
    if result.rows is not None and result.rows.done:
        margins = result.rows.columns("spec")["spec"].to_numpy(dtype=float)
        for f in _answered(result):
            if f.kind in STATEMENTS:
                curve = running(margins[: f.numbers["runs"]], f.numbers["confidence"])
                curves[f.key] = curve.reset_index().to_dict("records")
    return {"study": result.plain(), "tables": tables, "running estimate": curves}


def data_files(folder: Path) -> dict[str, str]:
    """Return the files of a run that are the same whenever it is run, with their SHA-256.

    The chunks of the rows hold wall times: their hash without them is in the provenance.
    """
    own = [folder / "study.toml", folder / "results.json", *sorted(folder.glob("*/*.parquet"))]
    return {
        path.relative_to(folder).as_posix(): file_hashes([path])[path.name]
        for path in own
        if path.is_file()
    }


def _study_file(folder: Path) -> dict[str, str]:
    path = folder / "study.toml"
    return {path.name: path.read_text(encoding="utf-8")} if path.is_file() else {}


def _table_hash(result: Result) -> dict[str, str]:
    """Return the SHA-256 of the main table as CSV, without the wall times."""
    if result.rows is None or not result.rows.done:
        return {}
    table = result.rows.table.drop(columns="wall_time", errors="ignore")
    content = table.to_csv(float_format="%.17g", lineterminator="\n").encode()
    return {"SHA-256 of the rows as CSV, without wall_time": hashlib.sha256(content).hexdigest()}
