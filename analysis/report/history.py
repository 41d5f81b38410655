"""Interactive time histories: the samples of them that a page holds."""

import json
from typing import Any

import numpy as np

from ..json_values import as_json
from .document import History, Report
from .outline import place_anchors

SIGNALS_FILE = "signals.json"
"""File next to a page with the time histories of the page, for comparisons."""

_COUNT = 2000  # samples of each signal on the page
DIGITS = 6


def chart(history: History, bands: bool = False) -> dict[str, Any]:
    """Return what ``history.js`` draws a time history from, as JSON can hold it."""
    # What is not finite becomes null, which is drawn as a gap. Its bands are for comparisons.
    time = np.asarray(history.time, dtype=float)
    rows = [np.asarray(samples, dtype=float) for samples in history.signals.values()]
    signals = np.array(rows).reshape(len(rows), len(time))
    kept = thinned(signals)
    ends = {name: [_rounded(end[kept]) for end in band] for name, band in history.bands.items()}
    return {
        "names": list(history.signals),
        "shown": [not history.shown or name in history.shown for name in history.signals],
        "unit": history.unit,
        "data": [_rounded(row[kept]) for row in (time, *signals)],
    } | ({"bands": ends} if bands and ends else {})


def signals_json(report: Report) -> str:
    """Return the time histories of a report by their anchors; nothing if it has none."""
    charts = {
        anchor: chart(item, bands=True)
        for part in place_anchors(report)
        for anchor, _, item in part.items
        if isinstance(item, History)
    }
    return json.dumps(as_json(charts), ensure_ascii=False, allow_nan=False) + "\n" if charts else ""


def thinned(signals: np.ndarray, count: int = _COUNT) -> np.ndarray:
    """Choose the samples that show what long signals do."""
    # Half of them are evenly spaced. The others are the least and the largest value of each signal
    # in each of some stretches, and its first sample there that is not finite, so that neither a
    # peak nor a gap is lost.
    # Shapes: `signals` (n, m).
    number, length = signals.shape
    if length <= count:
        return np.arange(length)
    finite = np.isfinite(signals)
    chosen = {*np.linspace(0, length - 1, count // 2).round().astype(int).tolist()}
    stretches = max(1, count // 2 // (3 * max(1, number)))
    for stretch in np.array_split(np.arange(length), stretches):
        part, is_number = signals[:, stretch], finite[:, stretch]
        lowest = np.where(is_number, part, np.inf).argmin(axis=1)
        highest = np.where(is_number, part, -np.inf).argmax(axis=1)
        for indices in (lowest, highest, is_number.argmin(axis=1)):
            chosen |= {*stretch[indices].tolist()}
    return np.array(sorted(chosen))


def _rounded(samples: np.ndarray) -> list[float | None]:
    return [float(f"{x:.{DIGITS}g}") if np.isfinite(x) else None for x in samples.tolist()]
