"""Gains by search on a few samples, validated on fresh ones."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from pydantic import Field

from nlctl.errors import ParameterError
from nlctl.names import check_known
from nlctl.sensitivities import Tuned, tune
from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, Paragraph, captioned
from ...robustness import (
    Experiment,
    Prepared,
    Space,
    Uncertain,
    Violation,
    bound_verdict,
    from_table,
    independent,
    nominal,
    prepare,
    resolved,
    violation_probability,
)
from ...robustness.runs.experiment import signals_of_rows
from ...robustness.statistics.guarantee import rounded_up
from .. import page as text
from ..file.schema import Asked, Confidence, Pair, Size, Whole
from ..kind import Ground, Kind, Setup, finding_of
from ..page import DID_NOT_END, column_in_words, margin_text, result_table
from ..result import Finding, Result
from .context import CLOPPER

_BOTH = "Signals with the gains of the start and with those that were found, at nominal values."
_TRIED = "What every choice of gains was worth on the samples that gains were found on."
_BOUGHT = (
    "What each gain contributes, on these samples: with this one alone as found, and with all but "
    "this one. What lies far outside is cut off."
)
_FRESH = "Share of the fresh rows with at most that margin, with the same rows before and after."
_SAMPLES = (
    "Margins and cost on the samples that gains were found on: least margins, and the mean of a "
    "metric."
)
MADSEN = (
    "K. Madsen: An algorithm for minimax solution of overdetermined systems of non-linear "
    "equations. J. Inst. Maths Applics 16 (1975) 321–328. doi 10.1093/imamat/16.3.321."
)
KRAFT = "D. Kraft: A software package for sequential quadratic programming. DFVLR-FB 88-28 (1988)."


class Tuning(Asked):
    """Gains with the largest margin on a few samples, validated on fresh ones."""

    gains: dict[str, Pair] = Field(
        min_length=1, description="Parameter of the loop -> [low, high], where it is searched."
    )
    budget: Size = Field(300.0, gt=0, description="Runs of the search; 1 + 0.7 k with k gains.")
    starts: Whole = Field(3, ge=1, description="How many searches are begun, at most.")
    samples: Whole = Field(
        4, ge=0, description="Draws of the space that gains are found on; 0: the nominal values."
    )
    lower: str = Field(
        "", description="A metric to be lowered within the spec; by default margins are raised."
    )
    runs: Whole = Field(300, ge=1, description="Fresh draws, each run before and after.")
    confidence: Confidence = 0.99
    limit: Confidence | None = Field(
        None, description="Claim: after it a violation has at most this probability."
    )
    claimed: ClassVar[str] = "with these gains a violation has at most probability {limit:g}"


def _experiment(asked: Tuning, setup: Setup) -> Experiment:
    """Return what the rows are run with: the study's, with the gains as quantities."""
    base = setup.experiment
    for name in asked.gains:
        if name in base.space.names:
            raise ParameterError(f"'{name}' is tuned: leave it out of [space]")
    gains = tuple(Uncertain(name=name, bounds=bounds) for name, bounds in asked.gains.items())
    return replace(base, space=replace(base.space, quantities=(*base.space.quantities, *gains)))


def _check(asked: Tuning, setup: Setup) -> None:
    """Refuse unknown gains and metrics, and starts outside of bounds."""
    experiment = _experiment(asked, setup)
    options = {c.name: c.options[c.nominal] for c in experiment.space.choices}
    space = resolved(experiment.space, experiment.build(**options))
    names = [quantity.name for quantity in space.quantities]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ParameterError(f"'{twice}' is tuned: leave it out of [space]")
    if asked.lower:
        _metric(asked, experiment)


def _metric(asked: Tuning, experiment: Experiment) -> Any:
    """Return the metric to be lowered."""
    metrics = {metric.key: metric for metric in experiment.metrics}
    check_known("metric", asked.lower, metrics, "of 'lower'")
    return metrics[asked.lower]


def _runs(asked: Tuning, setup: Setup) -> int:
    search = asked.budget + max(asked.samples, 1) * (2 * len(asked.gains) + 4)
    return int(search) + 2 * asked.runs


