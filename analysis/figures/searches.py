"""Figures of searches: after how many runs, at which size, under which faults, of which gains."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.colors import ListedColormap, Normalize, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.tri import LinearTriInterpolator, Triangulation

from nlctl.plotting.axes import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SHORT_LINE,
    TEXT_INK,
    WIDTH,
    legend_above,
    stacked_axes,
)

from ..robustness.stl.spec import violates
from .labels import arms, drawable, draws, number_axes, plain, within_reach
from .runs import clipped_margins

SEARCHERS = {"corners": GREY, "uniform": BLUE, "CMA-ES": GREEN}
MAP_INK = "#111111"  # on the map, which is light on dark pages as well
COLOURS = ListedColormap(colormaps["PuOr"](np.linspace(0.15, 0.85, 256)))  # MAP_INK shows on all


@draws
def search(lowest: np.ndarray, searchers: Sequence[str]) -> Figure:
    """Lowest margin found after each run of a search, in the colour of what chose the run.

    Parameters
    ----------
    lowest : ndarray of shape (runs,)
        Lowest margin so far.
    searchers : sequence of str
        What chose each run.
    """
    figure, (ax,) = stacked_axes()
    y, names = clipped_margins(lowest), np.asarray(searchers, dtype=object)
    starts = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1), names.size]
    labelled = set()
    for start, end in pairwise(starts):
        name = str(names[start])
        ax.axvspan(
            start + 0.5, end + 0.5, color=SEARCHERS.get(name, PURPLE), alpha=0.15, linewidth=0,
            label=None if name in labelled else plain(name),
        )  # fmt: skip
        labelled.add(name)
    ax.step(np.arange(1, y.size + 1), y, where="post", color=TEXT_INK, linewidth=1.4)
    ax.axhline(0.0, color=GREY, linewidth=1.0, linestyle="--")
    legend_above(ax)
    ax.set(xlabel="runs", ylabel="lowest margin (1)")
    return figure


@draws
def deviations(table: pd.DataFrame) -> Figure:
    """How far the quantities of some rows deviate from nominal, in sides of the box.

    Parameters
    ----------
    table : DataFrame
        One row per quantity, one column per row of the study; 1 is the upper end of the box, -1
        the lower one.
    """
    figure, ax = number_axes(table.index)
    table, height = drawable(table, *table.columns), 0.7 / len(table.columns)
    for i, ((name, values), (colour, hatch)) in enumerate(
        zip(table.items(), ((GREY, ""), (BLUE, "///")), strict=False)
    ):
        at = np.arange(len(table)) + (i - (len(table.columns) - 1) / 2) * height
        ax.barh(at, values, height, color=colour, hatch=hatch, edgecolor="white", label=str(name))
    for end in (-1.0, 0.0, 1.0):
        ax.axvline(end, color=GREY, linewidth=0.8, linestyle="--" if end else "-")
    legend_above(ax, line=SHORT_LINE)
    ax.set_xlabel("deviation from nominal, in sides of the box (1)")
    return figure


@draws
def degradation(curve: pd.DataFrame, at: float | None = None, limit: float | None = None) -> Figure:
    """Share of violations with its interval against the size of the uncertainty.

    Parameters
    ----------
    curve : pandas.DataFrame
        Columns ``rate``, ``lower``, ``upper``, by the factor of the uncertainty.
    at : float, optional
        A factor to be marked.
    limit : float, optional
        A rate to be marked.
    """
    figure, (ax,) = stacked_axes()
    size = within_reach(curve.index)
    rate, low, high = within_reach(curve[["rate", "lower", "upper"]]).T
    ax.errorbar(
        size, rate, yerr=arms(rate, low, high), color=BLUE, marker="o",
        markersize=4, linewidth=1.2, capsize=3,
    )  # fmt: skip
    if at is not None and limit is not None:
        ax.plot([at], [limit], "v", color=ORANGE, markersize=7, label="limit")
        legend_above(ax)
    ax.set(xlabel="size of the uncertainty (1)", ylabel="probability of a violation")
    ax.margins(x=0.03)
    ax.set_ylim(bottom=-0.03 * ax.get_ylim()[1])
    return figure


@draws
def radius_steps(steps: pd.DataFrame, radius: float) -> Figure:
    """Lowest margin that was found at each size that was tried, and the radius.

    Parameters
    ----------
    steps : pandas.DataFrame
        Sizes that were tried, with the lowest margin at each.
    radius : float
        The robustness radius.
    """
    figure, (ax,) = stacked_axes()
    size, margin = within_reach(steps["size"]), clipped_margins(steps["margin"])
    violated = violates(margin)
    for chosen, marker, colour, name in (
        (~violated, "o", BLUE, "no violation found"),
        (violated, "X", ORANGE, "violation"),
    ):
        if chosen.any():
            ax.plot(size[chosen], margin[chosen], marker, color=colour, label=name)
    if np.isfinite(radius):
        ax.axvline(radius, color=ORANGE, linewidth=1.2, linestyle="--", label="radius at most")
    ax.axhline(0.0, color=GREY, linewidth=1.0)
    legend_above(ax)
    ax.set(xlabel="size of the uncertainty (1)", ylabel="lowest margin (1)")
    return figure


@draws
def failure_map_figure(
    points: pd.DataFrame,
    triangles: np.ndarray,
    names: tuple[str, str],
    labels: tuple[str, str] | None = None,
    nominal: tuple[float, float] | None = None,
    box: tuple[tuple[float, float], tuple[float, float]] | None = None,
) -> Figure:
    """Margins over the plane of two quantities, where they are 0, and the points that were run.

    The colours go from the least to the largest margin, with white at 0; margins beyond ±1 are
    drawn as ±1.

    Parameters
    ----------
    points : DataFrame
        The two quantities and ``spec``.
    triangles : ndarray of int, shape (k, 3)
        Rows of `points`.
    names : tuple of 2 str
        Columns of `points` on the axes.
    labels : tuple of 2 str, optional
        Of the axes, with units.
    nominal : tuple of 2 floats, optional
        Nominal values of both quantities, marked by a star; none by default.
    box : tuple of 2 pairs, optional
        What the study takes to be possible: ends of both quantities.

    Raises
    ------
    ValueError
        Points that are no numbers, or that the triangles do not fit.
    """
    figure = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    ax = figure.subplots()
    x, y = (points[name].to_numpy(dtype=float) for name in names)
    margin = np.clip(clipped_margins(points["spec"]), -1.0, 1.0)
    net = _net(x, y, triangles)
    span = (x.min(), x.max(), y.min(), y.max())
    plane = np.meshgrid(np.linspace(*span[:2], 240), np.linspace(*span[2:], 180))
    field = LinearTriInterpolator(net, margin)(*plane)
    image = ax.imshow(
        field, extent=span, origin="lower", aspect="auto", cmap=COLOURS, norm=centred(margin)
    )
    ax.plot(x, y, ".", color=MAP_INK, markersize=1.5, alpha=0.5, rasterized=True)
    if margin.min() <= 0 < margin.max():
        ax.tricontour(net, margin, levels=[0.0], colors=MAP_INK, linewidths=1.6)
    if box is not None:
        (left, right), (low, high) = box
        ax.plot(
            [left, right, right, left, left], [low, low, high, high, low], "--", color=MAP_INK,
            linewidth=1.2,
        )  # fmt: skip
    if nominal is not None:
        ax.plot(*nominal, "*", color=MAP_INK, markeredgecolor="white", markersize=13)
    ax.set_xlim(*span[:2])
    ax.set_ylim(*span[2:])
    ax.set_xlabel(plain((labels or names)[0]), parse_math=False)
    ax.set_ylabel(plain((labels or names)[1]), parse_math=False)
    bar = figure.colorbar(image, ax=ax, label="margin (1)")
    bar.ax.set_ylim(float(margin.min()), max(float(margin.max()), float(margin.min()) + 1e-6))
    return figure


def _net(x: np.ndarray, y: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Return the net of a map; points and triangles of two maps make none."""
    if not np.isfinite([x, y]).all():
        raise ValueError("points of the map are no numbers")
    net = Triangulation(x, y, triangles)
    try:
        net.get_trifinder()
    except RuntimeError:
        raise ValueError("points and triangles of the map do not fit together") from None
    return net


