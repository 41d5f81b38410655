"""The sections that every paper's page has: what the paper says, and each of its examples."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import control as ct

from nlctl.diagrams import leaves

from ..pages.diagram import diagram_figure, equations_of
from ..report.document import Figure, Item, Paragraph, Section, Table
from .paper import FoundNumber, Paper, PaperFigure, PaperRuns, Part, Statement


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
