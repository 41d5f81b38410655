"""The loop of a study on its page, to be moved within the box of the study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from nlctl.response import input_output_response
from nlctl.wording import counted

from ...report.document import Report, Section
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
