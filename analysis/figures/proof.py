"""Figures of the proof: long runs, V and its bounds, margins."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from nlctl.annotations import as_annotated
from nlctl.plotting.axes import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SHORT_LINE,
    STYLES,
    TIME,
    legend_above,
    stacked_axes,
)

from ..lyapunov.loop.signals import Margin
from ..lyapunov.nussbaum.long_run import LongRun
from .labels import draws, panels


@draws
def burst(run: LongRun) -> Figure:
    """A long run until its gain loses the sign: zeta and |e|, and the end of both, with r and u.

    Parameters
    ----------
    run : LongRun
        A run that ends in a burst.
    """
    figure, axes = panels(4.6, 2, 2, sharex="col", width_ratios=(1.25, 1))
    whole, end, error, signals = axes
    time, s = run.time, run.signals
    for ax, across in ((whole, time), (end, left := run.time[-1] + 1e-5 - time)):
        ax.axhline(run.lobe.high, color=GREY, linewidth=1.0, linestyle="--")
        ax.plot(across, s["zeta"], "-", color=BLUE, linewidth=1.4)
    for p, (colour, style) in zip(run.predictions, STYLES[2:], strict=False):
        for ax in (whole, error):
            ax.axvline(p.burst, color=colour, linestyle=style, linewidth=1.6)
        label = f"predicted after {p.time:g} s, {100 * p.share:.2g} % of the lobe spent"
        whole.plot(p.time, p.zeta, "o", linestyle=style, color=colour, markersize=5, label=label)
    for ax in (whole, error):
        ax.axvline(run.burst, color=ORANGE, linewidth=1.6, label="happened")
    shown_above = dict(zip(*whole.get_legend_handles_labels()[::-1], strict=True))
    legend_above(figure, shown_above)
    error.semilogy(*windowed_maximum(time, np.abs(s["e"])), color=BLUE, linewidth=1.4)
    shown = left <= 100.0
    for (name, label), (colour, style) in zip(
        (("e", "$|e_1|$"), ("r", "$|r|$"), ("u", "$|u|$")), STYLES, strict=False
    ):
        signals.loglog(
            left[shown], np.abs(s[name][shown]), style, color=colour, linewidth=1.2, label=label
        )
    signals.set(xlim=(100.0, 1e-5), ylim=(1e-3, None), xlabel="time left until the end (s)")
    signals.legend(frameon=False, loc="upper left")
    end.set_ylim(float(np.min(s["zeta"][shown])) - 0.01, run.lobe.high + 0.05)
    whole.set(ylabel="$\\zeta$")
    error.set(xlabel=TIME, ylabel="largest $|e_1|$ per period")
    return figure


@draws
def story(time: np.ndarray, y: np.ndarray, yd: np.ndarray, run: LongRun | None) -> Figure:
    """The paper in one picture: the output follows, and zeta drifts until N changes its sign.

    Parameters
    ----------
    time : ndarray of shape (m,)
        In s.
    y, yd : ndarray of shape (m,)
        Output and reference.
    run : LongRun or None
        The same loop until its burst; without it only the output is drawn.
    """
    figure, axes = panels(2.3) if run is None else panels(4.2, 2)
    axes[0].plot(time, yd, "--", color=GREY, linewidth=1.6, label="reference $y_d$")
    axes[0].plot(time, y, "-", color=BLUE, linewidth=1.4, label="output $y$")
    legend_above(axes[0])
    axes[0].set(xlabel=TIME)
    axes[0].margins(x=0.01)
    if run is not None:
        _drifting(axes[1], run)
    return figure


def _drifting(ax: Axes, run: LongRun) -> None:
    """Draw zeta until its burst, if it bursts, and where the gain has which sign."""
    zeta, last = run.signals["zeta"], run.time[-1]
    high = run.lobe.high
    ax.plot(run.time, zeta, "-", color=BLUE, linewidth=1.6, label="argument $\\zeta$ of the gain")
    ax.axhline(high, color=GREY, linewidth=1.0, linestyle="--")
    ax.annotate(
        f"$\\zeta$ = {high:g}: the gain changes its sign", (0, high), (3, 4),
        textcoords="offset points", color=GREY,
    )  # fmt: skip
    if np.isfinite(run.burst):
        ax.plot([run.burst], [high], "o", color=ORANGE, markersize=6, clip_on=False)
        ax.annotate(
            f"burst at {run.burst:.0f} s", (run.burst, high), (-6, 5), textcoords="offset points",
            color=ORANGE, ha="right",
        )  # fmt: skip
    ax.set_xlim(-0.01 * last, 1.01 * last)
    ax.set_ylim(float(np.min(zeta[run.time <= run.time[-1] / 2])) - 0.15, high + 0.35)
    legend_above(ax)
    ax.set(xlabel=TIME)


@as_annotated
def windowed_maximum(time: np.ndarray, y: np.ndarray, window: float = 4 * np.pi) -> np.ndarray:
    """Return the largest value of y in each whole window, at the middle of the windows.

    Parameters
    ----------
    time : ndarray of shape (m,)
        Times (s).
    y : ndarray of shape (m,)
        Samples.
    window : float, optional
        Length of a window (s).

    Returns
    -------
    ndarray of shape (2, k)
        Middles of the windows (s), and the largest values.
    """
    number = np.floor((time - time[0]) / window).astype(int)
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    largest = np.maximum.reduceat(y, starts)
    return np.array([time[0] + (number[starts] + 0.5) * window, largest])[:, :-1]


@draws
def long_zeta(runs: Mapping[str, LongRun]) -> Figure:
    """The Nussbaum argument of long runs that do not burst, and where it is predicted to stop.

    Parameters
    ----------
    runs : mapping
        `LongRun` by the name of the loop.
    """
    figure, (ax,) = stacked_axes()
    for (label, run), (colour, style) in zip(runs.items(), STYLES, strict=False):
        ax.plot(run.time, run.signals["zeta"], style, color=colour, linewidth=1.4, label=label)
        for prediction in run.predictions[-1:]:
            if prediction.rest is not None:
                ax.axhline(prediction.rest, color=colour, linewidth=1.0, linestyle=":")
    ax.axhline(next(iter(runs.values())).lobe.high, color=GREY, linewidth=1.0, linestyle="--")
    ax.legend(frameon=False, loc="lower right")
    ax.set(xlabel=TIME, ylabel="$\\zeta$")
    return figure


@draws
def lyapunov_bound(t: np.ndarray, curves: Mapping[str, np.ndarray]) -> Figure:
    """V over time against what bounds it; a bound that is infinite is named in the legend.

    Parameters
    ----------
    t : ndarray of shape (m,)
        Times (s).
    curves : mapping
        V and its bounds by name, each of shape (m,).
    """
    figure, (ax,) = stacked_axes()
    for (label, y), (colour, style) in zip(curves.items(), STYLES, strict=False):
        named = label if np.any(np.isfinite(y)) else f"{label}: infinite"
        ax.semilogy(t, np.where(y > 0, y, np.nan), style, color=colour, linewidth=1.4, label=named)
    _, top = ax.get_ylim()
    ax.set_ylim(max(ax.get_ylim()[0], 1e-5 * top), top)
    legend_above(ax)
    ax.set(xlabel=TIME, ylabel="$V$ and its bounds")
    return figure


@draws
def inequality_margins(margins: Sequence[Margin]) -> Figure:
    """Margin of each inequality over time, one panel each; a dot where it is least.

    Parameters
    ----------
    margins : sequence of Margin
        Those of inequalities, over the samples of one run.
    """
    figure, axes = _panels(margins)
    for ax, margin in zip(axes, margins, strict=True):
        t, low = _least(margin.t, margin.margin)
        largest = float(np.nanmax(np.abs(low), initial=0.0)) or 1.0
        ax.set_yscale("symlog", linthresh=1e-3 * largest)
        powers = 10.0 ** (np.floor(np.log10(largest)) + np.array([-2.0, 0.0]))
        ax.yaxis.set_major_locator(FixedLocator([*-powers[::-1], 0.0, *powers]))
        ax.axhline(0.0, color=GREY, linewidth=0.8)
        colour = BLUE if margin.holds else ORANGE
        ax.scatter([margin.at], [margin.least], s=16, color=colour, zorder=3, clip_on=False)
        ax.plot(t, low, "-", color=colour, linewidth=1.1)
    return figure


@draws
def equality_residuals(margins: Sequence[Margin]) -> Figure:
    """Distance between the sides of each equation over its size, and the tolerance.

    Parameters
    ----------
    margins : sequence of Margin
        Those of equations, over the samples of one run.
    """
    figure, axes = _panels(margins, sharey=True)
    for ax, margin in zip(axes, margins, strict=True):
        t, low = _least(margin.t, margin.margin)
        colour = BLUE if margin.holds else ORANGE
        ax.semilogy(t, np.maximum(-low / margin.scale, 1e-18), "-", color=colour, linewidth=1.1)
        ax.axhline(margin.tolerance, color=GREY, linewidth=1.0)
    return figure


def _panels(margins: Sequence[Margin], *, sharey: bool = False) -> tuple[Figure, list[Axes]]:
    """Two panels in a row, one for each margin, with its number as the title."""
    rows = -(-len(margins) // 2)
    figure, axes = panels(1.45 * rows + 0.3, rows, 2, sharex=True, sharey=sharey)
    for ax in axes[len(margins) :]:
        ax.set_axis_off()
    for ax, margin in zip(axes, margins, strict=False):
        ax.set_title(margin.equation, fontsize="medium", loc="left")
    for ax in axes[: len(margins)][-2:]:
        ax.set_xlabel(TIME)
        ax.tick_params(labelbottom=True)
    return figure, axes[: len(margins)]


def _least(t: np.ndarray, y: np.ndarray, count: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Return the least value of each of `count` stretches, NaN where one is, with its time."""
    pieces = np.array_split(np.arange(y.size), min(count, y.size))
    at = np.array([piece[int(np.argmin(y[piece]))] for piece in pieces])
    return t[at], y[at]


@draws
def bounds(values: Mapping[str, tuple[float, str]]) -> Figure:
    """Numbers with their kind as bars on a logarithmic axis, what is proved in a colour of its own.

    Kinds are "proved", "along this run" and "what happens"; numbers that are not finite are left
    out.

    Parameters
    ----------
    values : mapping
        Number and its kind by name.
    """
    shown = {name: pair for name, pair in values.items() if np.isfinite(pair[0])}
    numbers = [number for number, _ in shown.values()]
    figure, (ax,) = panels(0.3 * len(shown) + 0.6)
    for kind, colour in (("proved", GREEN), ("along this run", BLUE), ("what happens", GREY)):
        places = [i for i, (_, group) in enumerate(shown.values()) if group == kind]
        bars = ax.barh(places, [numbers[i] for i in places], 0.55, color=colour, label=kind)
        ax.bar_label(bars, fmt="%.4g", padding=4)
    ax.set_yticks(range(len(shown)), list(shown))
    ax.set(xscale="log", xlim=(0.5 * min(numbers), 3 * max(numbers)), xlabel="$|r|$")
    ax.invert_yaxis()
    legend_above(ax, line=SHORT_LINE)
    return figure
