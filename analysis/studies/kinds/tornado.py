"""Derivatives of a margin at the nominal values, times how far each quantity may go."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from pydantic import Field

from nlctl.errors import CompileError, ParameterError
from nlctl.native import Compiled
from nlctl.native.ensemble import MetricLike
from nlctl.sensitivities import MetricGradient, metric_gradient, sensitivity_response
from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, captioned
from ...robustness import Experiment, Space, Uncertain, from_table, nominal
from ...robustness.uncertainty.space import arguments_of_row
from .. import page as text
from ..file.schema import Asked
from ..kind import Ground, Kind, Setup, column, finding_of
from ..page import column_in_words, result_table
from ..result import Finding, Result

_CAPTION = (
    "'{of}' is {value:.4g} at the nominal values. Bars: its derivative by each quantity times the "
    "distance to either end of the box; marks: a run with that quantity at that end, all others "
    "nominal. Where marks lie off the bars, it is not linear up to there."
)
GRIEWANK = (
    "A. Griewank, A. Walther: Evaluating Derivatives. 2nd ed. SIAM 2008. "
    "doi 10.1137/1.9780898717761."
)


class Tornado(Asked):
    """Derivatives at the nominal values, times how far each quantity may go."""

    of: str = Field("spec", description="Column: a margin or a metric; spec: the least margin.")


def _numbers(space: Space) -> list[Uncertain]:
    """Return the quantities that there are derivatives by."""
    return [quantity for quantity in space.quantities if not quantity.is_integer]


def _check(asked: Tornado, setup: Setup) -> None:
    """Refuse a space of integers and choices alone."""
    if not _numbers(setup.experiment.space):
        raise ParameterError("'tornado' needs quantities that are no integers, got none")


def _run(asked: Tornado, ground: Ground) -> Finding | None:
    """Differentiate the nominal run, then run every quantity at either end of its box."""
    prepared = ground.prepared
    space = prepared.experiment.space
    varied, middle = _numbers(space), nominal(space)
    rows = [middle, *(middle | {q.name: end} for q in varied for end in q.box)]
    design = from_table(space, pd.DataFrame(rows, columns=space.names), entropy=ground.seed)
    done = ground.run_design(design)
    if not done.complete:
        return None
    gradient, without = _gradient(asked, prepared.experiment, prepared.nominal_loop, varied)
    at_ends = column(done, asked.of)
    table = _table(varied, gradient, at_ends[1:].reshape(-1, 2) - at_ends[0])
    reach = table[["low", "high"]].abs().max(axis=1)
    largest = ", ".join(f"{name} ({reach[name]:.3g})" for name in reach.nlargest(3).index)
    sentence = (
        f"'{asked.of}' is {gradient.value:.4g} at the nominal values"
        + (f", by '{gradient.key}'" if gradient.key != asked.of else "")
        + f"; what changes it most within its box, by its derivative: {largest} (one run with "
        f"{counted(len(varied), 'derivative')}, {counted(len(rows), 'run')} without).{without}"
    )
    return finding_of(
        asked,
        sentence,
        runs=1 + len(rows),
        numbers={"of": asked.of, "value": gradient.value, "by": gradient.key},
        tables={"effects": table},
    )


def _table(varied: list[Uncertain], gradient: MetricGradient, runs: np.ndarray) -> pd.DataFrame:
    """Return what derivatives say of both ends of each box, and what runs there do."""
    rows = []
    for j, quantity in enumerate(varied):
        low, high = (end - float(quantity.nominal or 0.0) for end in quantity.box)
        above, below = float(gradient.above[j]), float(gradient.below[j])
        rows.append((0.5 * (above + below), below * low, above * high, *map(float, runs[j])))
    names = pd.Index([quantity.name for quantity in varied], name="quantity")
    columns = ["derivative", "low", "high", "run_low", "run_high"]
    return pd.DataFrame(rows, index=names, columns=columns)


def _gradient(
    asked: Tornado, experiment: Experiment, loop: Compiled, varied: list[Uncertain]
) -> tuple[MetricGradient, str]:
    """Return the derivatives of the nominal run, and by what there are none."""
    metrics = _metrics_of(asked, experiment)
    one = arguments_of_row(experiment.space, nominal(experiment.space))
    signals = list(dict.fromkeys(s for m in metrics for s in m.signals))
    names = [quantity.name for quantity in varied]

    def run(by: list[str]) -> MetricGradient:
        response = sensitivity_response(
            loop, experiment.timepts, experiment.inputs, one["initial_state"], of=signals,
            with_respect_to=by, params=one["params"], rtol=experiment.rtol, atol=experiment.atol,
        )  # fmt: skip
        lacks.extend(str(lack) for lack in response.missing)
        gradient = [metric_gradient(metric, response) for metric in metrics]
        return min(gradient, key=lambda gradient: gradient.value)

    lacks: list[str] = []
    refused = {}
    try:
        gradient = run(names)
    except CompileError:
        for name in names:
            try:
                run([name])
            except CompileError as error:
                refused[name] = str(error)
        lacks.clear()
        if len(refused) == len(names):
            raise
        gradient = _with_gaps(run([n for n in names if n not in refused]), names)
    doubts = "".join(f" {why[0].upper()}{why[1:]}." for why in [*lacks, *refused.values()])
    return gradient, doubts


def _with_gaps(gradient: MetricGradient, names: list[str]) -> MetricGradient:
    """Return derivatives by all names, NaN where there are none."""

    def spread(values: np.ndarray) -> np.ndarray:
        by_name = dict(zip(gradient.with_respect_to, values, strict=True))
        return np.array([by_name.get(name, np.nan) for name in names])

    return MetricGradient(
        key=gradient.key, value=gradient.value, with_respect_to=tuple(names),
        scale=spread(gradient.scale), above=spread(gradient.above), below=spread(gradient.below),
    )  # fmt: skip


def _metrics_of(asked: Tornado, experiment: Experiment) -> list[MetricLike]:
    """Return the requirement or metric of a column; of the spec all requirements."""
    requirements = experiment.spec.requirements
    if asked.of == "spec":
        return list(requirements)
    return [m for m in (*requirements, *experiment.metrics) if m.key == asked.of]


def _items(finding: Finding, result: Result, asked: Tornado, key: str) -> Iterator[Item]:
    """Yield the tornado."""
    n, table = finding.numbers, finding.tables["effects"]
    caption = _CAPTION.format(of=n["of"], value=n["value"])
    yield captioned(
        f"{key}-tornado",
        caption,
        f"Towards the upper end: {column_in_words(table['high'])}.",
        figures.tornado(table, n["value"]),
    )
    columns = {"derivative": "derivative", "low": "towards the lower end", "high": "upper end"}
    columns |= {"run_low": "run at the lower end", "run_high": "upper end "}
    order = table[["low", "high"]].abs().max(axis=1).sort_values(ascending=False, kind="stable")
    yield result_table(table.loc[order.index], f"{text.SAME}, as changes.", columns)


TORNADO = Kind(
    name="tornado",
    schema=Tornado,
    run=_run,
    title="Sensitivity: tornado of derivatives",
    answers="derivative of a margin by each quantity, times how far that may go",
    method=(
        "The tornado has the derivatives of one run at the nominal values, integrated with the run "
        "(forward sensitivities; Griewank and Walther 2008), and runs at both ends of each box."
    ),
    sources=(GRIEWANK,),
    columns=("of",),
    check=_check,
    runs=lambda asked, setup: 1 + 2 * len(_numbers(setup.experiment.space)),
    items=_items,
)
