"""What every search asks of a row: its margin, by simulation or by a formula."""

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from nlctl.arguments import a_function
from nlctl.errors import ParameterError

from ..uncertainty.space import Space, towards_nominal

# takes rows, returns a table with their index and a column ``spec``, > 0 holds; for a loop
# ``functools.partial(evaluate, prepared)``
Evaluate = Callable[[pd.DataFrame], pd.DataFrame]
_Row = dict[str, Any]


def evaluated(evaluate: Evaluate, table: pd.DataFrame) -> pd.DataFrame:
    """Evaluate rows; the results are in their order."""
    results = a_function("a search", "evaluate", evaluate)(table)
    if not isinstance(results, pd.DataFrame):
        raise ParameterError(
            f"a search needs results as a pandas.DataFrame, got {type(results).__name__}"
        )
    if "spec" not in results.columns:
        raise ParameterError(
            f"a search needs results with a column 'spec', got {list(results.columns)}"
        )
    if len(results) < len(table):
        raise KeyboardInterrupt
    if not table.index.isin(results.index).all():
        raise ParameterError(
            "a search needs results with the index of the rows, got "
            f"{list(results.index[:3])} ... for {list(table.index[:3])} ..."
        )
    return results.loc[table.index]


def margins_of(results: pd.DataFrame) -> np.ndarray:
    """Return the margins; NaN, which is a violation, counts as the lowest."""
    margins = results["spec"].to_numpy(dtype=float)
    return np.where(np.isnan(margins), -np.inf, margins)


def as_table(space: Space, rows: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Return rows given as ``{name: value}`` as a table with the space's columns."""
    return pd.DataFrame(list(rows), columns=space.names)


def margins_at(evaluate: Evaluate, space: Space, rows: Iterable[Mapping[str, Any]]) -> np.ndarray:
    """Evaluate rows given as ``{name: value}``, return their margins."""
    return margins_of(evaluated(evaluate, as_table(space, rows)))


def nearest_violation(
    margins: Callable[[list[_Row]], np.ndarray],
    space: Space,
    violation: tuple[_Row, float],
    steps: int,
    names: Collection[str] | None = None,
) -> tuple[_Row, float]:
    """Move numbers of a violation towards nominal as far as bisection keeps it one."""
    (full, _), low, high = violation, 0.0, 1.0
    for _ in range(steps):
        middle = (low + high) / 2
        nearer = towards_nominal(space, full, middle, names)
        margin = margins([nearer])[0]
        if margin > 0:
            low = middle
        else:
            violation, high = (nearer, margin), middle
    return violation


def row_text(row: Mapping[str, Any]) -> str:
    """Return a row as text, ``a = 1.5, arm = x``."""
    return ", ".join(f"{k} = {v if isinstance(v, str) else f'{v:.6g}'}" for k, v in row.items())
