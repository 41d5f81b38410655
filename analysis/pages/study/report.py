"""A robustness study as a report, or as sections of another one."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...report.document import Figure, Paragraph, Report, Section, Table, versions
from ...report.outline import summary
from ...report.render import file_hashes
from ...studies.file.schema import Varied
from ...studies.kinds import KINDS
from ...studies.page import ASSUMED, assumptions_in, running, without_assumptions
from ...studies.reading.own_kinds import STAND_IN
from ...studies.result import LISTED, Finding, Result
from ...studies.sealed import as_written
from . import methods as how
from .claims import claims, traceability, verdict
from .histories import Histories
from .loop import Published, StudyLoop, loop_sections
from .rows import fan_items, margin_items, row_items, setup_items

_PART = (
    "Short studies of what happens when parameters, initial states and disturbances differ from "
    "the paper's. nlctl report STUDY.toml makes a whole report on one, and on longer studies; the "
    "files reports/*.toml of nlctl are such studies."
)
OUTCOMES = {  # by the light
    "pass": "shown",
    "caution": "not shown yet",
    "neutral": "no claims",
}


def study_report(
    result: Result,
    kept: Histories | None = None,
    command: str = "nlctl report RUN",
    loop: StudyLoop | None = None,
    published: Published | None = None,
) -> Report:
    """Compose the report of a study."""
    kinds = [a.definition for a in result.study.analysis if ":" in a.kind]
    is_own = any(kind.name != STAND_IN for kind in kinds)  # their errors are reported as such
    with nullcontext() if is_own else as_written(f"'{result.folder}'"):
        paragraphs, sources = how.methods(result, published)
        return Report(
            title=result.study.study.title,
            question=result.study.study.question,
            verdict=without_assumptions(verdict(result)),
            lead=_lead(result, kept),
            claims=claims(result),
            sections=study_sections(result, kept, loop, published, limits=False),
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
    loop: StudyLoop | None = None,
    published: Published | None = None,
    *,
    prefix: str = "",
    level: int = 2,
    limits: bool = True,
) -> list[Section]:
    """Compose the sections of a study."""
    table = None if result.rows is None or not result.rows.done else result.rows.table
    asked = [Section(key="study_asked", title="Setup", items=[*setup_items(result, published)])]
    asked += traceability(result, prefix)
    if published is not None and published.items:
        items = [*published.items]
        title = "The loop as published"
        asked.append(Section(key="study_published", title=title, items=items, folded=True))
    if loop is not None:
        asked += loop_sections(loop, result)
    if kept is not None:
        shown = [*fan_items(kept, f"{prefix}study")]
        asked.append(Section(key="study_fans", title="The runs over time", items=shown))
    if table is not None:
        key = "study_rows"  # no analysis is called that: keys of these have hyphens only
        rows = [*row_items(result, table, f"{prefix}{key}")]
        asked.append(Section(key=key, title="Outcomes of the runs", items=rows))
        asked += [
            _section(f, result, without_assumptions(f.sentence), prefix)
            for f in _statements(result)
        ]
    asked += _findings(result, prefix)
    asked += _assumed(result)
    if limits:
        texts = [Paragraph(text=words) for words in how.limits(result)]
        asked.append(Section(key="study_limits", title="Limitations", items=texts))
    return [
        replace(section, key=f"{prefix}{section.key}", level=section.level - 2 + level)
        for section in asked
    ]


def _lead(result: Result, kept: Histories | None) -> Figure | None:
    """Return the picture of a study: its runs over time, or else their margins."""
    if kept is not None:
        name = next(iter([n for n in kept.limits if n in kept.signals] or kept.signals))
        one = replace(
            kept,
            signals={name: kept.signals[name]},
            nominal={name: kept.nominal[name]},
            worst={name: kept.worst[name]},
        )
        return next(item for item in fan_items(one, "lead") if isinstance(item, Figure))
    if result.rows is not None and result.rows.done:
        items = margin_items(result, result.rows.table, "lead")
        return next(item for item in items if isinstance(item, Figure))
    return None


def _assumed(result: Result) -> list[Section]:
    """Return the assumptions of all statements, each once; nothing if there are none."""
    assumptions = assumptions_in(finding.sentence for finding in result.findings)
    items = [Paragraph(text=f"{words[:1].upper()}{words[1:]}.") for words in assumptions]
    return [Section(key="study_assumed", title=ASSUMED, items=items)] if assumptions else []


def study_part(
    studies: Sequence[tuple[Result, Histories | None]],
    key: str = "robustness",
    published: Mapping[str, Published] | None = None,
) -> list[Section]:
    """Compose several studies, in short, as a part of another report: first the verdicts."""
    rows = []
    for result, _ in studies:
        look, counts = summary(claims(result))
        words = f"{counts} {without_assumptions(verdict(result))}"
        asked = result.study.study.question
        rows.append((result.study.study.title, asked, OUTCOMES.get(look, look), words))
    overview = Table(
        caption="The studies: what was asked, and what was found.",
        columns=("study", "asked", "outcome", "found"),
        rows=rows,
        status="outcome",
    )
    parts = [
        section
        for number, (result, kept) in enumerate(studies, 1)
        for section in _brief(
            result, kept, f"{key}-{number}", (published or {}).get(result.study.loop)
        )
    ]
    limits = dict.fromkeys(words for result, _ in studies for words in how.limits(result))
    return [
        Section(key=key, title="Robustness", items=[Paragraph(text=_PART), overview]),
        *parts,
        Section(
            key=f"{key}-limits",
            title="What these studies do not show",
            items=[Paragraph(text=words) for words in limits],
            level=3,
            folded=True,
        ),
    ]


def _brief(
    result: Result, kept: Histories | None, key: str, published: Published | None
) -> Iterator[Section]:
    """Yield a study in short: what each analysis found, runs over time, and what it rests on."""
    asked = result.asked
    answers = Table(
        caption="Analyses of the loop, and their results.",
        columns=("asked", "found"),
        rows=[(_title(f, result), _sentence(f, asked[f.key])) for f in result.findings],
    )
    fans = () if kept is None else fan_items(kept, key)
    yield Section(key=key, title=result.study.study.title, items=[answers, *fans], level=3)
    setup = [*setup_items(result, published)]
    if result.rows is not None and result.rows.done:
        setup += margin_items(result, result.rows.table, key)
    title = "Setup, and outcomes of the runs"
    yield Section(key=f"{key}-asked", title=title, items=setup, level=4, folded=True)
    for section in _assumed(result):
        yield replace(section, key=f"{key}-assumed", level=4, folded=True)
    for finding in result.findings:
        one = asked[finding.key]
        if one.definition.in_brief and finding.is_answered:
            items = [*one.definition.items(finding, result, one, f"{key}-{finding.key}")]
            yield Section(
                key=f"{key}-map", title=_title(finding, result), items=items, level=4, folded=True
            )


def _sentence(finding: Finding, asked: object) -> str:
    """Return what was found, and what was varied if that is not everything."""
    sentence = without_assumptions(finding.sentence)
    if not (isinstance(asked, Varied) and asked.quantities):
        return sentence
    return f"{sentence} Here only {', '.join(asked.quantities)} vary, all others are nominal."


def _title(finding: Finding, result: Result) -> str:
    """Return the heading that the study file gives an analysis, or one by its kind."""
    asked = result.asked[finding.key]
    of = (getattr(asked, key) for key in asked.definition.columns)
    return asked.title or asked.definition.title + "".join(f" of {c}" for c in of if c != "spec")


def _findings(result: Result, prefix: str) -> list[Section]:
    """Return a section for every other analysis, in the order of `KINDS`, then one's own."""
    # Those without an answer come last, with the sentence that says why.
    asked = result.asked
    places = {kind: place for place, kind in enumerate(KINDS)}
    others = [f for f in _answered(result) if not asked[f.key].definition.is_statement]
    others.sort(key=lambda f: places.get(asked[f.key].definition, len(places)))
    return [_section(f, result, _sentence(f, asked[f.key]), prefix) for f in others] + [
        Section(key=f.key, title=_title(f, result), items=[Paragraph(text=f.sentence)])
        for f in result.findings
        if not f.is_answered
    ]


