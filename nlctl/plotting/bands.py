"""Many runs over time: bands of quantiles, single runs, limits."""

from collections import Counter
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..annotations import as_annotated
from .axes import BLUE, ORANGE, STYLES, TEXT_INK, TIME, legend_above, plain, stacked_axes

BANDS = ((0.0, 1.0, 0.2), (0.05, 0.95, 0.35), (0.25, 0.75, 0.6))  # quantiles, opacity
LINES = ("-", "--", "-.", ":")  # of single runs
LIMIT = "limit of the spec"
Limit = tuple[float, float, float]
_NOTHING: Mapping[str, Any] = MappingProxyType({})
STRETCHES = 240  # of time, in which the ends of a band are drawn as lines


def bands(
    time: np.ndarray,
    signals: Mapping[str, np.ndarray],
    lines: Mapping[str, Mapping[str, np.ndarray]] = _NOTHING,
    *,
    limits: Mapping[str, Sequence[Limit]] = _NOTHING,
    units: Mapping[str, str] = _NOTHING,
    groups: Sequence[str] = (),
    figure: Figure | None = None,
) -> tuple[Figure, list[Axes]]:
    """Draw bands that hold all, 90 % and 50 % of the runs, and single runs as lines."""
    # `signals` are samples of shape (runs, m) by name, NaN after a run has ended, `lines`
    # single runs by label with samples of shape (m,) by name. With `groups`, the kind of each
    # run, each kind has a band of its own. A figure that is given is empty; its size is set.
    height = 1.9 if len(signals) > 1 else 2.6
    figure, axes = stacked_axes(rows=len(signals), height=height, figure=figure)
    nodes = np.unique(np.linspace(0, time.size - 1, STRETCHES + 1).astype(int))
    for ax, (name, samples) in zip(axes, signals.items(), strict=True):
        bounds = tuple(limits.get(name, ()))
        drawn = [samples, *(np.atleast_2d(line[name]) for line in lines.values())]
        low, high = _range(np.concatenate(drawn), [value for value, *_ in bounds])
        if groups:
            _kinds(ax, time, samples, groups, (low, high), nodes)
        else:
            for start, end, opacity in BANDS:
                band = np.clip(_band(samples, start, end, nodes), low, high)
                inside = f"{100 * (end - start):.0f} % of the runs"
                ax.fill_between(
                    time[nodes], *band, color=BLUE, alpha=opacity, linewidth=0, label=inside
                )
        for k, (label, line) in enumerate(lines.items()):
            style, shown = LINES[k % len(LINES)], np.clip(line[name], low, high)
            ax.plot(time, shown, style, color=TEXT_INK, linewidth=1.2, label=label)
        for value, start, end in bounds:
            ax.hlines(value, start, end, color=ORANGE, linewidth=1.6, alpha=0.8, label=LIMIT)
        unit = units.get(name, "")
        ax.set_ylabel(plain(name) + (f" ({plain(unit)})" if unit else ""), parse_math=False)
    _one_legend(axes)
    axes[-1].set_xlabel(TIME)
    return figure, axes


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
        rows = samples[kinds == name]
        band = np.clip(_band(rows, 0.05, 0.95, nodes), *ends)
        ax.fill_between(time[nodes], *band, color=colour, alpha=0.25, linewidth=0)
        middle = np.clip(quantile(rows, 0.5, np.inf)[nodes], *ends)
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
    """Return values at some samples so that the lines between them lie nowhere below `y`."""
    # Shapes: `y` (m,), `nodes` (k,).
    most = np.maximum.reduceat(y, nodes[:-1])
    most[-1] = max(most[-1], y[-1])
    return np.maximum(np.append(most[0], most), np.append(most, most[-1]))


def _range(samples: np.ndarray, limits: Sequence[float]) -> tuple[float, float]:
    """Return the range that is drawn: of all samples, unless few of them lie far outside."""
    # Limits are in it, unless they lie so far away that the samples would be a line.
    finite = samples[np.isfinite(samples)]
    if not finite.size:
        return -1.0, 1.0
    inner = np.quantile(finite, (0.005, 0.995))
    spread = float(inner[1] - inner[0]) or 1.0
    low, high = max(finite.min(), inner[0] - spread), min(finite.max(), inner[1] + spread)
    near = [x for x in limits if inner[0] - 2 * spread <= x <= inner[1] + 2 * spread]
    return float(min([low, *near])), float(max([high, *near]))
