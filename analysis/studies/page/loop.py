"""The loop that a study is about, as its page shows it: diagram, parameters, equations, source."""

from __future__ import annotations

import functools
import hashlib
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
import pandas as pd

from nlctl.diagrams import parameters
from nlctl.drawing.picture import draw
from nlctl.errors import UsageError
from nlctl.native import typeset

from ...report.document import Figure, Item, Paragraph, Section, Table
from ...report.equations import block_items
from ...robustness.runs.experiment import Prepared
from . import text as text

if TYPE_CHECKING:
    from ..result import Result

__all__ = [
    "Published",
    "StudyLoop",
    "diagram_figures",
    "equation_items",
    "loop_of",
    "loop_sections",
    "parameter_tables",
]

_LONGEST = 60  # characters of a value


@dataclass(frozen=True, kw_only=True, eq=False)
class StudyLoop:
    """The loop of a study, with nominal values.

    Attributes
    ----------
    diagram : control.InputOutputSystem
    maker : str
        The function that makes it, as ``module:name``.
    file : str
        Name of the file that the function stands in; empty if there is none.
    source : str
        What is in that file; empty for a loop that comes with nlctl.
    sha256 : str
        Of the file.
    """

    diagram: ct.InputOutputSystem
    maker: str
    file: str = ""
    source: str = ""
    sha256: str = ""


@dataclass(frozen=True, kw_only=True)
class Published:
    """Where a loop was published, and what its authors print of it.

    Attributes
    ----------
    title : str
        In a line, with authors and year.
    citation : str
        For the list of references.
    items : tuple of Item
        Equations as printed.
    """

    title: str
    citation: str
    items: tuple[Item, ...] = ()


def loop_of(prepared: Prepared) -> StudyLoop:
    """Return the loop of an experiment; with choices, that of the nominal ones."""
    nominal = {choice.name: choice.nominal for choice in prepared.experiment.space.choices}
    compiled = next(
        (loop for labels, loop in prepared.loops if dict(labels) == nominal), prepared.loops[0][1]
    )
    build: Any = prepared.experiment.build
    while isinstance(build, functools.partial):
        build = build.func
    build = inspect.unwrap(build)
    module = str(getattr(build, "__module__", ""))
    found = StudyLoop(diagram=compiled.system, maker=str(getattr(build, "__qualname__", build)))
    try:
        path = Path(inspect.getsourcefile(build) or "")
        content = path.read_bytes()
    except (OSError, TypeError):  # a callable object, or made where there is no file
        return found
    return StudyLoop(
        diagram=found.diagram,
        maker=found.maker,
        file=path.name,
        source=content.decode(errors="replace") if module.partition(".")[0] != "nlctl" else "",
        sha256=hashlib.sha256(content).hexdigest(),
    )


def loop_sections(loop: StudyLoop, result: Result, prefix: str, level: int) -> Iterator[Section]:
    """Yield the loop as it was run, its parameters with what was varied, and its source."""
    from_file = f" in {loop.file} (SHA-256 {loop.sha256})" if loop.file else ""
    made = Paragraph(text=f"The loop is made by {loop.maker}{from_file}.")
    yield Section(
        key=f"{prefix}study_loop",
        title="The loop",
        items=[
            made,
            *diagram_figures(loop.diagram, prefix),
            *parameter_tables(loop.diagram, result.quantities["law"].to_dict()),
        ],
        level=level,
    )
    yield Section(
        key=f"{prefix}study_equations",
        title="The equations of the loop",
        items=[*equation_items(loop.diagram)],
        level=level + 1,
        folded=True,
    )
    if loop.source:
        yield Section(
            key=f"{prefix}study_source",
            title=f"The source of the loop: {loop.file}",
            items=[Paragraph(text=text.SOURCE, code=loop.source)],
            level=level + 1,
            folded=True,
        )


def diagram_figures(diagram: ct.InputOutputSystem, prefix: str = "") -> Iterator[Figure]:
    """Yield the block diagram; a single system has none."""
    if isinstance(diagram, ct.InterconnectedSystem):
        blocks = ", ".join(str(system.name) for system in diagram.syslist)
        yield Figure(
            key=f"{prefix}study_diagram",
            caption=text.DIAGRAM,
            description=f"Block diagram of {diagram.name} with the blocks {blocks}.",
            figure=draw(diagram, expand=True),
        )


def parameter_tables(
    diagram: ct.InputOutputSystem, laws: Mapping[Any, str] | None = None
) -> Iterator[Table]:
    """Yield all parameters of a diagram, if it has any; with `laws` also how each was varied."""
    table: pd.DataFrame = parameters(diagram)
    if not len(table):
        return
    columns = ["parameter", "value", "unit", "meaning"]
    rows = [
        [name, _value(row["value"]), text.unit_text(row["unit"]), row["meaning"]]
        for name, row in table.iterrows()
    ]
    if laws is not None:
        columns.insert(3, "varied")
        for row in rows:
            row.insert(3, laws.get(row[0], ""))
    caption = text.ALL_PARAMETERS if laws is None else text.PARAMETERS
    yield Table(caption=caption, columns=columns, rows=rows, folded=True)


def equation_items(diagram: ct.InputOutputSystem) -> Iterator[Item]:
    """Yield the equations of every block, read from the functions that are run."""
    try:
        blocks = typeset(diagram)
    except UsageError as refused:  # it was run all the same, by calling a function as it stands
        yield Paragraph(text=f"There are no formulas of this loop: {refused}")
        return
    yield Paragraph(text=text.EQUATIONS_CAPTION)
    for block in blocks:
        yield Paragraph(text=f"Block {block.block}:")
        yield from block_items(block)


def _value(value: Any) -> Any:
    """Return a value as the table shows it; of long ones only the size."""
    if isinstance(value, bool | int | float | str):
        return value
    told = str(value)
    return told if len(told) <= _LONGEST else f"{'×'.join(map(str, np.shape(value)))} numbers"
