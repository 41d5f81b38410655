"""Names that users give, as labels of figures: harmless to draw, and of bounded length."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlctl.plotting.axes import WIDTH, set_style
from nlctl.plotting.labels import plain

__all__ = ["arms", "number_axes", "plain"]


def number_axes(names: Iterable[object]) -> tuple[Figure, Axes]:
    """Return axes with one line for each name, from the top: names may be alike once cut."""
    labels = [plain(name) for name in names]
    figure = Figure(figsize=(WIDTH, 0.32 * len(labels) + 0.9), layout="constrained")
    ax = figure.subplots()
    set_style(ax)
    ax.set_yticks(np.arange(len(labels)), labels, parse_math=False)
    ax.set_ylim(len(labels) - 0.4, -0.6)
    return figure, ax


def arms(value: np.ndarray, low: object, high: object) -> np.ndarray:
    """Return the lengths of error bars; a bootstrap interval may lie beside its estimate."""
    return np.maximum([value - np.asarray(low), np.asarray(high) - value], 0.0)
