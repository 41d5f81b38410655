"""What all figures share; names that users give as labels, and numbers of any size, drawn."""

import inspect
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlctl.annotations import as_annotated
from nlctl.plotting.axes import WIDTH, plain, set_style

_LARGEST = 1e100  # transforms of axes overflow from about 1e306 on
_RETURNS = "\n\nReturns\n-------\nFigure\n    Of matplotlib; nothing is written or shown."
_F = TypeVar("_F", bound=Callable[..., Figure])


def draws(function: _F) -> _F:
    """Mark a function that draws: what all of them return is said here."""
    parameters, *raises = inspect.cleandoc(function.__doc__ or "").partition("\n\nRaises\n")
    function.__doc__ = "".join([parameters, _RETURNS, *raises])
    return as_annotated(function)


def panels(
    height: float, rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Figure, list[Axes]]:
    """Return a figure as wide as the page with axes in rows; options as of `Figure.subplots`."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = list(np.ravel(figure.subplots(rows, columns, **options)))
    for ax in axes:
        set_style(ax)
    return figure, axes


def number_axes(names: Iterable[object]) -> tuple[Figure, Axes]:
    """Return axes with one line for each name, from the top: names may be alike once cut."""
    labels = [plain(name) for name in names]
    if not labels:
        raise ValueError("there are no rows to draw")
    figure, (ax,) = panels(0.32 * len(labels) + 0.9)
    ax.set_yticks(np.arange(len(labels)), labels, parse_math=False)
    ax.set_ylim(len(labels) - 0.4, -0.6)
    return figure, ax


def arms(value: np.ndarray, low: object, high: object) -> np.ndarray:
    """Return the lengths of error bars; an estimate may lie outside its bootstrap interval."""
    return np.maximum([value - np.asarray(low), np.asarray(high) - value], 0.0)


def within_reach(values: object) -> np.ndarray:
    """Return numbers with infinite ones just beyond the finite ones; NaN stays."""
    y = np.asarray(values, dtype=float)
    reach = 1.15 * float(np.max(np.abs(y), initial=0.0, where=np.isfinite(y))) or 1.0
    return np.clip(y, -min(reach, _LARGEST), min(reach, _LARGEST))


def drawable(table: pd.DataFrame, *columns: str) -> pd.DataFrame:
    """Return columns of a table, numbers in one unit, with all of them within reach."""
    numbers = within_reach(table[list(columns)])
    return pd.DataFrame(numbers, index=table.index, columns=list(columns))
