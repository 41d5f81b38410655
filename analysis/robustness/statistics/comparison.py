"""Controllers compared on the same samples: who is better, by how much, and is it chance?"""

from collections.abc import Mapping
from typing import get_args

import numpy as np
import pandas as pd
from scipy import stats

from nlctl.annotations import as_annotated
from nlctl.arguments import fraction, of_type, one_of
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.names import check_known
from nlctl.wording import counted, some_of

from ..stl.spec import violates
from ..uncertainty.design import Design
from ..uncertainty.space import Choice
from .guarantee import clopper_pearson
from .paired import Better, differences, mcnemar, wins

_Columns = dict[str, np.ndarray]


@described_record(eq=False, made_by="compare")
class Comparison:
    """What a comparison found."""

    choice: str  # What was compared, ``"controller"``.
    size: int  # Number of samples, each of which was run with every option.
    confidence: float  # Of each interval by itself.
    # One row per option, best first: by violations, then by the mean rank in the first metric.
    # violations; rate with its exact interval rate_low, rate_high; failed, the runs that did not
    # reach their end, which are violations as well; and for each metric its median over the other
    # runs, ``median <metric>``, and the mean of its rank among the options, 1 being best, over all
    # samples, ``rank <metric>``.
    ranking: pd.DataFrame
    violations: pd.DataFrame  # McNemar's test for every pair, see `paired.mcnemar`.
    # By metric and pair, see `paired.differences`; p_holm is adjusted for the pairs of a metric.
    differences: pd.DataFrame
    # By metric and winner: in how many samples it beats each other option, see `paired.wins`.
    wins: pd.DataFrame

    def __str__(self) -> str:
        first = self.ranking.to_string(float_format=lambda x: f"{x:.4g}")
        return (
            f"{len(self.ranking)} options of {self.choice} on the same "
            f"{counted(self.size, 'sample')} "
            f"(intervals at {100 * self.confidence:g} %, each by itself)\n{first}"
        )


@as_annotated
def crossed(design: Design, choice: Choice) -> pd.DataFrame:
    """Return every row of a design once with each option of a choice.

    Row i of the design becomes rows i k to i k + k - 1, where k is the number of options: equal
    numbers, and a table that was cut off holds whole samples but for one.

    Parameters
    ----------
    design : Design
        Its space may hold the choice already; the labels that were drawn are then replaced.
    choice : Choice
        The options that are compared.

    Returns
    -------
    pandas.DataFrame
        For `experiment.evaluate`, or as `design.from_table` of a space with the choice.

    Raises
    ------
    ParameterError
        If `choice` is not a `Choice`.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Choice, Space, Uncertain, crossed, grid
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> law = Choice(name="law", options={"one": nlctl.Gain(k=1.0), "two": nlctl.Gain(k=2.0)})
    >>> crossed(grid(space, 2), law).values.tolist()
    [[0.0, 'one'], [0.0, 'two'], [1.0, 'one'], [1.0, 'two']]
    """
    of_type("a comparison", "choice", choice, Choice)
    labels = list(choice.options)
    drawn = design.table.drop(columns=choice.name, errors="ignore")
    table = drawn.loc[drawn.index.repeat(len(labels))].reset_index(drop=True)
    return table.rename_axis("row").assign(**{choice.name: labels * design.size})


