"""The report's sections that rank: sensitivity of the spec to quantities, and controllers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ... import figures as figures
from ...figures.labels import plain
from ...report.document import Figure, Item, Table
from . import text as text

if TYPE_CHECKING:
    from analysis.studies.result import Finding, Result

__all__ = ["compare", "morris", "regional", "sobol"]

MOST_PAIRS = 30  # rows of a table of pairs; of more, only those with the first option are shown


def morris(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield the elementary effects."""
    table = finding.tables["effects"]
    caption = text.MORRIS.format(of=finding.numbers["of"])
    yield Figure(
        key=f"{key}-effects",
        caption=caption,
        description=f"{caption} μ*: {_told(table['mu_star'])}.",
        figure=figures.screening(table),
    )
    yield _table(
        table.sort_values("mu_star", ascending=False, kind="stable"),
        f"{text.SAME}; μ: mean effect with its sign.",
        {"mu": "μ", "mu_star": "μ*", "low": "from", "high": "to", "sigma": "σ"},
    )


def sobol(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield the shares of the variance."""
    table = finding.tables["indices"]
    caption = text.SOBOL.format(
        of=finding.numbers["of"], confidence=100 * finding.numbers["confidence"]
    )
    yield Figure(
        key=f"{key}-shares",
        caption=caption,
        description=f"{caption} S_T: {_told(table['ST'])}.",
        figure=figures.shares(table),
    )
    columns = {"S1": "S₁", "S1_low": "from", "S1_high": "to"}
    columns |= {"ST": "S_T", "ST_low": "from", "ST_high": "to"}
    ordered = table.sort_values("ST", ascending=False, kind="stable")
    yield _table(ordered, f"{text.SAME}.", columns)


def regional(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield what sets failing rows apart; nothing if all rows pass or all fail."""
    if "differences" not in finding.tables:
        return
    table = finding.tables["differences"]
    yield Figure(
        key=f"{key}-distances",
        caption=text.REGIONAL,
        description=f"{text.REGIONAL} {_told(table['statistic'])}.",
        figure=figures.set_apart(table),
    )
    columns = {"statistic": "distance"}
    if np.isfinite(table["p"].to_numpy()).any():  # rows are independent draws
        columns |= {"p": "p", "p_holm": "p (Holm)"}
    ordered = table.sort_values("statistic", ascending=False, kind="stable")
    yield _table(ordered, f"{text.SAME}.", columns)


def compare(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield rates of violation, paired differences, wins and tests."""
    t, confidence = finding.tables, 100 * finding.numbers["confidence"]
    ranking = t["ranking"]
    caption = text.RATES.format(confidence=confidence)
    yield Figure(
        key=f"{key}-rates",
        caption=caption,
        description=f"{caption} {_told(ranking['rate'])}.",
        figure=figures.violation_rates(ranking),
    )
    titles = {"rate": "share", "rate_low": "from", "rate_high": "to", "failed": "did not end"}
    titles = {c: titles.get(c) or c.replace("rank ", "mean rank ", 1) for c in ranking.columns}
    yield _table(ranking, text.RANKING, titles)
    yield from _medians(t["differences"], result.metrics["unit"].to_dict(), key)
    columns = {c: c.replace("_", " ") for c in t["differences"].columns} | {"p_holm": "p (Holm)"}
    pairs, only = _with_first(t["differences"], f"{finding.key}/differences.parquet")
    yield _table(pairs, text.DIFFERENCES.format(confidence=confidence) + only, columns)
    columns = {c: c.replace("_", " ") for c in t["violations"].columns} | {"p_holm": "p (Holm)"}
    pairs, only = _with_first(t["violations"], f"{finding.key}/violations.parquet")
    yield _table(pairs, text.MCNEMAR + only, columns)
    yield _table(t["wins"], text.WINS, {c: c for c in t["wins"].columns})


def _with_first(pairs: pd.DataFrame, file: str) -> tuple[pd.DataFrame, str]:
    """Return a table of pairs, of many only those with the first option, and what says so."""
    first = pairs.index.get_level_values("a")[0]
    if len(pairs) <= MOST_PAIRS:
        return pairs, ""
    return pairs.xs(first, level="a", drop_level=False), text.FIRST.format(first=first, file=file)


def _medians(differences: pd.DataFrame, units: Mapping[Any, str], key: str) -> Iterator[Figure]:
    """Yield the differences between the first option and each other one, by metric."""
    for number, (metric, pairs) in enumerate(differences.groupby(level="metric", sort=False), 1):
        first = pairs.index.get_level_values("a")[0]
        own = pairs.loc[pairs.index.get_level_values("a") == first]
        others = own.index.get_level_values("b")
        caption = text.MEDIANS.format(first=first, metric=metric)
        caption += text.INFINITE * bool(np.any(np.isinf(own["median"])))
        told = "; ".join(
            f"{other}: {middle:.4g}" for other, middle in zip(others, own["median"], strict=True)
        )
        yield Figure(
            key=f"{key}-medians-{number}",
            caption=caption,
            description=f"{caption} {told}.",
            figure=figures.paired_differences(own, list(others), _axis(metric, units)),
        )


def _told(column: Any) -> str:
    return "; ".join(f"{name}: {value:.4g}" for name, value in column.items())


def _table(table: pd.DataFrame, caption: str, columns: Mapping[str, str]) -> Table:
    """Return a table of results."""
    flat = table.reset_index()
    names = [str(name) for name in flat.columns[: table.index.nlevels]]
    chosen = flat[[*names, *columns]]
    return Table(
        caption=caption,
        columns=(*names, *columns.values()),
        rows=[tuple(map(_cell, row)) for row in chosen.itertuples(index=False, name=None)],
        folded=caption.startswith(text.SAME),
    )


def _axis(metric: Any, units: Mapping[Any, str]) -> str:
    unit = text.unit_text(units.get(metric, "1"))  # requirements are margins
    return f"median difference in {plain(metric)} ({unit})"


def _cell(value: Any) -> Any:
    return f"{value:.4g}" if isinstance(value, float) else value
