"""Rows that a search found, next to the nominal one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from ... import figures as figures
from ...report.document import Item, Table, captioned
from .tables import known

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
