"""Tables of results and quantities on a page, and columns in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from ...report.document import Table
from . import text as text


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
        folded=caption.startswith(text.SAME),
    )


def _cell(value: object) -> Any:
    return f"{value:.4g}" if isinstance(value, float) else value


def known(quantities: pd.DataFrame, *columns: str) -> Iterable[tuple[Any, ...]]:
    """Return name and columns of every quantity, None where a choice has no such thing."""
    table = quantities.reindex(columns=list(columns)).astype(object)
    table = table.where(table.notna(), None)
    if "unit" in columns:
        table["unit"] = table["unit"].map(text.unit_text)
    return table.itertuples(name=None)
