"""The estimate of a probability while the rows come in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, captioned
from ...robustness.statistics.guarantee import rounded_down, rounded_up
from ...robustness.statistics.sequential import sequence_bounds
from ...robustness.stl.spec import violates
from ..result import Finding, Result

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