@as_annotated
def compare(
    design: Design,
    choice: Choice,
    table: pd.DataFrame,
    metrics: Mapping[str, Better],
    *,
    spec: str = "spec",
    confidence: float = 0.95,
) -> Comparison:
    """Compare the options of a choice on the same samples.

    A run that did not reach its end violates the spec, and loses in every metric against one that
    did; its metrics are NaN and enter no median and no mean.

    Parameters
    ----------
    design : Design
        Independent draws of what is uncertain.
    choice : Choice
        Two options or more.
    table : pandas.DataFrame
        What `experiment.evaluate` made of ``crossed(design, choice)``, in any order.
    metrics : mapping
        ``{column: "smaller" or "larger"}``, whichever is better; the first one counts in the
        ranking.
    spec : str, optional
        Column of the margin that decides about violations.
    confidence : float, optional
        Of each interval by itself, between 0 and 1.

    Returns
    -------
    Comparison
        Ranking, violations, paired differences and wins, with their intervals.

    Raises
    ------
    UnknownNameError
        If the table lacks a column.
    ParameterError
        If a sample was not run with every option, a row has other numbers than the design, or
        there is no metric, or only one option.
    NoGuaranteeError
        If the design's rows are no independent draws.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Choice, Space, Uncertain
    >>> from nlctl.analysis.robustness import compare, crossed, independent
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> design = independent(space, 5, entropy=1)
    >>> law = Choice(name="law", options={"one": nlctl.Gain(k=1.0), "two": nlctl.Gain(k=2.0)})
    >>> table = crossed(design, law)
    >>> late_rms = table["law"].map({"one": 0.2, "two": 0.1})
    >>> table = table.assign(spec=1.0, status="OK", late_rms=late_rms)
    >>> found = compare(design, law, table, {"late_rms": "smaller"})
    >>> print(found.ranking.index.tolist(), found.ranking["median late_rms"].tolist())
    ['two', 'one'] [0.1, 0.2]
    """
    of_type("a comparison", "design", design, Design)
    of_type("a comparison", "choice", choice, Choice)
    of_type("a comparison", "table", table, pd.DataFrame)
    of_type("a comparison", "metrics", metrics, Mapping, '{column: "smaller" or "larger"}')
    for metric, better in metrics.items():
        one_of("a comparison", f"metrics['{metric}']", better, get_args(Better))
    fraction("a comparison", "confidence", confidence)
    if not metrics:
        raise ParameterError("a comparison needs at least one metric, got none")
    paired = _paired(design, choice, table, (spec, "status", *metrics))
    violations = mcnemar(design, paired[spec])
    by_metric = {m: differences(design, paired[m], confidence, metrics[m]) for m in metrics}
    won = {m: wins(design, paired[m], metrics[m]) for m in metrics}
    return Comparison(
        choice=choice.name,
        size=design.size,
        confidence=confidence,
        ranking=_ranking(paired, spec, metrics, confidence),
        violations=violations,
        differences=pd.concat(by_metric, names=["metric"]),
        wins=pd.concat(won, names=["metric"]),
    )


def _paired(
    design: Design, choice: Choice, table: pd.DataFrame, columns: tuple[str, ...]
) -> dict[str, _Columns]:
    """Return each column by option, in the order of the samples."""
    crossed_rows = crossed(design, choice)
    for name in (*crossed_rows.columns, *columns):
        check_known("column", name, table.columns, "of the table of results")
    _check_rows(crossed_rows, table, choice.name)
    ordered, k = table.loc[crossed_rows.index], len(choice.options)
    return {
        name: {label: ordered[name].to_numpy()[i::k] for i, label in enumerate(choice.options)}
        for name in columns
    }


def _check_rows(expected: pd.DataFrame, table: pd.DataFrame, choice: str) -> None:
    """Every sample with every option, once, with the numbers of the design."""
    if not table.index.is_unique:
        twice = table.index[table.index.duplicated()][0]
        raise ParameterError(f"a comparison needs each row once, row {twice} comes twice")
    missing = expected.index.difference(table.index)
    beyond = table.index.difference(expected.index)
    if len(missing):
        label = expected.loc[missing[0], choice]
        raise ParameterError(
            f"a comparison needs every sample with every {choice}: "
            f"{some_of(len(missing), len(expected), 'row', 'is', 'are')} missing, the first is row "
            f"{missing[0]} ('{label}')"
        )
    if len(beyond):
        raise ParameterError(
            f"a comparison needs the rows of its design alone, 0 to {len(expected) - 1}, got row "
            f"{beyond[0]}"
        )
    for name in expected.columns:
        differ = expected.index[expected[name] != table.loc[expected.index, name]]
        if len(differ):
            row = differ[0]
            raise ParameterError(
                f"row {row} has {name} = {table.loc[row, name]}, the design has "
                f"{expected.loc[row, name]}: the table belongs to another design"
            )


def _ranking(
    paired: Mapping[str, _Columns], spec: str, metrics: Mapping[str, Better], confidence: float
) -> pd.DataFrame:
    rows = {}
    for label, margins in paired[spec].items():
        count, size = int(np.sum(violates(margins))), margins.size
        low, high = clopper_pearson(count, size, confidence, "both")
        rows[label] = {
            "violations": count,
            "rate": count / size,
            "rate_low": low,
            "rate_high": high,
            "failed": int(np.sum(paired["status"][label] != "OK")),
        }
    ranking = pd.DataFrame.from_dict(rows, orient="index").rename_axis("option")
    for metric, better in metrics.items():
        values = np.column_stack(list(paired[metric].values()))
        signed = values if better == "smaller" else -values
        ranks = stats.rankdata(np.where(np.isnan(signed), np.inf, signed), axis=1)
        ranking[f"median {metric}"] = pd.DataFrame(values).median().to_numpy()
        ranking[f"rank {metric}"] = ranks.mean(axis=0)
    return ranking.sort_values(["violations", f"rank {next(iter(metrics))}"], kind="stable")
