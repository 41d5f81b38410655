"""Signals of one run over time, those of one kind in one row."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .axes import STYLES, TIME, legend_above, plain, stacked_axes


def rows_figure(
    time: np.ndarray,
    signals: Mapping[str, np.ndarray],
    rows: Mapping[str, Sequence[str]],
    figure: Figure | None = None,
) -> tuple[Figure, list[Axes]]:
    """Draw samples of shape (m,) by name in rows of names, with a title each, above each other."""
    # A figure that is given is empty; its size is set.
    height = 1.7 if len(rows) > 1 else 2.4
    figure, axes = stacked_axes(rows=len(rows), height=height, figure=figure)
    for ax, (title, names) in zip(axes, rows.items(), strict=True):
        shown: dict[str, Any] = {}
        for name, (colour, style) in zip(names, STYLES, strict=False):
            (shown[plain(name)],) = ax.plot(time, signals[name], style, color=colour, linewidth=1.4)
        if len(names) > 1:
            legend_above(ax, shown)
        label = names[0] if len(names) == 1 else title
        ax.set_ylabel(plain(label), parse_math=False)
    axes[-1].set_xlabel(TIME)
    return figure, axes
