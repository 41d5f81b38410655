"""The loop of a study on its page, to be moved within the box of the study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from nlctl.response import input_output_response
from nlctl.wording import counted

from ...report.document import Report
from ...robustness import Prepared, nominal
from ...robustness.uncertainty.space import arguments_of_row
from ...studies.result import Result
from ..live import live_item, live_numbers, live_program
from .histories import Histories
from .loop import loop_of


def with_study_live(
    report: Report,
    result: Result,
    prepared: Prepared,
    histories: Histories | None,
    names: Sequence[str] = (),
) -> Report:
    """Return the report of a study with its nominal loop, which the page runs."""
    # Its sliders are what the study varies, within its box; its limits, bands and requirements
    # those of the study.
    experiment = prepared.experiment
    space = experiment.space
    diagram: Any = loop_of(prepared).diagram
    arguments = arguments_of_row(space, nominal(space))
    response: Any = input_output_response(
        diagram, experiment.timepts, experiment.inputs, arguments["initial_state"],
        params=arguments["params"], rtol=experiment.rtol, atol=experiment.atol,
    )  # fmt: skip
    program = live_program(diagram, response, arguments["params"])
    boxes = [f"{q.name}={q.box[0]!r}:{q.box[1]!r}" for q in space.quantities if not q.is_integer]
    watched = histories.signals if histories else {}  # by the spec; the page draws each in a row
    item = live_item(
        program, response, names or boxes, requirements=experiment.spec.requirements,
        histories=histories, command=_repeated(result, experiment, arguments),
        base=arguments["params"],
        signals=[name for name in watched if name in response.output_labels],
    )  # fmt: skip
    key = report.sections[0].key
    if histories is not None:
        key, runs = "study_fans", len(next(iter(histories.signals.values()), ()))
        shaded = f" Shaded: 90 % of {counted(runs, 'run')} of the study."
        item = replace(item, caption=item.caption + shaded)
    sections = [
        replace(section, items=[*section.items, *([item] if section.key == key else [])])
        for section in report.sections
    ]
    return replace(
        report, sections=sections, numbers={**report.numbers, "live": live_numbers(program)}
    )


def _repeated(result: Result, experiment: Any, given: dict[str, Any]) -> list[str]:
    """Return the words that repeat a run, where a loop can be named without options."""
    study, t = result.study, experiment.timepts
    plain = isinstance(experiment.inputs, float | int) and not experiment.inputs
    if study.options or study.choices or not plain:
        return []
    words = ["nlctl", "simulate", study.loop, "--until", f"{t[-1]:g}", "--step", f"{t[1]:g}"]
    named = given["params"] | {f"{k}(0)": v for k, v in given["initial_state"].items()}
    return words + [w for k, v in named.items() for w in ("--set", f"{k}={float(v)!r}")]
