"""What kinds of analysis share on a page: words, tables, deviations, running estimates."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from nlctl.native import Status
from nlctl.wording import counted, some_of

from .. import figures as figures
from ..figures import CLIP
from ..report.document import Item, Table, captioned
from ..report.typography import in_print
from ..robustness.statistics.guarantee import rounded_down, rounded_up
from ..robustness.statistics.sequential import sequence_bounds
from ..robustness.stl.spec import FAILED, violates
from .result import Finding, Result

CLIPPED = (
    f" Margins below −{CLIP:g}, and runs that did not reach their end, are drawn at −{CLIP:g}."
)
SAME = "The same in numbers"
ASSUMED = "What is assumed"
WITH_ASSUMPTIONS = f" Assumptions: see “{ASSUMED}”."


DID_NOT_END = "did not end"


_ASSUMED = re.compile(r" Assumed: (?:at each size )?(.*?)\.(?=\s|$)", re.DOTALL)


def without_assumptions(sentence: str) -> str:
    """Return a statement that refers to its assumptions instead of spelling them out."""
    return _ASSUMED.sub(WITH_ASSUMPTIONS, sentence)


def assumptions_in(sentences: Iterable[str]) -> list[str]:
    """Return what statements assume, each assumption once."""
    clauses = (clause for words in sentences for clause in _ASSUMED.findall(words))
    return list(dict.fromkeys(part for assumption in clauses for part in assumption.split("; ")))


def violate(count: int, total: int) -> str:
    """Return how many runs violate the spec."""
    return f"{some_of(count, total, 'run', 'violates', 'violate')} the spec"


def clipped(margins: Iterable[float]) -> str:
    """Return the note of a caption on margins beyond the picture; nothing where there are none."""
    return CLIPPED if np.any(~(np.asarray(list(margins), dtype=float) >= -CLIP)) else ""


def unit_text(unit: object) -> str:
    """Return a unit with its powers raised."""
    return "" if unit is None else in_print(str(unit))


def margin_text(value: float) -> str:
    """Return a margin as text; that of a run that did not reach its end says so."""
    # Where NaN counts as the lowest margin it has become -inf.
    if np.isnan(value) or value == -np.inf:
        return "NaN"
    return f"{value:.4g}" if value > -FAILED else DID_NOT_END


def margin_in_words(value: float) -> str:
    """Return a margin as part of a sentence, or that its run did not reach its end."""
    text = margin_text(value)
    return "the run did not end" if text == DID_NOT_END else f"margin {text}"


def status_text(name: object) -> str:
    """Return how a run ended, in words."""
    return "reached the end" if name == Status.OK.name else str(name).lower().replace("_", " ")


def column_in_words(column: Any) -> str:
    """Return a column of numbers in words, for the description of a figure."""
    return "; ".join(f"{name}: {value:.4g}" for name, value in column.items())


def result_table(table: pd.DataFrame, caption: str, columns: Mapping[str, str]) -> Table:
    """Return a table of results."""
    flat = table.reset_index()
    names = [str(name) for name in flat.columns[: table.index.nlevels]]
    chosen = flat[[*names, *columns]]
    return Table(
        caption=caption,
        columns=(*names, *columns.values()),
        rows=[tuple(map(_cell, row)) for row in chosen.itertuples(index=False, name=None)],
        folded=caption.startswith(SAME),
    )


def _cell(value: object) -> Any:
    return f"{value:.4g}" if isinstance(value, float) else value


def known(quantities: pd.DataFrame, *columns: str) -> Iterable[tuple[Any, ...]]:
    """Return name and columns of every quantity, None where a choice has no such thing."""
    table = quantities.reindex(columns=list(columns)).astype(object)
    table = table.where(table.notna(), None)
    if "unit" in columns:
        table["unit"] = table["unit"].map(unit_text)
    return table.itertuples(name=None)


DEVIATIONS = "How far each quantity lies from nominal: ±1 is the end of its box on that side."
_Row = Mapping[str, Any]


def found_rows(rows: Mapping[str, _Row], quantities: pd.DataFrame, key: str) -> Iterator[Item]:
    """Yield some rows next to the nominal one, and how far their numbers deviate."""
    # What a row leaves out is nominal.
    middle = dict(known(quantities, "nominal"))
    rows = {label: middle | dict(row) for label, row in rows.items()}
    table = deviations_table(rows, quantities)
    yield Table(
        caption="Its values next to the nominal ones; * deviates from nominal.",
        columns=("quantity", "unit", "nominal", *rows),
        rows=[
            (name, unit, middle, *(_marked(row[name], middle) for row in rows.values()))
            for name, unit, middle in known(quantities, "unit", "nominal")
        ],
    )
    if np.any(table.to_numpy() != 0):
        values = "; ".join(
            f"{name}: " + ", ".join(f"{row} {value:.3g}" for row, value in line.items())
            for name, line in table.iterrows()
        )
        yield captioned(f"{key}-deviations", DEVIATIONS, f"{values}.", figures.deviations(table))


def _marked(value: object, middle: object) -> str:
    shown = value if isinstance(value, str) else f"{value:.6g}"
    return shown if value == middle else f"{shown} *"


def deviations_table(rows: Mapping[str, _Row], quantities: pd.DataFrame) -> pd.DataFrame:
    """Return how far the numbers of some rows lie from nominal, in sides of their boxes."""
    # 1 is the upper end of the box, -1 the lower one; one line per quantity, one column per row.
    numbers = quantities.reindex(columns=["nominal", "low", "high"]).dropna()

    def sides(value: float, nominal: float, low: float, high: float) -> float:
        side = high - nominal if value > nominal else nominal - low
        return (value - nominal) / side if value != nominal else 0.0

    return pd.DataFrame(
        {
            label: [
                sides(float(row[name]), *map(float, numbers.loc[name])) for name in numbers.index
            ]
            for label, row in rows.items()
        },
        index=numbers.index,
        columns=list(rows),
    )


_POINTS = 150  # of the estimate
_RUNNING = (
    "Line: share of violations after n runs, in their order. Band: bounds that hold at all n at "
    "once with confidence {confidence:g} % (a confidence sequence)."
)


def running_items(
    finding: Finding,
    result: Result,
    asked: Any,
    key: str,
    *,
    decides: str,
    fixed: tuple[float, float] | None = None,
) -> Iterator[Item]:
    """Yield what the estimate did while the rows came in."""
    assert result.rows is not None
    margins = result.rows.columns("spec")["spec"].to_numpy(dtype=float)
    confidence = float(finding.numbers["confidence"])
    curve = running(margins[: int(finding.numbers["runs"])], confidence)
    last = curve.iloc[-1]
    caption = _RUNNING.format(confidence=100 * confidence) + decides
    ends = f", exact bounds {rounded_down(fixed[0])} and {rounded_up(fixed[1])}" if fixed else ""
    yield captioned(
        f"{key}-running",
        caption,
        f"After {counted(curve.index[-1], 'run')}: {last['rate']:.4g}, band "
        f"from {last['low']:.4g} to {last['high']:.4g}{ends}.",
        figures.running_estimate(curve, asked.limit, fixed),
    )


def running(margins: np.ndarray, confidence: float) -> pd.DataFrame:
    """Return the share of violations after n rows with its confidence sequence, for some n."""
    # Columns violations, rate, low, high; NaN is a violation.
    counts = np.cumsum(violates(margins))
    numbers = np.unique(np.geomspace(1, counts.size, _POINTS).round().astype(int))
    rows = []
    for n in map(int, numbers):
        k = int(counts[n - 1])
        low, high = sequence_bounds(k, n, confidence)
        rows.append({"violations": k, "rate": k / n, "low": low, "high": high})
    return pd.DataFrame(rows, index=pd.Index(numbers, name="runs"))
