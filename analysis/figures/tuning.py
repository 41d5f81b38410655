"""Figures of tuning: how gains were found, what each contributes, margins before and after."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nlctl.plotting.axes import (
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    SHORT_LINE,
    TEXT_INK,
    legend_above,
    stacked_axes,
)

from .labels import draws, number_axes, within_reach
from .runs import clipped_margins

_CHOSEN = {
    "search": (BLUE, "o", "search"),
    "Sobol'": (GREY, "x", "points of Sobol'"),
    "put back": (GREEN, "+", "a gain put back"),
}


@draws
def tried(history: pd.DataFrame, cost: bool = False) -> Figure:
    """Draw what every choice of gains was worth, by the runs until then, and the best so far.

    Parameters
    ----------
    history : pandas.DataFrame
        As that of `nlctl.sensitivities.Tuned`.
    cost : bool, optional
        Whether it is the cost that counts.
    """
    figure, (ax,) = stacked_axes()
    y = within_reach(history["cost"]) if cost else clipped_margins(history["margin"])
    runs = within_reach(history["runs"])
    for name, (colour, marker, label) in _CHOSEN.items():
        by_this = (history["by"] == name).to_numpy()
        if by_this.any():
            ax.plot(runs[by_this], y[by_this], marker, color=colour, markersize=4, label=label)
    if not cost:
        best = np.maximum.accumulate(y)
        ax.step(runs, best, where="post", color=TEXT_INK, linewidth=1.4, label="best")
    legend_above(ax)
    ax.set(xlabel="runs (1 + 0.7 k for k derivatives)", ylabel="cost" if cost else "least margin")
    return figure


@draws
def bought(gains: pd.DataFrame, before: float, after: float, what: str) -> Figure:
    """Draw what each gain contributes: with it alone as found, and with all others as found.

    Parameters
    ----------
    gains : pandas.DataFrame
        As `nlctl.sensitivities.Tuned.to_pandas` returns it.
    before, after : float
        The least margin, or the cost, with all gains of the start and as found.
    what : str
        Name of the axis.
    """
    figure, ax = number_axes(gains.index)
    figure.set_figheight(figure.get_figheight() + 0.9)
    at = np.arange(len(gains))
    alone, rest = (_confined(gains[c].to_numpy(), before, after) for c in ("alone", "put_back"))
    ax.barh(
        at - 0.18, alone - before, 0.34, left=before, color=BLUE, edgecolor="white",
        label="this one alone as found",
    )  # fmt: skip
    ax.barh(
        at + 0.18, rest - after, 0.34, left=after, color=PURPLE, hatch="///", edgecolor="white",
        label="all but this one as found",
    )  # fmt: skip
    ax.axvline(before, color=GREY, linewidth=1.0, linestyle="--", label="before")
    ax.axvline(after, color=BLUE, linewidth=1.2, label="after")
    legend_above(ax, line=SHORT_LINE)
    ax.use_sticky_edges = False
    ax.margins(x=0.05)
    ax.set_xlabel(what, parse_math=False)
    return figure


def _confined(values: np.ndarray, before: float, after: float) -> np.ndarray:
    """Return values within twice the gain around what was and what is: bars beyond are cut."""
    wide = 2.0 * abs(after - before) or 1.0
    low, high = min(before, after) - wide, max(before, after) + wide
    return np.nan_to_num(np.clip(values, low, high), nan=low)


@draws
def margins_of_both(before: np.ndarray, after: np.ndarray) -> Figure:
    """Draw the share of rows with at most a margin, before and after.

    Parameters
    ----------
    before, after : ndarray of shape (rows,)
        Margins of the same rows.
    """
    figure, (ax,) = stacked_axes()
    for y, colour, style, label in ((before, GREY, "--", "before"), (after, BLUE, "-", "after")):
        ordered = np.sort(clipped_margins(y))
        share = np.arange(1, ordered.size + 1) / ordered.size
        ax.step(ordered, share, style, where="post", color=colour, linewidth=1.4, label=label)
    ax.axvline(0.0, color=GREY, linewidth=1.0, linestyle="--")
    legend_above(ax)
    ax.set(xlabel="margin (1)", ylabel="share of the rows", ylim=(0.0, 1.02))
    return figure
