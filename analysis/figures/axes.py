"""What all figures share: colours, line styles, axes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = [
    "BLUE",
    "GREEN",
    "GREY",
    "ORANGE",
    "PURPLE",
    "STYLES",
    "TIME",
    "draw_lines",
    "legend_beside",
    "set_style",
    "stacked_axes",
]

# Okabe-Ito: distinguishable for colour-blind readers; line styles distinguish as well.
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#6b7280"
STYLES = ((BLUE, "-"), (ORANGE, "--"), (GREEN, "-."), (PURPLE, ":"))
TIME = "time t (s)"


def stacked_axes(rows: int = 1, height: float = 2.6) -> tuple[Figure, list[Axes]]:
    """Return a figure with axes above each other, which share their horizontal axis."""
    figure = Figure(figsize=(9.0, height * rows), layout="constrained")
    axes = list(np.ravel(figure.subplots(rows, 1, sharex=rows > 1)))
    for ax in axes:
        set_style(ax)
        ax.margins(x=0.01)
    return figure, axes


def set_style(ax: Axes) -> None:
    """Give axes a grid behind what is drawn, and no frame."""
    ax.set_axisbelow(True)
    ax.grid(True, alpha=0.25, linewidth=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def draw_lines(ax: Axes, t: np.ndarray, curves: Mapping[str, np.ndarray]) -> None:
    """Draw up to four signals over time, with a legend beside them if there are several."""
    for (label, y), (colour, style) in zip(curves.items(), STYLES, strict=False):
        ax.plot(t, y, style, color=colour, linewidth=1.4, label=label)
    if len(curves) > 1:
        legend_beside(ax)


def legend_beside(ax: Axes) -> None:
    """Put the legend to the right of axes, where it hides nothing."""
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
