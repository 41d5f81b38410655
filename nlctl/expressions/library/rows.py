"""Rows of a table of pandas that the state chooses, by a mask or by their place."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from ..masked import Masked

_INDEXERS = ("_iLocIndexer", "_LocIndexer")


def is_table(thing: object) -> bool:
    """Whether an object is a table of pandas, or what takes its places or labels."""
    of_pandas = type(thing).__module__.startswith("pandas")
    return of_pandas and type(thing).__name__ in ("DataFrame", *_INDEXERS)


def chosen_rows(graph: Graph, table: Any, key: Any) -> Any:
    """Return the rows of a table, or of one of its columns, that a mask or an integer chooses."""
    column, by_place = None, type(table).__name__ == "_iLocIndexer"
    if type(table).__name__ in _INDEXERS:
        table = table.obj
        key, column = key if isinstance(key, tuple) and len(key) == 2 else (key, None)
    if table.ndim != 2 or not isinstance(key, Tracer):
        raise Untraceable("rows of a table of pandas that depend on the state")
    numbers = {k: v for k, v in table.items() if v.dtype in (np.dtype(float), np.dtype(int))}
    columns = {k: traced(graph, v.to_numpy(dtype=float)) for k, v in numbers.items()}
    if len(columns) < table.shape[1] or not table.columns.is_unique:
        raise Untraceable("rows of a table of pandas that holds more than numbers")
    is_mask = key.ndim == 1 and {e.kind for e in key.values.flat} == {"b"}
    if not (is_mask or (by_place and not key.shape)):
        raise Untraceable("rows of a table of pandas that depend on the state")
    chosen = (
        _ChosenRows(columns, key)
        if is_mask
        else _ChosenRow({k: v[key] for k, v in columns.items()})
    )
    return chosen if column is None else chosen[list(columns)[column] if by_place else column]


class _ChosenRows:
    """Rows that a mask chooses."""

    def __init__(self, columns: Mapping[str, Tracer], mask: Tracer) -> None:
        self._columns, self._mask = columns, mask

    def __getitem__(self, name: Any) -> _ChosenColumn:
        if not isinstance(name, str) or name not in self._columns:
            raise Untraceable("rows that a mask chooses, other than by a column's name")
        return _ChosenColumn(self._columns[name], self._mask)

    def __getattr__(self, name: str) -> Any:
        if name == "empty":
            return self[next(iter(self._columns))].count() == 0
        if name == "iloc":
            return _Places(lambda k: _ChosenRow({n: self[n].values[k] for n in self._columns}))
        return self[name]


class _ChosenColumn(Masked):
    """A column of rows that a mask chooses."""

    @property
    def values(self) -> Masked:
        """The numbers."""
        return Masked(self.whole, self.mask)

    def to_numpy(self) -> Masked:
        """Return the numbers."""
        return self.values

    @property
    def iloc(self) -> Any:
        """The numbers by their place."""
        return _Places(self.values.__getitem__)

    iat = iloc

    def max(self) -> Any:
        """Refuse: of no rows it is NaN, and no error."""
        raise Untraceable("the largest of a column of rows that a mask chooses")

    def min(self) -> Any:
        """Refuse: of no rows it is NaN, and no error."""
        raise Untraceable("the smallest of a column of rows that a mask chooses")

    def __getitem__(self, key: Any) -> Any:
        raise Untraceable("labels of rows that a mask chooses")


class _ChosenRow:
    """One row."""

    def __init__(self, numbers: Mapping[str, Any]) -> None:
        self._numbers = numbers

    def __getitem__(self, name: Any) -> Any:
        if name not in self._numbers:
            raise Untraceable("an element of a row, other than by a column's name")
        return self._numbers[name]

    def __getattr__(self, name: str) -> Any:
        return self[name]

    def __iter__(self) -> Iterator[Any]:
        return iter(self._numbers.values())


class _Places:
    def __init__(self, at: Callable[[Any], Any]) -> None:
        self._at = at

    def __getitem__(self, k: Any) -> Any:
        return self._at(k)
