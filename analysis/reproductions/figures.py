"""Figures that pages of papers share."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from nlctl.plotting.axes import STYLES, TIME, legend_above, stacked_axes


def paths_figure(paths: Mapping[str, tuple[Any, Any]], across: str, up: str) -> Figure:
    """Draw up to four paths in a plane; those of a label that ends in "read" as points."""
    figure, (ax,) = stacked_axes(height=3.0)
    for (label, (x, y)), (colour, style) in zip(paths.items(), STYLES, strict=False):
        line = "o" if label.endswith("read") else style
        ax.plot(x, y, line, color=colour, linewidth=1.4, markersize=5, label=label)
    if len(paths) > 1:
        legend_above(ax)
    ax.set(xlabel=across, ylabel=up)
    return figure


def rows_over_time(rows: Mapping[str, Mapping[str, tuple[Any, Any]]]) -> Figure:
    """Draw rows of signals over time: ``{axis label: {signal: (times, values)}}``."""
    figure, axes = stacked_axes(rows=len(rows), height=2.4 if len(rows) == 1 else 1.9)
    for ax, (label, signals) in zip(axes, rows.items(), strict=True):
        for (name, (times, values)), look in zip(signals.items(), STYLES, strict=False):
            colour, style = look
            ax.plot(times, values, style, color=colour, linewidth=1.4, label=name)
        if len(signals) > 1:
            legend_above(ax)
        ax.set(ylabel=label)
    axes[-1].set(xlabel=TIME)
    return figure
