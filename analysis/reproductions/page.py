"""The page of a paper: its record and its runs -> a report."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import control as ct

from nlctl.attributes import described_record
from nlctl.diagrams import leaves
from nlctl.errors import UsageError
from nlctl.wording import some_of

from ..pages.diagram import diagram_figure, equations_of
from ..report.document import Claim, Figure, Item, Paragraph, Report, Section, Table, versions
from ..report.svg import Drawn
from .paper import FoundNumber, Paper, PaperFigure, PaperRuns, Part, Statement, simulate_cases


def found_numbers(statements: Iterable[Statement], runs: PaperRuns) -> list[FoundNumber]:
    """Return every statement with the value that the runs give it."""
    return [FoundNumber(statement=s, value=float(s.value(runs))) for s in statements]


def model_section(paper: Paper) -> Section:
    """Return what the paper is, and its equations."""
    citation = Paragraph(text=f"The paper: {paper.citation}")
    return Section(
        key="model", title=paper.heading, folded=True, items=[citation, *paper.model]
    )  # fmt: skip


def part_sections(
    paper: Paper, part: Part, runs: PaperRuns, numbers_found: Sequence[FoundNumber]
) -> list[Section]:
    """Return one example: its loop and its figures, then what is folded below them."""
    diagram = part.make()
    key, printed = part.key, [one for one in numbers_found if one.statement.part == part.key]
    drawn = [(figure.folded, drawn_figure(figure, runs)) for figure in part.figures]
    shown: list[Item] = [
        *equations_of(diagram, part.blocks, part.number),
        diagram_figure(diagram, f"{key}-diagram", part.picture),
        *(figure for folded, figure in drawn if not folded),
        *(part.items(runs) if part.items else ()),
    ]
    parameters = [parameter_table(part, diagram)] if part.parameters else []
    numbers = [number_table(paper, printed)] if printed else []
    folded: tuple[tuple[str, str, Sequence[Item]], ...] = (
        ("signals", part.more, [figure for folded, figure in drawn if folded]),
        ("parameters", "Parameters as printed and as used", parameters),
        (paper.numbers_key, paper.numbers_title.format(count=len(printed)), numbers),
    )
    return [
        Section(key=key, title=part.title, items=shown),
        *(
            Section(key=f"{key}-{name}", title=title, level=3, folded=True, items=items)
            for name, title, items in folded
            if items
        ),
    ]


def drawn_figure(figure: PaperFigure, runs: PaperRuns) -> Figure:
    """Return a figure of a paper, drawn."""
    description = figure.description
    text = description(runs) if isinstance(description, Callable) else description
    return Figure(
        key=figure.key,
        caption=figure.caption,
        description=text or figure.caption,
        figure=figure.draw(runs),
    )


def parameter_table(part: Part, diagram: ct.InterconnectedSystem) -> Table:
    """Return the printed parameters next to those in use, which are read from the blocks."""
    blocks = {
        leaf.system.name: getattr(leaf.system, "spec", leaf.system) for leaf in leaves(diagram)
    }
    return Table(
        caption="The paper's values, the values in use (read from the blocks), and open points.",
        columns=("parameter", "as printed", "as used", "remark"),
        rows=[
            (name, printed, used.format(**blocks).replace("-", "−"), remark)
            for name, printed, used, remark in part.parameters
        ],
    )


def number_table(paper: Paper, numbers: Sequence[FoundNumber]) -> Table:
    """Return numbers as found and as printed; where they were read, if that is known of any."""
    is_read = any(number.statement.read for number in numbers)
    columns = ("case", "quantity", "found", paper.asked, "difference", "tolerance", "status")
    rows = [
        (
            number.statement.case,
            number.statement.quantity,
            f"{number.value:{paper.digits}}",
            number.statement.asked,
            f"{number.error:.1e}",
            f"{number.statement.tolerance:.0e}",
            "pass" if number.holds else ("refuted" if number.statement.by else "fail"),
            *([number.statement.read] if is_read else []),
        )
        for number in numbers
    ]
    return Table(
        caption=paper.numbers_caption,
        columns=(*columns, "read in") if is_read else columns,
        rows=rows,
        status="status",
    )


def source_section(paper: Paper) -> Section:
    """Return where the numbers were read."""
    return Section(
        key="sources",
        title="Where the numbers were read",
        items=[
            Table(
                caption="Only what could be read is compared; the tables of numbers name the key.",
                columns=("key", "source"),
                rows=[(source.key, source.text) for source in paper.sources],
            )
        ],
    )


def open_section(paper: Paper) -> Section:
    """Return what does not reproduce, what could not be read, and what was chosen."""
    items = [Paragraph(text=point) for point in paper.open_points]
    return Section(key="open", title="What does not reproduce, and what is open", items=items)


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
