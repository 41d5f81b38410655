"""The columns of a sweep's table, and their types."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from nlctl.native import Status

from .experiment import Prepared

__all__ = ["Columns", "columns_of", "typed"]

Columns = Mapping[str, str | Sequence[str]]
"""For each column the name of its type, or the labels that it may hold."""


def columns_of(prepared: Prepared) -> Columns:
    """Return the columns of a sweep's table, in order.

    Those of `experiment.evaluate`, then ``seed`` (see `design.seed_number`) and ``wall_time``, the
    time (s) that a row's chunk took over its number of rows.
    """
    experiment = prepared.experiment
    numbers = (*experiment.space.names, *experiment.measured)
    columns: dict[str, str | Sequence[str]] = dict.fromkeys(numbers, "float64")
    columns |= {choice.name: list(choice.options) for choice in experiment.space.choices}
    columns |= {"status": [status.name for status in Status], "steps": "int64"}
    return columns | {"seed": "uint64", "wall_time": "float64"}


def typed(frame: pd.DataFrame, columns: Columns) -> pd.DataFrame:
    """Return those columns that a frame has, in their order and with their types.

    Raises
    ------
    ValueError
        If a column cannot have its type.
    """
    types = {
        name: kind if isinstance(kind, str) else pd.CategoricalDtype(list(kind))
        for name, kind in columns.items()
        if name in frame
    }
    return frame.filter(list(types)).astype(types)
