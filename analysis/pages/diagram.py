"""A loop on a page: diagram, parameters, equations as they were run; and one run of it."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import control as ct
import numpy as np

from nlctl import native
from nlctl.diagrams import parameters
from nlctl.drawing.picture import draw
from nlctl.errors import ParameterError, UsageError
from nlctl.names import check_known
from nlctl.native import typeset
from nlctl.plotting.signals import rows_figure
from nlctl.responses.time_response import as_response
from nlctl.upstream.systems import System

from ..report.document import Equation, Figure, History, Item, Paragraph, Section, Table
from ..studies.page import unit_text

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


_SHOWN = 6  # signals of a chart at first


def run_section(
    loop: ct.InputOutputSystem,
    response: Any,
    signals: Sequence[str],
    params: Mapping[str, Any],
) -> Section:
    """Return one run: its own parameters, its signals over time, and their ranges."""
    curves = outputs_of_run(response)
    for name in signals:
        check_known("output", name, curves, f"of '{loop.name}'")
    t = np.asarray(response.time, dtype=float)
    shown, rows = as_response(response, loop).rows([*signals] or None)
    figure, _ = rows_figure(t, shown, rows)
    caption = f"{', '.join(shown)} over {t[-1]:g} s."
    ranges = [
        (n, *(float(f(y)) for f in (np.min, np.max)), float(y[-1])) for n, y in curves.items()
    ]
    text = "; ".join(f"{n} between {low:.4g} and {high:.4g}" for n, low, high, _ in ranges)
    history = History(
        key="run-history", caption=caption, description=text, time=t, signals=curves,
        shown=tuple(name for name in shown if name in curves)[:_SHOWN],
    )  # fmt: skip
    items: list[Item] = [
        *own_values("This run", params),
        Figure(key="run-signals", caption=caption, description=text, figure=figure),
        history,
        Table(
            caption="The outputs of this run: least and largest sample, and the last one.",
            columns=("output", "least", "largest", "at the end"),
            rows=ranges,
        ),
    ]
    return Section(key="run", title="A run", items=items)


def own_values(what: str, params: Mapping[str, Any]) -> list[Item]:
    """Return a paragraph with the values that are not the loop's nominal ones."""
    values = ", ".join(f"{name} = {value}" for name, value in params.items())
    return [Paragraph(text=f"{what} has values of its own: {values}.")] if params else []


def outputs_of_run(response: Any) -> dict[str, np.ndarray]:
    """Return the outputs of a run by name."""
    y = np.asarray(response.y, dtype=float)
    if y.ndim != 2:
        raise ParameterError(
            f"the response has outputs of shape {y.shape}: a report shows one run, give one trace"
        )
    return dict(zip(response.output_labels, y, strict=True))
