"""Figures of many runs: their margins, how sure one is after how many, and their signals.

A run violates the spec unless its margin is > 0: NaN, and margins of runs that did not reach their
end, are drawn as violations.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from nlctl.plotting.axes import (
    BLUE,
    GREY,
    ORANGE,
    SHORT_LINE,
    TIME,
    legend_above,
    plain,
    stacked_axes,
)
from nlctl.plotting.bands import Limit, bands

from ..robustness.stl.spec import violates
from .labels import arms, draws, panels, within_reach

CLIP = 2.0
"""Margins below -CLIP are drawn at -CLIP: beyond, how far says little."""
_NOTHING: Mapping[str, Any] = MappingProxyType({})


def clipped_margins(values: object) -> np.ndarray:
    """Return margins as they are drawn: clipped at -CLIP, NaN there as well."""
    y = np.asarray(values, dtype=float)
    return within_reach(np.maximum(np.where(np.isnan(y), -np.inf, y), -CLIP))


@draws
def margins_figure(values: np.ndarray) -> Figure:
    """How many runs have which margin, and the share of runs with at most that margin.

    Parameters
    ----------
    values : ndarray of shape (runs,)
        Margins; those of runs that ended early are drawn at the edge.
    """
    figure, (counts, part) = panels(2.6, 1, 2)
    y = clipped_margins(values)
    violated = violates(y)
    low, high = min(float(y.min()), 0.0), max(float(y.max()), 0.0)
    width = (high - low or 1.0) / 40
    edges = width * np.arange(np.floor(low / width) - 1, np.ceil(high / width) + 2)  # 0 is an edge
    counts.hist(y[~violated], edges, color=BLUE, label="holds")
    if violated.any():
        at = np.minimum(y[violated], -width / 2)  # a margin of 0 is a violation
        counts.hist(at, edges, color=ORANGE, hatch="///", edgecolor="white", label="violates")
    legend_above(counts, line=SHORT_LINE)
    counts.set(xlabel="margin (1)", ylabel="runs")
    ordered = np.sort(y)
    share = np.arange(1, y.size + 1) / y.size
    part.step(ordered, share, where="post", color=BLUE, linewidth=1.4)
    rate = float(np.mean(violated))
    if rate:
        below = ordered <= 0
        part.fill_between(ordered[below], share[below], step="post", color=ORANGE, alpha=0.5)
    part.axvline(0.0, color=GREY, linewidth=1.0, linestyle="--")
    part.set(xlabel="margin (1)", ylabel="share of runs", ylim=(0.0, 1.02))
    part.yaxis.set_major_formatter(PercentFormatter(1.0, symbol="\N{NO-BREAK SPACE}%"))
    for ax in (counts, part):
        ax.xaxis.set_major_locator(MaxNLocator(4))  # of -0.25 and the like there is room for
    counts.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


@draws
def running_estimate(
    curve: pd.DataFrame, limit: float | None = None, fixed: tuple[float, float] | None = None
) -> Figure:
    """Share of violations after n runs, and bounds that hold at all n together.

    Parameters
    ----------
    curve : DataFrame
        Columns rate, low, high, indexed by the number of runs.
    limit : float, optional
        Of the claim.
    fixed : tuple of 2 floats, optional
        Exact bounds after the last run, which decide where the number of runs was fixed.
    """
    figure, (ax,) = stacked_axes()
    n = curve.index.to_numpy()
    ax.fill_between(
        n, curve["low"], curve["high"], color=BLUE, alpha=0.2, linewidth=0,
        label="bounds at all n" if fixed else "bounds at all n: decide",
    )  # fmt: skip
    ax.plot(n, curve["rate"], color=BLUE, linewidth=1.4, label="share so far")
    if fixed is not None:
        last = float(curve["rate"].iloc[-1])
        ax.errorbar(
            [n[-1]], [last], yerr=arms(np.array([last]), [fixed[0]], [fixed[1]]), color=BLUE,
            marker="o", markersize=4, linewidth=2.2, capsize=5, label="exact bounds: decide",
        )  # fmt: skip
    if limit is not None:
        ax.axhline(limit, color=ORANGE, linewidth=1.2, linestyle="--", label="limit")
    legend_above(ax)
    top = float(np.max(curve["high"].to_numpy()[n >= min(30, n[-1])]))
    ax.set(xscale="log", xlabel="runs", ylabel="probability of a violation")
    top = min(1.0, 1.2 * max(top, limit or 0.0)) or 1.0
    ax.set_ylim(-0.03 * top, top)
    return figure


@draws
def fans(
    time: np.ndarray,
    signals: Mapping[str, np.ndarray],
    nominal: Mapping[str, np.ndarray],
    worst: Mapping[str, np.ndarray],
    *,
    limits: Mapping[str, Sequence[Limit]] = _NOTHING,
    units: Mapping[str, str] = _NOTHING,
    groups: Sequence[str] = (),
) -> Figure:
    """Bands that hold all, 90 % and 50 % of the runs, with the nominal and the worst run.

    Runs of different kinds make no band together: with `groups` each kind has its own, of 90 % of
    its runs, around its median.  Where a run has ended early it counts as lying beyond both ends
    of every band.

    Parameters
    ----------
    time : ndarray of shape (m,)
        Times of the samples (s).
    signals : mapping
        Samples of shape (runs, m) by name, NaN after a run has ended.
    nominal, worst : mapping
        Samples of shape (m,) by name.
    limits : mapping, optional
        Of the spec, by signal: value, and from when to when (s) it counts.
    units : mapping, optional
        By signal, where they are known.
    groups : sequence of str, optional
        The kind of each run.
    """
    lines = {"worst run": worst, "nominal": nominal}
    figure, _ = bands(time, signals, lines, limits=limits, units=units, groups=groups)
    return figure


Bands = Mapping[str, tuple[np.ndarray, np.ndarray]]
"""Lower and upper end of a band over time, by the signal that it is drawn with."""


@draws
def overlaid(
    before: tuple[np.ndarray, Mapping[str, np.ndarray]],
    after: tuple[np.ndarray, Mapping[str, np.ndarray]],
    unit: str = "",
    bands: tuple[Bands, Bands] = ({}, {}),
) -> Figure:
    """Signals over time before and after a change, a row for each that both have.

    Parameters
    ----------
    before, after : tuple of array of shape (m,) and mapping of str to array of shape (m,)
        Times (s), and samples by name; what is not finite is drawn as a gap.
    unit : str, optional
        Of all signals.
    bands : tuple of two mappings of str to two arrays of shape (m,), optional
        Bands of ensembles before and after, by signal; drawn where both have one.
    """
    names = [name for name in before[1] if name in after[1]]
    figure, axes = stacked_axes(rows=max(1, len(names)), height=1.9 if len(names) > 1 else 2.6)
    for ax, name in zip(axes, names, strict=False):
        if name in bands[0] and name in bands[1]:
            lower, upper = bands[0][name]
            ax.fill_between(before[0], lower, upper, color=GREY, alpha=0.3, linewidth=0)
            lower, upper = bands[1][name]
            ax.fill_between(
                after[0], lower, upper, facecolor="none", edgecolor=BLUE, hatch="////",
                linewidth=0.6, alpha=0.5,
            )  # fmt: skip
        ax.plot(before[0], before[1][name], color=GREY, linewidth=2.4, alpha=0.6, label="before")
        ax.plot(after[0], after[1][name], "--", color=BLUE, linewidth=1.4, label="after")
        ax.set_ylabel(plain(name) + (f" ({plain(unit)})" if unit else ""), parse_math=False)
    legend_above(axes[0])
    axes[-1].set_xlabel(TIME)
    return figure
