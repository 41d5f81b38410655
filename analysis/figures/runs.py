"""Figures of many runs: their margins, how sure one is after how many, and their signals.

A run violates the spec unless its margin is > 0: NaN, and margins of runs that did not reach their
end, are drawn as violations.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from nlctl.annotations import as_annotated

from ..robustness.stl.spec import violates
from .axes import (
    BLUE,
    GREY,
    ORANGE,
    PURPLE,
    SHORT_LINE,
    STYLES,
    TIME,
    WIDTH,
    legend_above,
    set_style,
    stacked_axes,
)
from .labels import arms, plain

__all__ = [
    "CLIP",
    "LIMIT",
    "Limit",
    "clipped_margins",
    "fans",
    "margins_figure",
    "most_frequent",
    "quantile",
    "running_estimate",
]

CLIP = 2.0
"""Margins below -CLIP are drawn at -CLIP: beyond, how far says little."""
BANDS = ((0.0, 1.0, 0.2), (0.05, 0.95, 0.35), (0.25, 0.75, 0.6))  # quantiles, opacity
LIMIT = "limit of the spec"
Limit = tuple[float, float, float]
_NOTHING: Mapping[str, Any] = MappingProxyType({})
STRETCHES = 240  # of time, in which the ends of a band are drawn as lines


def clipped_margins(values: object) -> np.ndarray:
    """Return margins as they are drawn: clipped at -CLIP, NaN there as well."""
    y = np.asarray(values, dtype=float)
    return np.maximum(np.where(np.isnan(y), -np.inf, y), -CLIP)


@as_annotated
def margins_figure(values: np.ndarray) -> Figure:
    """How many runs have which margin, and the share of runs with at most that margin.

    Parameters
    ----------
    values : ndarray of shape (runs,)
        Margins; those of runs that ended early are drawn at the edge.

    Returns
    -------
    Figure
        Of matplotlib; nothing is written or shown.
    """
    figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
    counts, part = figure.subplots(1, 2)
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
        set_style(ax)
    counts.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


@as_annotated
def running_estimate(
    curve: pd.DataFrame,
    limit: float | None = None,
    fixed: tuple[float, float] | None = None,
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

    Returns
    -------
    Figure
        Of matplotlib; nothing is written or shown.
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


@as_annotated
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

    Returns
    -------
    Figure
        Of matplotlib; nothing is written or shown.
    """
    figure, axes = stacked_axes(rows=len(signals), height=1.9 if len(signals) > 1 else 2.6)
    nodes = np.unique(np.linspace(0, time.size - 1, STRETCHES + 1).astype(int))
    for ax, (name, samples) in zip(axes, signals.items(), strict=True):
        own = tuple(limits.get(name, ()))
        lines = np.array([nominal[name], worst[name]])
        low, high = _range(np.concatenate([samples, lines]), [value for value, *_ in own])
        if groups:
            _kinds(ax, time, samples, groups, (low, high), nodes)
        else:
            for start, end, opacity in BANDS:
                band = np.clip(_band(samples, start, end, nodes), low, high)
                inside = f"{100 * (end - start):.0f} % of the runs"
                ax.fill_between(
                    time[nodes], *band, color=BLUE, alpha=opacity, linewidth=0, label=inside
                )
        ax.plot(time, np.clip(worst[name], low, high), "--", color=PURPLE, label="worst run")
        ax.plot(time, np.clip(nominal[name], low, high), color=GREY, label="nominal")
        for value, start, end in own:
            ax.hlines(value, start, end, color=ORANGE, linewidth=1.6, alpha=0.8, label=LIMIT)
        unit = units.get(name, "")
        ax.set_ylabel(plain(name) + (f" ({plain(unit)})" if unit else ""), parse_math=False)
    _one_legend(axes)
    axes[-1].set_xlabel(TIME)
    return figure


def _kinds(
    ax: Axes,
    time: np.ndarray,
    samples: np.ndarray,
    groups: Sequence[str],
    ends: tuple[float, float],
    nodes: np.ndarray,
) -> None:
    """Draw a band and a median for each of the kinds that there are most runs of."""
    kinds = np.asarray(groups, dtype=object)
    for name, (colour, style) in zip(most_frequent(groups), STYLES, strict=False):
        own = samples[kinds == name]
        band = np.clip(_band(own, 0.05, 0.95, nodes), *ends)
        ax.fill_between(time[nodes], *band, color=colour, alpha=0.25, linewidth=0)
        middle = np.clip(quantile(own, 0.5, np.inf)[nodes], *ends)
        ax.plot(time[nodes], middle, style, color=colour, linewidth=1.3, label=plain(name))


@as_annotated
def most_frequent(groups: Sequence[str]) -> list[str]:
    """Return the kinds of runs that `fans` shows: at most as many as there are line styles.

    Parameters
    ----------
    groups : sequence of str
        The kind of each run.

    Returns
    -------
    list of str
        The most frequent first.
    """
    return [name for name, _ in Counter(groups).most_common(len(STYLES))]


def _band(samples: np.ndarray, start: float, end: float, nodes: np.ndarray) -> np.ndarray:
    """Return both ends of a band of quantiles at the nodes; nothing between them is outside."""
    lower = -upper_envelope(-quantile(samples, start, -np.inf), nodes)
    return np.array([lower, upper_envelope(quantile(samples, end, np.inf), nodes)])


def _one_legend(axes: Sequence[Axes]) -> None:
    """Put one legend above the first axes, with everything that any of them shows once."""
    shown = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            shown.setdefault(label, handle)
    legend_above(axes[0], shown)


@as_annotated
def quantile(samples: np.ndarray, part: float, missing: float) -> np.ndarray:
    """Return a quantile over the runs (axis 0), one of their values; NaN counts as `missing`.

    It is the next value outwards: upwards if `missing` is positive, otherwise downwards.

    Parameters
    ----------
    samples : ndarray of shape (runs, ...)
        One row for each run.
    part : float
        Of the runs, between 0 and 1.
    missing : float
        What NaN counts as; its sign says which way is outwards.

    Returns
    -------
    ndarray of shape (...)
        In the unit of the samples.
    """
    ordered = np.sort(np.where(np.isnan(samples), missing, samples), axis=0)
    place = part * (len(ordered) - 1)
    return ordered[int(np.ceil(place) if missing > 0 else np.floor(place))]


def upper_envelope(y: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return values at some samples so that the lines between them lie nowhere below `y`.

    Shapes: `y` (m,), `nodes` (k,).
    """
    most = np.maximum.reduceat(y, nodes[:-1])
    most[-1] = max(most[-1], y[-1])
    return np.maximum(np.append(most[0], most), np.append(most, most[-1]))


def _range(samples: np.ndarray, limits: Sequence[float]) -> tuple[float, float]:
    """Return the range that is drawn: of all samples, unless few of them lie far outside.

    Limits are in it, unless they lie so far away that the samples would be a line.
    """
    finite = samples[np.isfinite(samples)]
    if not finite.size:
        return -1.0, 1.0
    inner = np.quantile(finite, (0.005, 0.995))
    spread = float(inner[1] - inner[0]) or 1.0
    low, high = max(finite.min(), inner[0] - spread), min(finite.max(), inner[1] + spread)
    near = [x for x in limits if inner[0] - 2 * spread <= x <= inner[1] + 2 * spread]
    return float(min([low, *near])), float(max([high, *near]))
