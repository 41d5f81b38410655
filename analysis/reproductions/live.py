"""The page of a paper that runs: each example with sliders, behind its figures."""

from dataclasses import replace

import numpy as np

from nlctl.errors import UsageError
from nlctl.export.web import WebProgram, check_linker
from nlctl.response import input_output_response

from ..pages.live import behind_figures, live_item, live_numbers, live_program, modules_together
from ..report.document import Live, Report
from ..robustness.stl.spec import requirements_of
from .paper import MovedLoop, Paper


def check_moved(paper: Paper) -> None:
    """Refuse, before anything is computed, a paper of which nothing can be moved."""
    check_linker()
    if not any(part.moved for part in paper.parts):
        raise UsageError(f"the page of {paper.key} has no loop to be moved: leave --live out")


def with_parts_live(paper: Paper, report: Report) -> Report:
    """Return a paper's report with examples that its page runs."""
    moved = {part.key: part.moved for part in paper.parts if part.moved}
    runs = {key: _live(f"{key}-live", loop) for key, loop in moved.items()}
    programs = [program for program, _ in runs.values()]
    items = modules_together([item for _, item in runs.values()], programs)
    behind = dict(zip(runs, items, strict=True))
    numbers = {f"{key}-live": live_numbers(program) for key, (program, _) in runs.items()}
    return replace(
        report,
        sections=[
            behind_figures(section, behind[section.key]) if section.key in behind else section
            for section in report.sections
        ],
        numbers={**report.numbers, **numbers},
    )


def _live(key: str, moved: MovedLoop) -> tuple[WebProgram, Live]:
    """Return an example as a page runs it."""
    loop = moved.make()
    times = np.linspace(0.0, moved.until, round(moved.until / moved.step) + 1)
    response = input_output_response(loop, times)
    program = live_program(loop, response, {})
    item = live_item(
        program, response, moved.names, signals=moved.signals, called=moved.call,
        requirements=requirements_of(moved.requirements, moved.until),
    )  # fmt: skip
    return program, replace(item, key=key)