def centred(margin: np.ndarray) -> Normalize:
    """Return the scale of colours that fits margins: 0 in the middle, their ends at its ends."""
    low, high = float(margin.min()), float(margin.max())
    least = 0.05  # a map that is all alike is not made to look as if it were not
    return TwoSlopeNorm(0.0, min(low, -least), max(high, least))


REACH = 1.0  # margins beyond are drawn there


def _clipped(margin: pd.Series | pd.DataFrame) -> np.ndarray:
    """Return margins as they are drawn; one that is not a number is as bad as any."""
    return np.clip(np.nan_to_num(margin.to_numpy(dtype=float), nan=-REACH), -REACH, REACH)


@draws
def fault_margins(margin: pd.Series) -> Figure:
    """Least margin that each fault leaves, with its name at the left.

    Parameters
    ----------
    margin : pandas.Series
        Least margin by the name of the fault.
    """
    figure, ax = number_axes(margin.index)
    value = _clipped(margin)
    at, bad = np.arange(len(value)), violates(margin)
    ax.barh(at[~bad], value[~bad], 0.6, color=BLUE, edgecolor="white")
    ax.barh(at[bad], value[bad], 0.6, color=ORANGE, hatch="///", edgecolor="white")
    ax.axvline(0.0, color=GREY, linewidth=1.0)
    ax.set(xlabel="least margin (1)", xlim=(-1.05 * REACH, 1.05 * REACH))
    return figure


@draws
def fault_pairs(margin: pd.DataFrame) -> Figure:
    """Least margin under each pair of faults; on the diagonal under one alone.

    Parameters
    ----------
    margin : DataFrame
        Square and symmetric, with the names of the faults.
    """
    count = len(margin)
    figure = Figure(figsize=(WIDTH, 2.2 + 0.22 * count), layout="constrained")
    ax = figure.subplots()
    value = _clipped(margin)
    image = ax.imshow(value, cmap=COLOURS, norm=centred(value), aspect="auto")
    rows, columns = np.nonzero(violates(margin.to_numpy()))
    ax.plot(columns, rows, "x", color=MAP_INK, markersize=4)
    names = [plain(name) for name in margin.index]
    ax.set_yticks(np.arange(count), names, parse_math=False, fontsize="medium")
    ax.set_xticks(np.arange(count), names, parse_math=False, fontsize="medium", rotation=90)
    figure.colorbar(image, ax=ax, label="least margin (1)")
    return figure


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
