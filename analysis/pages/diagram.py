"""A loop on a page: its diagram, its parameters, its equations as they were run."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import control as ct
import numpy as np

from nlctl import native
from nlctl.diagrams import parameters
from nlctl.drawing.picture import draw
from nlctl.errors import UsageError
from nlctl.native import typeset
from nlctl.upstream.systems import System

from ..report.document import Equation, Figure, Item, Paragraph, Section, Table
from ..studies.page.text import unit_text

_LONGEST = 60  # characters of a value
_DIAGRAM = "The loop as simulated, with nominal values, and the inside of its nested diagrams."
_ALL_PARAMETERS = "All parameters of the loop, with their values."
_PARAMETERS = (
    "All parameters of the loop, with their values; varied: by which law the study changed them."
)
_EQUATIONS = (
    "Read from the functions that are run, block by block; letters are the names of signals, "
    "parameters and local variables."
)


def diagram_sections(
    diagram: ct.InputOutputSystem,
    keys: tuple[str, str],
    before: Sequence[Item] = (),
    laws: Mapping[Any, str] | None = None,
) -> list[Section]:
    """Return what a loop is: diagram and parameters, then equations; two sections, by their keys.

    With `laws` the table of parameters says how a study has varied each.
    """
    shown = [*before]
    if isinstance(diagram, ct.InterconnectedSystem):  # a single system has no diagram
        shown.append(diagram_figure(diagram, "study_diagram", _DIAGRAM))
    return [
        Section(key=keys[0], title="The loop", items=[*shown, *_parameter_tables(diagram, laws)]),
        Section(
            key=keys[1],
            title="The equations of the loop",
            items=[*_equation_items(diagram)],
            level=3,
            folded=True,
        ),
    ]


def diagram_figure(diagram: ct.InterconnectedSystem, key: str, caption: str) -> Figure:
    """Return the block diagram, with the inside of nested ones."""
    blocks = ", ".join(str(system.name) for system in diagram.syslist)
    return Figure(
        key=key,
        caption=caption,
        description=f"Block diagram of {diagram.name} with the blocks {blocks}.",
        figure=draw(diagram, expand=True),
    )


def _parameter_tables(
    diagram: ct.InputOutputSystem, laws: Mapping[Any, str] | None = None
) -> Iterator[Table]:
    """Yield all parameters of a diagram, if it has any; with `laws` also how each was varied."""
    table = parameters(diagram)
    if not len(table):
        return
    columns = ["parameter", "value", "unit", "meaning"]
    rows = [
        [name, _value(row["value"]), unit_text(row["unit"]), row["meaning"]]
        for name, row in table.iterrows()
    ]
    if laws is not None:
        columns.insert(3, "varied")
        for row in rows:
            row.insert(3, laws.get(row[0], ""))
    caption = _ALL_PARAMETERS if laws is None else _PARAMETERS
    yield Table(caption=caption, columns=columns, rows=rows, folded=True)


def _equation_items(diagram: ct.InputOutputSystem) -> Iterator[Item]:
    """Yield the equations of every block, read from the functions that are run."""
    try:
        blocks = typeset(diagram)
    except UsageError as refused:  # it was run all the same, by calling a function in Python
        yield Paragraph(text=f"There are no formulas of this loop: {refused}")
        return
    yield Paragraph(text=_EQUATIONS)
    for block in blocks:
        yield Paragraph(text=f"Block {block.block}:")
        yield from block_items(block)


def _value(value: Any) -> Any:
    """Return a value as the table shows it; of long ones only the size."""
    if isinstance(value, bool | int | float | str):
        return value
    text = str(value)
    return text if len(text) <= _LONGEST else f"{'×'.join(map(str, np.shape(value)))} numbers"


def equations_of(diagram: System, blocks: Collection[str], number: str = "") -> list[Item]:
    """Return the equations of some blocks of a diagram, with values in the places of parameters."""
    return [
        item
        for block in native.typeset(diagram, values=True)
        if block.block in blocks
        for item in block_items(block, number)
    ]


def block_items(block: native.BlockEquations, number: str = "") -> Iterator[Item]:
    """Yield a block's equations, and what their symbols stand for, or why there are none."""
    if block.missing:
        yield Paragraph(text=f"There is no formula of it: {block.missing}.")
    for i, line in enumerate((*block.inputs, *block.equations)):
        yield Equation(latex=line, number="" if i else number)
    if block.where:
        yield Paragraph(text="where")
        yield from (Equation(latex=line) for line in block.where)
