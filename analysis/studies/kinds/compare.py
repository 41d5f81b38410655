"""Options of one keyword of the loop, compared on the same samples."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from nlctl.errors import ParameterError
from nlctl.names import check_known
from nlctl.wording import counted

from ... import figures as figures
from ...figures.labels import plain
from ...report.document import Figure, Item, captioned
from ...robustness import (
    Choice,
    Experiment,
    Spec,
    diagrams,
    from_table,
    independent,
    prepare,
)
from ...robustness.statistics.comparison import Comparison, compare, crossed
from ...robustness.statistics.paired import TRUSTED_ROWS
from ...robustness.statistics.sequential import better_verdict
from .. import page as text
from ..build import choice, inputs_of, metrics_of
from ..file.schema import Asked, Choices, Confidence, Names, Whole
from ..kind import Ground, Kind, Setup, finding_of
from ..page import column_in_words, result_table
from ..resolve import option
from ..result import Finding, Result
from .context import CLOPPER, HOLM

MOST_PAIRS = 30  # rows of a table of pairs; of more, only those with the first option are shown
RANKING = (
    "Options on the same samples, best first: by violations, then by the mean rank in the first "
    "metric. Did not end: such runs violate the spec, lose in every metric, and are not in the "
    "medians."
)
RATES = "Share of violations, with exact intervals, confidence {confidence:g} % each."
MCNEMAR = (
    "McNemar's test by pair: runs in which only one of the two violates the spec. Holm: p adjusted "
    "for the number of pairs."
)
_DIFFERENCES = (
    "Paired differences a − b with intervals, confidence {confidence:g} % each: of the median, "
    "exact whatever the law, and of the mean, by bootstrap, which is approximate (NaN where a run "
    "did not end). Mean trusted: no, where the rows are fewer than {rows}, or skew, or one of them "
    "weighs a tenth: the interval of the mean then may have far less than its confidence, and that "
    "of the median is the one to read. What happens in fewer than about 3 of {size} runs is in no "
    "interval of a mean. p: sign test; Holm: adjusted for the pairs of a metric."
)
FIRST = " Shown are the pairs with {first}; {file} in the run's folder has all."
MEDIANS = (
    "Median of {first} minus the option named at the left, in {metric}, on the same samples; "
    "lines: exact intervals. Right of 0 {first} has the larger value."
)
INFINITE = " Arrows: infinite, because one of the two did not reach its end."
WINS = "In how many samples the option of the line beats that of the column; ties count for none."
MCNEMAR_1947 = (
    "Q. McNemar: Note on the sampling error of the difference between correlated proportions or "
    "percentages. Psychometrika 12 (1947) 153–157. doi 10.1007/BF02295996."
)
EFRON = (
    "B. Efron: Better bootstrap confidence intervals. J. Amer. Statist. Assoc. 82 (1987) 171–185. "
    "doi 10.1080/01621459.1987.10478410."
)


class Compare(Asked):
    """Options of one keyword of the loop on the same samples."""

    keyword: str = Field(description="Keyword of the loop, such as 'controller'.")
    options: dict[str, Any] = Field(
        min_length=1,
        description="Label -> option, as in choices; or { function = ... } that returns these.",
    )
    only: Names = Field((), description="Labels that are compared; all by default.")
    requirements: Names = Field(
        (), description="Requirements that count, whose signals all options have; all by default."
    )
    runs: Whole = Field(ge=2, description="Samples, each of which is run with every option.")
    metrics: dict[str, Literal["smaller", "larger"]] = Field(
        min_length=1, description="Metric -> which is better; the first one ranks."
    )
    confidence: Confidence = 0.95
    better: tuple[str, str] | None = Field(
        None,
        description="Claim: the first label is better than the second in the first metric, by the "
        "sign test over all pairs.",
    )

    @property
    def claim(self) -> str:
        if self.better is None:
            return ""
        a, b = self.better
        level = f"at the level {1 - self.confidence:.2g}"
        return f"{a} is better than {b} in {next(iter(self.metrics))}, {level}"


def _options(asked: Compare, setup: Setup) -> Choice:
    """Return what is compared, as a choice."""
    build, folder = setup.experiment.build, setup.folder
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
    for named, labels_of in ((labels, every.options), (asked.better or (), labels)):
        for label in named:
            check_known("option", label, labels_of)
    return Choice(name=asked.keyword, options={label: every.options[label] for label in labels})


def _widened(asked: Compare, setup: Setup, options: Choice) -> Experiment:
    """Return the experiment with the options in its space, and the requirements that count."""
    # The options take the place of a choice of the same name.
    # Metrics of signals that only some options have are left out.
    study, experiment = setup.study, setup.experiment
    others = tuple(c for c in experiment.space.choices if c.name != options.name)
    space = replace(experiment.space, choices=(*others, options))
    built = diagrams(space, experiment.build)
    inputs_of(study, [diagram for _, diagram in built])
    signals = frozenset.intersection(*(frozenset(d.output_labels) for _, d in built))
    counting = {r.key: r for r in experiment.spec.requirements}
    for key in asked.requirements:
        check_known("requirement", key, counting)
    spec = Spec(requirements=tuple(counting[key] for key in asked.requirements or counting))
    for requirement in spec.requirements:
        lacking = [signal for signal in requirement.signals if signal not in signals]
        if lacking:
            raise ParameterError(
                f"requirement '{requirement.key}' reads '{lacking[0]}', which not every option "
                "has: name those that count with requirements = [...]"
            )
    metrics = metrics_of(study, setup.folder, signals)
    return replace(experiment, space=space, spec=spec, metrics=metrics)


def _experiment(asked: Compare, setup: Setup) -> Experiment:
    """Return what the rows of a comparison are run with."""
    return _widened(asked, setup, _options(asked, setup))


def _check(asked: Compare, setup: Setup) -> None:
    """Refuse metrics that not all options have."""
    columns = [metric.key for metric in _experiment(asked, setup).metrics]
    for metric in asked.metrics:
        check_known("metric", metric, columns, "of all options")


def _run(asked: Compare, ground: Ground) -> Finding | None:
    """Run every sample with every option; None if rows are missing."""
    options = _options(asked, ground)
    experiment = _widened(asked, ground, options)
    prepared = prepare(experiment)
    space = prepared.experiment.space
    others = tuple(c for c in space.choices if c.name != options.name)
    design = independent(replace(space, choices=others), asked.runs, ground.seed)
    rows = from_table(space, crossed(design, options), entropy=ground.seed)
    done = ground.run_design(rows, prepared)
    if not done.complete:
        return None
    table = done.table.astype({c.name: str for c in space.choices})
    comparison = compare(design, options, table, asked.metrics, confidence=asked.confidence)
    return finding_of(
        asked,
        _sentence(asked, comparison),
        **_answer(asked, comparison),
        runs=len(table),
        numbers={
            "keyword": asked.keyword,
            "samples": comparison.size,
            "confidence": comparison.confidence,
        }
        | {"requirements": [r.key for r in experiment.spec.requirements]},
        tables={
            "ranking": comparison.ranking,
            "violations": comparison.violations,
            "differences": comparison.differences,
            "wins": comparison.wins,
        },
    )


def _middle(metric: str, row: Mapping[str, Any]) -> str:
    middle = row[f"median {metric}"]
    return f"median {metric} {middle:.4g}" if middle == middle else f"no run with {metric}"


def _sentence(asked: Compare, comparison: Comparison) -> str:
    metric = next(iter(asked.metrics))
    outcomes = "; ".join(
        f"{label}: {counted(int(row['violations']), 'violation')}, {_middle(metric, row)}"
        for label, row in comparison.ranking.to_dict("index").items()
    )
    spec = f" (requirements {', '.join(asked.requirements)})" if asked.requirements else ""
    return (
        f"{asked.keyword.capitalize()} on the same {counted(comparison.size, 'sample')}{spec}, "
        f"best first: {outcomes}."
    )


def _answer(asked: Compare, comparison: Comparison) -> dict[str, str]:
    """Return the answer to the claim that one option is better than another."""
    if asked.better is None:
        return {}
    metric, (a, b), level = next(iter(asked.metrics)), asked.better, 1 - asked.confidence
    pairs = comparison.differences.loc[metric]
    row = pairs.loc[(a, b) if (a, b) in pairs.index else (b, a)]
    p, adjusted = float(row["p"]), float(row["p_holm"])
    won, lost = (int(comparison.wins.loc[(metric, x), y]) for x, y in ((a, b), (b, a)))  # type: ignore[arg-type]
    return vars(better_verdict(won, lost, adjusted, level, adjusted / p))


def _measured(finding: Finding, asked: Any) -> dict[str, str]:
    a, b = asked.better
    metric = next(iter(asked.metrics))
    pairs = finding.tables["differences"].loc[metric]
    row, text = (
        (pairs.loc[(a, b)], f"{a} − {b}")
        if (a, b) in pairs.index
        else (pairs.loc[(b, a)], f"{b} − {a}")
    )
    level = 1 - asked.confidence
    return {
        "measured": f"median of {text} in {metric}: {row['median']:.4g}, p = {row['p_holm']:.2g}",
        "limit": f"p ≤ {level:.2g}, {asked.metrics[metric]} is better",
        "margin": f"{level - row['p_holm']:.2g}",
    }


def _items(finding: Finding, result: Result, asked: Compare, key: str) -> Iterator[Item]:
    """Yield rates of violation, paired differences, wins and tests."""
    t, confidence = finding.tables, 100 * finding.numbers["confidence"]
    ranking = t["ranking"]
    caption = RATES.format(confidence=confidence)
    yield captioned(
        f"{key}-rates",
        caption,
        f"{column_in_words(ranking['rate'])}.",
        figures.violation_rates(ranking),
    )
    titles = {"rate": "share", "rate_low": "from", "rate_high": "to", "failed": "did not end"}
    titles = {c: titles.get(c) or c.replace("rank ", "mean rank ", 1) for c in ranking.columns}
    yield result_table(ranking, RANKING, titles)
    yield from _medians(t["differences"], result.metrics["unit"].to_dict(), key)
    words = _DIFFERENCES.format(confidence=confidence, rows=TRUSTED_ROWS, size=asked.runs)
    for name, caption in (("differences", words), ("violations", MCNEMAR)):
        pairs, only = _with_first(t[name], f"{finding.key}/{name}.parquet")
        if "mean_trusted" in pairs:
            pairs = pairs.assign(mean_trusted=np.where(pairs["mean_trusted"], "yes", "no"))
        columns = {c: c.replace("_", " ") for c in pairs.columns} | {"p_holm": "p (Holm)"}
        yield result_table(pairs, caption + only, columns)
    yield result_table(t["wins"], WINS, {c: c for c in t["wins"].columns})


def _with_first(pairs: pd.DataFrame, file: str) -> tuple[pd.DataFrame, str]:
    """Return a table of pairs, of many only those with the first option, and what says so."""
    first = pairs.index.get_level_values("a")[0]
    if len(pairs) <= MOST_PAIRS:
        return pairs, ""
    return pairs.xs(first, level="a", drop_level=False), FIRST.format(first=first, file=file)


def _medians(differences: pd.DataFrame, units: Mapping[Any, str], key: str) -> Iterator[Figure]:
    """Yield the differences between the first option and each other one, by metric."""
    for number, (metric, pairs) in enumerate(differences.groupby(level="metric", sort=False), 1):
        first = pairs.index.get_level_values("a")[0]
        with_first = pairs.loc[pairs.index.get_level_values("a") == first]
        others = with_first.index.get_level_values("b")
        caption = MEDIANS.format(first=first, metric=metric)
        caption += INFINITE * bool(np.any(np.isinf(with_first["median"])))
        words = "; ".join(
            f"{other}: {middle:.4g}"
            for other, middle in zip(others, with_first["median"], strict=True)
        )
        yield captioned(
            f"{key}-medians-{number}",
            caption,
            f"{words}.",
            figures.paired_differences(with_first, list(others), _axis(metric, units)),
        )


def _axis(metric: object, units: Mapping[Any, str]) -> str:
    unit = text.unit_text(units.get(metric, "1"))  # requirements are margins
    return f"median difference in {plain(metric)} ({unit})"


COMPARE = Kind(
    name="compare",
    schema=Compare,
    run=_run,
    title="Comparison on the same samples",
    answers="options of one keyword on the same samples, paired",
    claims="the first of `better` is better than the second",
    method=(
        "Controllers are compared on the same samples: violations by McNemar's test, exact (1947), "
        "medians of paired differences by exact intervals and the sign test, means by bootstrap "
        "(Efron 1987), which is approximate and marked where it is not to be trusted; p-values are "
        "adjusted for the number of pairs (Holm 1979)."
    ),
    sources=(MCNEMAR_1947, EFRON, HOLM, CLOPPER),
    keywords=("keyword",),
    check=_check,
    runs=lambda asked, setup: asked.runs * len(_options(asked, setup).options),
    largest=lambda asked, quantities: asked.runs * len(asked.options),
    experiment=_experiment,
    measured=_measured,
    items=_items,
)
