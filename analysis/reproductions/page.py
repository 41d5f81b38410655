"""The page of a paper: its record and its runs -> a report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from nlctl.attributes import described_record
from nlctl.errors import UsageError
from nlctl.wording import some_of

from ..report.document import Claim, Figure, Report, Section, versions
from ..report.svg import Drawn
from .cases import simulate_cases
from .paper import FoundNumber, Paper, PaperRuns
from .sections import (
    drawn_figure,
    found_numbers,
    model_section,
    open_section,
    part_sections,
    source_section,
)

ProgressWatch = Callable[[str, float], AbstractContextManager[Callable[[float], object]]]
"""``watch(what, total)`` is entered around a part of the work; what it gives is called with how
much more of `total` is done."""


def unwatched(what: str, total: float) -> AbstractContextManager[Callable[[float], object]]:
    """Nobody is shown how far the work is."""
    return nullcontext(lambda amount: None)


@described_record(eq=False)
class Composed:
    """The report, before it is written."""

    report: Report
    # Those of its figures that are drawn already, for `nlctl.analysis.report.render.write_report`.
    drawn: Drawn
    # Whether all numbers of the reproduction are those that were to be reached; what refutes the
    # paper counts as reached.
    passed: bool


def report_of(
    paper: Paper,
    *,
    verdict: str,
    claims: Sequence[Claim],
    sections: Sequence[Section],
    lead: Figure | None,
    numbers: Mapping[str, Any],
) -> Report:
    """Return a paper's report: what every page takes from the record, and what was found."""
    return Report(
        title=paper.title,
        question=paper.question,
        verdict=verdict,
        lead=lead,
        claims=claims,
        sections=sections,
        command=paper.command or f"nlctl report {paper.key}",
        provenance=versions(*paper.packages),
        numbers=numbers,
        methods=paper.methods,
        limits=paper.limits,
        references=paper.references,
    )


def paper_page(paper: Paper, runs: PaperRuns) -> Report:
    """Compose the page of a paper from its runs."""
    checked = found_numbers(paper.statements, runs)
    parts = [s for part in paper.parts for s in part_sections(paper, part, runs, checked)]
    sections = [model_section(paper), *parts, open_section(paper), source_section(paper)]
    numbers = {f"{f.statement.case}: {f.statement.quantity}": f.value for f in checked}
    return report_of(
        paper,
        verdict=verdict_of(paper, checked),
        claims=claims_of(paper, checked),
        sections=sections,
        lead=None if paper.lead is None else drawn_figure(paper.lead, runs),
        numbers={paper.key: numbers},
    )


def verdict_of(paper: Paper, numbers: Sequence[FoundNumber]) -> str:
    """Return how many statements hold, which do not, and what is not reproduced at all."""
    missed = [f for f in numbers if not f.holds]
    names = "; ".join(
        f"{f.statement.quantity} is {f.value:.4g}, not {f.statement.asked}" for f in missed
    )
    held = some_of(len(numbers) - len(missed), len(numbers), "statement", "holds", "hold")
    return f"{held}{f' ({names})' if missed else ''}. Not reproduced: {paper.not_reproduced}"


def claims_of(paper: Paper, numbers: Sequence[FoundNumber]) -> list[Claim]:
    """Return one claim for each question, with the numbers that answer it."""
    asked: dict[str, list[FoundNumber]] = {}
    for number in numbers:
        asked.setdefault(number.statement.claim, []).append(number)
    return [_claim(paper, text, answers) for text, answers in asked.items()]


def _claim(paper: Paper, text: str, answers: Sequence[FoundNumber]) -> Claim:
    missed = [answer for answer in answers if not answer.holds]
    shown = (missed or answers)[0]
    measured = f"{shown.statement.quantity}: {shown.value:{paper.digits}}"
    limit = shown.statement.asked
    if shown.statement.relation == "=" and shown.statement.tolerance:
        limit = f"{limit} ± {shown.statement.tolerance:g}"
    if len(answers) > 1 and not missed:
        measured = some_of(len(answers), len(answers), "number", "holds", "hold")
        limit = "each as it is printed or required"
    by = shown.statement.by if missed else ""
    return Claim(
        text=text,
        measured=measured,
        limit=limit,
        holds=not missed,
        evidence=f"{shown.statement.part}-{paper.numbers_key}",
        status="refuted" if by else "",
        by=by,
    )


def compose_paper(
    paper: Paper,
    folder: Path,
    *,
    whole: bool = False,
    watch: ProgressWatch = unwatched,
    **more: object,
) -> Composed:
    """Run a paper's examples, and compose its page; nothing is written."""
    if paper.compose is not None:
        return paper.compose(folder, whole=whole, watch=watch, **more)
    # Threads and a second process are of no use to runs of seconds.
    if whole:
        raise UsageError(f"{paper.key} has no runs beyond its examples: leave --far out")
    with watch("simulating", len(paper.cases)) as advance:
        runs = simulate_cases(paper.cases, advance)
    report = paper_page(paper, runs)
    passed = all(claim.holds or claim.by for claim in report.claims)
    return Composed(report=report, drawn={}, passed=passed)
