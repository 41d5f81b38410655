"""The loop of a study on its page: diagram, parameters, equations, source, and run by the page."""

from __future__ import annotations

import functools
import hashlib
import inspect
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import control as ct

from nlctl.attributes import described_record
from nlctl.response import input_output_response
from nlctl.wording import counted

from ...report.document import Item, Paragraph, Report, Section
from ...robustness import nominal
from ...robustness.runs.experiment import Prepared
from ...robustness.uncertainty.space import arguments_of_row
from ...studies.result import Result
from ..diagram import diagram_sections
from ..live import live_item, live_numbers, live_program
from . import text as text
from .histories import Histories


@described_record(eq=False)
class StudyLoop:
    """The loop of a study, with nominal values."""

    diagram: ct.InputOutputSystem
    maker: str  # The function that makes it, as ``module:name``.
    file: str = ""  # Name of the file that the function stands in; empty if there is none.
    source: str = ""  # What is in that file; empty for a loop that comes with nlctl.
    sha256: str = ""  # Of the file.


@described_record
class Published:
    """Where a loop was published, and what its authors print of it."""

    title: str  # In a line, with authors and year.
    citation: str  # For the list of references.
    items: tuple[Item, ...] = ()  # Equations as printed.


def loop_of(prepared: Prepared) -> StudyLoop:
    """Return the loop of an experiment; with choices, that of the nominal ones."""
    build: Any = prepared.experiment.build
    while isinstance(build, functools.partial):
        build = build.func
    build = inspect.unwrap(build)
    module = str(getattr(build, "__module__", ""))
    named = StudyLoop(
        diagram=prepared.nominal_loop.system, maker=str(getattr(build, "__qualname__", build))
    )
    try:
        path = Path(inspect.getsourcefile(build) or "")
        content = path.read_bytes()
    except (OSError, TypeError):  # a callable object, or made where there is no file
        return named
    return StudyLoop(
        diagram=named.diagram,
        maker=named.maker,
        file=path.name,
        source=content.decode(errors="replace") if module.partition(".")[0] != "nlctl" else "",
        sha256=hashlib.sha256(content).hexdigest(),
    )


def loop_sections(loop: StudyLoop, result: Result) -> Iterator[Section]:
    """Yield the loop as it was run, its parameters with what was varied, and its source."""
    from_file = f" in {loop.file} (SHA-256 {loop.sha256})" if loop.file else ""
    origin = Paragraph(text=f"The loop is made by {loop.maker}{from_file}.")
    laws = result.quantities["law"].to_dict()
    yield from diagram_sections(loop.diagram, ("study_loop", "study_equations"), [origin], laws)
    if loop.source:
        yield Section(
            key="study_source",
            title=f"The source of the loop: {loop.file}",
            items=[Paragraph(text=text.SOURCE, code=loop.source)],
            level=3,
            folded=True,
        )


def with_study_live(
    report: Report,
    result: Result,
    prepared: Prepared,
    kept: Histories | None,
    names: Sequence[str] = (),
) -> Report:
    """Return the report of a study with its nominal loop, which the page runs."""
    # Its sliders are what the study varies, within its box; its limits, bands and requirements
    # those of the study.
    experiment = prepared.experiment
    space = experiment.space
    diagram: Any = loop_of(prepared).diagram
    given = arguments_of_row(space, nominal(space))
    response = input_output_response(
        diagram, experiment.timepts, experiment.inputs, given["initial_state"],
        params=given["params"], rtol=experiment.rtol, atol=experiment.atol,
    )  # fmt: skip
    program = live_program(diagram, response, given["params"])
    boxes = [f"{q.name}={q.box[0]!r}:{q.box[1]!r}" for q in space.quantities if not q.is_integer]
    item = live_item(
        program, response, names or boxes, requirements=experiment.spec.requirements,
        histories=kept, command=_repeated(result, experiment, given), base=given["params"],
        signals=_watched(kept, response),
    )  # fmt: skip
    runs = "" if kept is None else f" Shaded: 90 % of {counted(_runs(kept), 'run')} of the study."
    item = replace(item, caption=item.caption + runs)
    key = "study_fans" if kept is not None else report.sections[0].key
    return replace(
        report,
        sections=[_with(section, item) if section.key == key else section
                  for section in report.sections],
        numbers={**report.numbers, "live": live_numbers(program)},
    )  # fmt: skip


def _with(section: Section, item: Any) -> Section:
    return replace(section, items=[*section.items, item])


def _runs(kept: Histories) -> int:
    return len(next(iter(kept.signals.values()), ()))


def _watched(kept: Histories | None, response: Any) -> list[str]:
    """Return the outputs that the spec looks at, which the page draws in a row each."""
    return [name for name in (kept.signals if kept else {}) if name in response.output_labels]


def _repeated(result: Result, experiment: Any, given: dict[str, Any]) -> list[str]:
    """Return the words that repeat a run, where a loop can be named without options."""
    study, t = result.study, experiment.timepts
    plain = isinstance(experiment.inputs, float | int) and not experiment.inputs
    if study.options or study.choices or not plain:
        return []
    words = ["nlctl", "simulate", study.loop, "--until", f"{t[-1]:g}", "--step", f"{t[1]:g}"]
    named = given["params"] | {f"{k}(0)": v for k, v in given["initial_state"].items()}
    return words + [w for k, v in named.items() for w in ("--set", f"{k}={float(v)!r}")]