def _run(asked: Tuning, ground: Ground) -> Finding | None:
    """Find gains, then run fresh rows with those of before and after."""
    prepared = prepare(_experiment(asked, ground))
    tuned = _tuned(asked, ground, prepared)
    space = prepared.experiment.space
    design = independent(ground.prepared.experiment.space, asked.runs, ground.seed)
    drawn = design.table.rename(
        columns=dict(zip(design.space.names, _varied_names(space, asked), strict=True))
    )
    both = [drawn.assign(**dict(zip(tuned.names, values, strict=True)))
            for values in (tuned.start, tuned.values)]  # fmt: skip
    rows = pd.concat(both, ignore_index=True).filter(space.names)
    done = ground.run_design(from_table(space, rows, entropy=ground.seed), prepared)
    if not done.complete:
        return None
    margins = done.table["spec"].to_numpy(dtype=float)
    before, after = (
        violation_probability(design, part, asked.confidence) for part in np.split(margins, 2)
    )
    verdict = {} if asked.limit is None else vars(bound_verdict(after, asked.limit))
    ends = {"before": tuned.before, "after": tuned.after}  # margins and cost on the samples
    return finding_of(
        asked,
        _sentence(asked, tuned, before, after),
        **verdict,
        runs=tuned.plain_runs + tuned.differentiated_runs + len(rows),
        numbers=_numbers(tuned, before, after),
        tables={
            "gains": tuned.to_pandas(),
            "requirements": pd.DataFrame(ends).rename_axis("number"),
            "tried": tuned.history,
            "fresh": pd.DataFrame(np.split(margins, 2), index=["before", "after"]).T,
            "signals": _signals(prepared, tuned),
        },
    )


def _varied_names(space: Space, asked: Tuning) -> list[str]:
    """Return the names of what the study varies itself, as in the space with the gains."""
    quantities = [q.name for q in space.quantities]
    return [*quantities[: -len(asked.gains)], *(c.name for c in space.choices)]


def _tuned(asked: Tuning, ground: Ground, prepared: Prepared) -> Tuned:
    """Find gains on a few samples; integers are nominal in these."""
    experiment, size = prepared.experiment, len(asked.gains)
    varied, gains = experiment.space.quantities[:-size], experiment.space.quantities[-size:]
    samples = {q.name: [q.nominal] for q in varied}
    if asked.samples and varied:
        other = int(np.random.SeedSequence(ground.seed, spawn_key=(1,)).generate_state(1)[0])
        table = independent(Space(quantities=varied), asked.samples, other).table
        samples = {q.name: [q.nominal] * asked.samples if q.is_integer else table[q.name]
                   for q in varied}  # fmt: skip
    tuned = tune(
        prepared.nominal_loop, {q.name: (q.nominal, *q.box) for q in gains}, experiment.spec,
        asked.budget, experiment.timepts, experiment.inputs, samples=samples,
        cost=_metric(asked, experiment) if asked.lower else None, starts=asked.starts,
        seed=ground.seed, rtol=experiment.rtol, atol=experiment.atol,
        max_steps=experiment.max_steps,
    )  # fmt: skip
    if tuned.message == "interrupted":
        raise KeyboardInterrupt
    return tuned


def _sentence(asked: Tuning, tuned: Tuned, before: Violation, after: Violation) -> str:
    """Say what was found, with what, and how it does on fresh rows."""
    where = counted(asked.samples, "sample") if asked.samples else "the nominal values"
    gains = ", ".join(
        f"{name} = {new:.4g} (was {old:.4g})"
        for name, new, old in zip(tuned.names, tuned.values, tuned.start, strict=True)
    )
    numbers = "; ".join(
        f"the {_what(tuned, key)} is {_size(tuned.before[key])} before and "
        f"{_size(tuned.after[key])} after"
        for key in tuned.after
    )
    runs = (
        f"{counted(tuned.differentiated_runs, 'run')} with derivatives and {tuned.plain_runs} "
        f"without, counted as {tuned.counted_runs:.0f}"
    )
    notes = "".join(f" {note[0].upper()}{note[1:]}." for note in tuned.notes)
    return (
        f"Found on {where}: {gains}. There {numbers} ({runs}; {tuned.message}).{notes} On fresh "
        f"rows {before.violations} of {before.runs} violate the spec with the gains as they were; "
        f"with those that were found {after}"
    )


def _size(margin: float) -> str:
    text = margin_text(margin)
    return "that of a run that did not end" if text == DID_NOT_END else text


def _what(tuned: Tuned, key: str) -> str:
    return f"mean {key}" if key == tuned.cost else f"least margin of '{key}'"


def _numbers(tuned: Tuned, before: Violation, after: Violation) -> dict[str, Any]:
    goal = tuned.cost or "margin"
    ends = (tuned.margin_before, tuned.margin)
    if tuned.cost:
        ends = (tuned.before[tuned.cost], tuned.after[tuned.cost])
    return {
        "gains": dict(zip(tuned.names, map(float, tuned.values), strict=True)),
        "goal": goal,
        "before": float(ends[0]),
        "after": float(ends[1]),
        "counted_runs": tuned.counted_runs,
        "plain_runs": tuned.plain_runs,
        "differentiated_runs": tuned.differentiated_runs,
        "message": tuned.message,
        "notes": list(tuned.notes),
        "fresh_before": before.plain(),
        "fresh_after": after.plain(),
    }


