"""The loop that a study is about, as its page shows it: diagram, parameters, equations, source."""

import functools
import hashlib
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import control as ct

from nlctl.attributes import described_record

from ...report.document import Item, Paragraph, Section
from ...robustness.runs.experiment import Prepared
from ...studies.result import Result
from ..diagram import diagram_sections


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
            items=[Paragraph(text="As it was when this page was made:", code=loop.source)],
            level=3,
            folded=True,
        )