def _section(finding: Finding, result: Result, sentence: str, prefix: str) -> Section:
    """Return what an analysis found, in words, with figures and tables of its kind."""
    asked = result.asked[finding.key]
    shown = asked.definition.items(finding, result, asked, f"{prefix}{finding.key}")
    items = [Paragraph(text=sentence), *shown]
    return Section(key=finding.key, title=_title(finding, result), items=items)


def _statements(result: Result) -> list[Finding]:
    """Return what was answered about the probability of a violation."""
    return [f for f in _answered(result) if result.asked[f.key].definition.is_statement]


def _answered(result: Result) -> list[Finding]:
    return [finding for finding in result.findings if finding.is_answered]


def numbers(result: Result) -> dict[str, Any]:
    """Return every number of a study for ``report.json``; long tables are files next to it."""
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
        for f in _statements(result):
            curve = running(margins[: f.numbers["runs"]], f.numbers["confidence"])
            curves[f.key] = curve.reset_index().to_dict("records")
    return {"study": result.plain(), "tables": tables, "running estimate": curves}


def data_files(folder: Path) -> dict[str, str]:
    """Return the files of a run that are the same whenever it is run, with their SHA-256."""
    # The chunks of the rows hold wall times: their hash without them is in the provenance.
    paths = [folder / "study.toml", folder / "results.json", *sorted(folder.glob("*/*.parquet"))]
    return {
        path.relative_to(folder).as_posix(): file_hashes([path])[path.name]
        for path in paths
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