def _signals(prepared: Prepared, tuned: Tuned) -> pd.DataFrame:
    """Return what the spec reads over time, at nominal values, before and after."""
    experiment, space = prepared.experiment, prepared.experiment.space
    ends = np.stack([tuned.start, tuned.values], axis=1)
    gains = dict(zip(tuned.names, ends, strict=True))
    rows = pd.DataFrame([nominal(space)] * 2).assign(**gains)
    names = list(dict.fromkeys(s for r in experiment.spec.requirements for s in r.signals))
    signals, _ = signals_of_rows(prepared, rows, names)
    columns = {"time": experiment.timepts}
    for name in names:
        columns |= {f"{name}, before": signals[name][0], f"{name}, after": signals[name][1]}
    return pd.DataFrame(columns)


def _measured(finding: Finding, asked: Tuning) -> dict[str, str]:
    fresh = finding.numbers["fresh_after"]
    high = fresh["singly"][1]
    return {
        "measured": f"{fresh['violations']} of {counted(fresh['runs'], 'fresh run')}; at most "
        f"{rounded_up(high)} with confidence {100 * fresh['confidence']:g} %",
        "limit": f"≤ {asked.limit:g}",
        "margin": f"{asked.limit - high:.3g}",
    }


def _items(finding: Finding, result: Result, asked: Tuning, key: str) -> Iterator[Item]:
    """Yield before and after, which gain contributes what, and how it was found."""
    n, tables = finding.numbers, finding.tables
    is_cost = n["goal"] != "margin"
    what = f"mean {n['goal']}" if is_cost else "least margin"
    gains = tables["gains"]
    columns = {"before": "before", "after": "after", "low": "from", "high": "to"}
    columns |= {"alone": f"{what} with it alone", "put_back": f"{what} with all but it"}
    yield result_table(gains, "The gains, and what each contributes.", columns)
    lines = "\n".join(f'"{name}" = {value!r}' for name, value in n["gains"].items())
    yield Paragraph(text="The gains that were found:", code=lines)
    signals = tables["signals"]
    names = list(dict.fromkeys(c.rpartition(", ")[0] for c in signals.columns if c != "time"))
    before, after = (
        {s: signals[f"{s}, {w}"].to_numpy() for s in names} for w in ("before", "after")
    )
    time = signals["time"].to_numpy()
    drawn = figures.overlaid((time, before), (time, after))
    yield captioned(f"{key}-signals", _BOTH, _largest_of(before, after), drawn)
    yield captioned(
        f"{key}-bought",
        _BOUGHT,
        f"With it alone: {column_in_words(gains['alone'])}.",
        figures.bought(gains, n["before"], n["after"], what),
    )
    fresh = tables["fresh"]
    margins = fresh["before"].to_numpy(), fresh["after"].to_numpy()
    of_both = figures.margins_of_both(*margins)  # which refuses a table without rows
    yield captioned(
        f"{key}-fresh",
        _FRESH + text.clipped(np.concatenate(margins)),
        f"Median before {np.median(margins[0]):.4g}, after {np.median(margins[1]):.4g}.",
        of_both,
    )
    ends = {c: column.map(margin_text) for c, column in tables["requirements"].items()}
    yield result_table(pd.DataFrame(ends), _SAMPLES, {"before": "before", "after": "after"})
    yield captioned(
        f"{key}-tried",
        _TRIED + text.clipped(tables["tried"]["margin"]),
        f"Runs as counted: {n['counted_runs']:.0f}.",
        figures.tried(tables["tried"], is_cost),
    )


def _largest_of(before: Mapping[str, np.ndarray], after: Mapping[str, np.ndarray]) -> str:
    extremes = (
        f"Largest magnitude of {name}: {np.abs(before[name]).max():.4g} before, "
        f"{np.abs(after[name]).max():.4g} after."
        for name in before
    )
    return " ".join(extremes)


GAIN_TUNING = Kind(
    name="tuning",
    schema=Tuning,
    run=_run,
    title="Tuning of gains",
    answers="gains with the largest margins on a few samples, validated on fresh ones",
    claims="on fresh rows a violation has at most probability `limit`",
    method=(
        "Gains were found with the derivatives of runs: linear programs for the least margin "
        "(Madsen 1975), or sequential quadratic programming for a metric (Kraft 1988), from "
        "several starts. They are the best of what was tried on these samples. Fresh draws, which "
        "no search has seen, were then run with the gains of before and after; the bounds are "
        "exact for independent draws (Clopper and Pearson 1934) and no proof."
    ),
    sources=(MADSEN, KRAFT, CLOPPER),
    check=_check,
    runs=_runs,
    ends_early=True,
    largest=lambda asked, quantities: max(2 * asked.runs, int(asked.budget), asked.samples),
    experiment=_experiment,
    measured=_measured,
    items=_items,
)
