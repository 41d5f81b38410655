"""Options of one keyword of the loop, compared on the same samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import control as ct

from analysis.robustness import (
    Choice,
    Experiment,
    Space,
    Spec,
    diagrams,
    from_table,
    independent,
    prepare,
)
from analysis.robustness.statistics.comparison import Comparison, compare, crossed
from analysis.robustness.statistics.verdict import better_verdict
from nlctl.errors import ParameterError
from nlctl.names import unknown

from ..build import choice, inputs_of, metrics_of
from ..file.resolve import option
from ..file.schema import Choices, Study
from ..result import Finding
from .analyses import Compare
from .context import Ground, made

__all__ = ["alternatives", "compared", "comparison", "widened"]


def alternatives(asked: Compare, build: Callable[..., Any], folder: Path) -> Choice:
    """Return what is compared, as a choice.

    Raises
    ------
    UsageError
        If an option is refused, or a label does not exist.
    """
    if "function" in asked.options:
        options = option(asked.options, folder)
        if not isinstance(options, dict):
            raise ParameterError(
                f"options from a function need one that returns them by label, "
                f"{asked.options['function']} returns {type(options).__name__}"
            )
        every = Choice(name=asked.keyword, options=options)
    else:
        choices = Choices.model_validate({"options": asked.options})
        every = choice(asked.keyword, choices, build, folder)
    labels = asked.only or tuple(every.options)
    for named, known in ((labels, every.options), (asked.better or (), labels)):
        for label in named:
            if label not in known:
                raise unknown("option", label, known)
    return Choice(name=asked.keyword, options={label: every.options[label] for label in labels})


def widened(
    experiment: Experiment, asked: Compare, options: Choice, study: Study, folder: Path
) -> Experiment:
    """Return the experiment with the options in its space, and the requirements that count.

    Metrics of signals that only some options have are left out.

    Raises
    ------
    UsageError
        If the loop has no such keyword, or a quantity, a requirement or its signal does not exist
        with every option.
    """
    space = _with_options(experiment, options)
    built = diagrams(space, experiment.build)
    inputs_of(study, [diagram for _, diagram in built])
    signals = frozenset.intersection(*(frozenset(d.output_labels) for _, d in built))
    counting = {r.key: r for r in experiment.spec.requirements}
    for key in asked.requirements:
        if key not in counting:
            raise unknown("requirement", key, counting)
    spec = Spec(requirements=tuple(counting[key] for key in asked.requirements or counting))
    for requirement in spec.requirements:
        lacking = [signal for signal in requirement.signals if signal not in signals]
        if lacking:
            raise ParameterError(
                f"requirement '{requirement.key}' looks at '{lacking[0]}', which not every option "
                "has: name those that count with requirements = [...]"
            )
    metrics = metrics_of(study, folder, signals)
    return replace(experiment, space=space, spec=spec, metrics=metrics)


def _with_options(experiment: Experiment, options: Choice) -> Space:
    """Return the space with a choice more, which takes the place of one of its name."""
    others = tuple(c for c in experiment.space.choices if c.name != options.name)
    return Space(quantities=experiment.space.quantities, choices=(*others, options))


def compared(
    experiment: Experiment, asked: Compare, folder: Path
) -> list[tuple[Mapping[str, str], ct.InputOutputSystem]]:
    """Return the diagrams of a comparison, each with its labels.

    Raises
    ------
    UsageError
        As in `alternatives` and `analysis.robustness.diagrams`.
    """
    options = alternatives(asked, experiment.build, folder)
    return diagrams(_with_options(experiment, options), experiment.build)


def comparison(asked: Compare, ground: Ground) -> Finding | None:
    """Run every sample with every option; None if rows are missing."""
    own = ground.prepared.experiment
    options = alternatives(asked, own.build, ground.folder)
    experiment = widened(own, asked, options, ground.study, ground.folder)
    prepared = prepare(experiment)
    space = prepared.experiment.space
    others = tuple(c for c in space.choices if c.name != options.name)
    design = independent(replace(space, choices=others), asked.runs, ground.seed)
    rows = from_table(space, crossed(design, options), entropy=ground.seed)
    done = ground.run_design(rows, prepared)
    if not done.complete:
        return None
    table = done.table.astype({c.name: str for c in space.choices})
    found = compare(design, options, table, asked.metrics, confidence=asked.confidence)
    return made(
        asked,
        _sentence(asked, found),
        **_claimed(asked, found),
        runs=len(table),
        numbers={"keyword": asked.keyword, "samples": found.size, "confidence": found.confidence}
        | {"requirements": [r.key for r in experiment.spec.requirements]},
        tables={
            "ranking": found.ranking,
            "violations": found.violations,
            "differences": found.differences,
            "wins": found.wins,
        },
    )


def _sentence(asked: Compare, found: Comparison) -> str:
    metric = next(iter(asked.metrics))
    told = "; ".join(
        f"{label}: {row['violations']:.0f} violations, median {metric} "
        f"{row[f'median {metric}']:.4g}"
        for label, row in found.ranking.to_dict("index").items()
    )
    spec = f" (requirements {', '.join(asked.requirements)})" if asked.requirements else ""
    return (
        f"{asked.keyword.capitalize()} on the same {found.size} samples{spec}, best first: {told}."
    )


def _claimed(asked: Compare, found: Comparison) -> dict[str, str]:
    """Return the claim that one option is better than another, and the answer."""
    if asked.better is None:
        return {}
    metric, (a, b), level = next(iter(asked.metrics)), asked.better, 1 - asked.confidence
    pairs = found.differences.loc[metric]
    row = pairs.loc[(a, b) if (a, b) in pairs.index else (b, a)]
    p, adjusted = float(row["p"]), float(row["p_holm"])
    won, lost = (int(found.wins.loc[(metric, x), y]) for x, y in ((a, b), (b, a)))  # type: ignore[arg-type]
    verdict = better_verdict(won, lost, adjusted, level, adjusted / p)
    claim = f"{a} is better than {b} in {metric}, at the level {level:.2g}"
    return {"claim": claim, **vars(verdict)}
