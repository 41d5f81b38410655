"""Results -> matplotlib figures.  Nothing here writes a file or shows a window."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from nlctl.functions import nussbaum

from .lyapunov.long_run import LongRun
from .lyapunov.signals import Margin
from .reproduction import TAIL, Run

__all__ = [
    "actuator_path",
    "adaptation",
    "bounds",
    "burst",
    "control_input",
    "equality_residuals",
    "error_comparison",
    "inequality_margins",
    "long_zeta",
    "lyapunov_bound",
    "nussbaum_gain",
    "overview",
    "tracking",
    "tracking_error",
    "upper_states",
]

# Okabe-Ito: distinguishable for colour-blind readers; line styles distinguish as well.
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#6b7280"
STYLES = ((BLUE, "-"), (ORANGE, "--"), (GREEN, "-."), (PURPLE, ":"))
TIME = "time t (s)"


def _axes(rows: int = 1, height: float = 2.6) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(9.0, height * rows), layout="constrained")
    axes = list(np.ravel(figure.subplots(rows, 1, sharex=rows > 1)))
    for ax in axes:
        _style(ax)
        ax.margins(x=0.01)
    return figure, axes


def _style(ax: Axes) -> None:
    ax.grid(True, alpha=0.25, linewidth=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def _lines(ax: Axes, t: np.ndarray, curves: Mapping[str, np.ndarray]) -> None:
    for (label, y), (colour, style) in zip(curves.items(), STYLES, strict=False):
        ax.plot(t, y, style, color=colour, linewidth=1.4, label=label)
    if len(curves) > 1:
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def tracking(run: Run) -> Figure:
    """Output y against the reference yd."""
    figure, (ax,) = _axes()
    _lines(ax, run.time, {"$y$": run.signals["y"], "$y_d$": run.signals["yd"]})
    ax.set(xlabel=TIME, ylabel="output")
    return figure


def tracking_error(run: Run) -> Figure:
    """Tracking error e1, with the largest one of the last half marked."""
    figure, (ax,) = _axes()
    bound = run.metrics["tail_max_e"]
    _lines(ax, run.time, {"$e_1$": run.signals["e"]})
    ax.fill_between([TAIL, run.time[-1]], -bound, bound, color=GREY, alpha=0.15, linewidth=0)
    ax.annotate(
        f"±{bound:.4f}",
        (run.time[-1], bound),
        (-3, 3),
        textcoords="offset points",
        ha="right",
        color=GREY,
    )
    ax.set(xlabel=TIME, ylabel="tracking error $e_1$")
    return figure


def upper_states(run: Run) -> Figure:
    """The states x2, ..., xn."""
    figure, (ax,) = _axes()
    names = [f"x{i}" for i in range(2, 10) if f"x{i}" in run.signals]
    _lines(ax, run.time, {f"$x_{n[1:]}$": run.signals[n] for n in names})
    ax.set(xlabel=TIME, ylabel="state " + ", ".join(f"$x_{n[1:]}$" for n in names))
    return figure


def control_input(run: Run) -> Figure:
    """Control input u and what the actuator makes of it, v."""
    figure, (ax,) = _axes()
    _lines(ax, run.time, {"$u$": run.signals["u"], "$v$": run.signals["v"]})
    ax.set(xlabel=TIME, ylabel="input $u$, actuator output $v$")
    return figure


def actuator_path(run: Run) -> Figure:
    """The part of the actuator's characteristic that was travelled: v over u."""
    figure = Figure(figsize=(4.6, 3.6), layout="constrained")
    ax = figure.subplots()
    _style(ax)
    u, v = run.signals["u"], run.signals["v"]
    late = run.time >= TAIL
    ax.plot(u, v, "-", color=GREY, linewidth=0.9, label=f"t < {TAIL:g} s")
    ax.plot(u[late], v[late], "-", color=BLUE, linewidth=1.6, label=f"t ≥ {TAIL:g} s")
    ax.legend(frameon=False, loc="upper left")
    ax.set(xlabel="input $u$", ylabel="actuator output $v$")
    return figure


def nussbaum_gain(run: Run) -> Figure:
    """The argument zeta, and the gain N(zeta) that it gives."""
    figure, (top, bottom) = _axes(rows=2, height=1.9)
    zeta = run.signals["zeta"]
    _lines(top, run.time, {"$\\zeta$": zeta})
    _lines(bottom, run.time, {"$N(\\zeta)$": nussbaum(zeta)})
    top.set(ylabel="$\\zeta$")
    bottom.set(xlabel=TIME, ylabel="$N(\\zeta)$")
    return figure


def adaptation(run: Run) -> Figure:
    """Norm of the network's weights, and the estimate delta_hat."""
    figure, (ax,) = _axes()
    curves = {"$\\|\\hat W\\|$": run.signals["W_norm"], "$\\hat\\delta$": run.signals["delta_hat"]}
    _lines(ax, run.time, curves)
    ax.set(xlabel=TIME, ylabel="$\\|\\hat W\\|$, $\\hat\\delta$")
    return figure


def error_comparison(runs: Sequence[Run], labels: Sequence[str]) -> Figure:
    """Tracking errors of up to four runs above each other."""
    figure, (ax,) = _axes()
    _lines(ax, runs[0].time, dict(zip(labels, (run.signals["e"] for run in runs), strict=True)))
    ax.set(xlabel=TIME, ylabel="tracking error $e_1$")
    return figure


def overview(time: np.ndarray, signals: Mapping[str, np.ndarray]) -> Figure:
    """Tracking, input and Nussbaum argument of one run above each other."""
    figure, (top, middle, bottom) = _axes(rows=3, height=2.0)
    _lines(top, time, {"$y$": signals["y"], "$y_d$": signals["yd"], "$e_1$": signals["e"]})
    _lines(middle, time, {"$u$": signals["u"], "$v$": signals["v"]})
    _lines(bottom, time, {"$\\zeta$": signals["zeta"], "$\\hat\\delta$": signals["delta_hat"]})
    top.set(ylabel="output, error")
    middle.set(ylabel="input")
    bottom.set(xlabel=TIME, ylabel="$\\zeta$, $\\hat\\delta$")
    return figure


def burst(run: LongRun) -> Figure:
    """A long run until its gain loses the sign: zeta and |e|, and the end of both, with r and u."""
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    (whole, end), (error, signals) = figure.subplots(2, 2, sharex="col", width_ratios=(1.5, 1))
    time, s = run.time, run.signals
    for ax in (whole, end, error, signals):
        _style(ax)
    for ax, across in ((whole, time), (end, left := run.time[-1] + 1e-5 - time)):
        ax.axhline(run.lobe.high, color=GREY, linewidth=1.0, linestyle="--")
        ax.plot(across, s["zeta"], "-", color=BLUE, linewidth=1.4)
    for p, (colour, style) in zip(run.predictions, STYLES[2:], strict=False):
        for ax in (whole, error):
            ax.axvline(p.burst_by_balance, color=colour, linestyle=style, linewidth=1.6)
        label = f"foretold after {p.time:g} s, {100 * p.share:.2g} % of the lobe spent"
        whole.plot(p.time, p.zeta, "o", linestyle=style, color=colour, markersize=5, label=label)
    for ax in (whole, error):
        ax.axvline(run.burst, color=ORANGE, linewidth=1.6, label="happened")
    whole.legend(frameon=False, loc="lower center")
    error.semilogy(*envelope(time, np.abs(s["e"])), color=BLUE, linewidth=1.4)
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


def envelope(time: np.ndarray, y: np.ndarray, window: float = 4 * np.pi) -> np.ndarray:
    """Return the largest value of y in each whole window, at the middle of the windows."""
    number = np.floor((time - time[0]) / window).astype(int)
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    largest = np.maximum.reduceat(y, starts)
    return np.array([time[0] + (number[starts] + 0.5) * window, largest])[:, :-1]


def long_zeta(runs: Mapping[str, LongRun]) -> Figure:
    """The Nussbaum argument of long runs that do not burst, and where it is foretold to stop."""
    figure, (ax,) = _axes()
    for (label, run), (colour, style) in zip(runs.items(), STYLES, strict=False):
        ax.plot(run.time, run.signals["zeta"], style, color=colour, linewidth=1.4, label=label)
        for prediction in run.predictions[-1:]:
            if prediction.rest is not None:
                ax.axhline(prediction.rest, color=colour, linewidth=1.0, linestyle=":")
    ax.axhline(next(iter(runs.values())).lobe.high, color=GREY, linewidth=1.0, linestyle="--")
    ax.legend(frameon=False, loc="lower right")
    ax.set(xlabel=TIME, ylabel="$\\zeta$")
    return figure


def lyapunov_bound(t: np.ndarray, curves: Mapping[str, np.ndarray]) -> Figure:
    """V over time against what bounds it; a bound that is infinite is named in the legend."""
    figure, (ax,) = _axes()
    for (label, y), (colour, style) in zip(curves.items(), STYLES, strict=False):
        named = label if np.any(np.isfinite(y)) else f"{label}: infinite"
        ax.semilogy(t, np.where(y > 0, y, np.nan), style, color=colour, linewidth=1.4, label=named)
    _, top = ax.get_ylim()
    ax.set_ylim(max(ax.get_ylim()[0], 1e-5 * top), top)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.set(xlabel=TIME, ylabel="energy")
    return figure


def inequality_margins(margins: Sequence[Margin]) -> Figure:
    """Margin of each inequality over time, one panel each; a dot where it is least."""
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


def equality_residuals(margins: Sequence[Margin]) -> Figure:
    """Distance between the sides of each equation over its size, and the tolerance."""
    figure, axes = _panels(margins, sharey=True)
    for ax, margin in zip(axes, margins, strict=True):
        t, low = _least(margin.t, margin.margin)
        colour = BLUE if margin.holds else ORANGE
        ax.semilogy(t, np.maximum(-low / margin.scale, 1e-18), "-", color=colour, linewidth=1.1)
        ax.axhline(margin.tolerance, color=GREY, linewidth=1.0)
    return figure


def _panels(margins: Sequence[Margin], *, sharey: bool = False) -> tuple[Figure, list[Axes]]:
    """Three panels in a row, one for each margin, with its number as the title."""
    rows = -(-len(margins) // 3)
    figure = Figure(figsize=(9.0, 1.5 * rows + 0.3), layout="constrained")
    axes = list(np.ravel(figure.subplots(rows, 3, sharex=True, sharey=sharey, squeeze=False)))
    for ax in axes[len(margins) :]:
        ax.set_axis_off()
    for ax, margin in zip(axes, margins, strict=False):
        _style(ax)
        ax.set_title(margin.equation, fontsize=9, loc="left")
    for ax in axes[: len(margins)][-3:]:
        ax.set_xlabel(TIME)
        ax.tick_params(labelbottom=True)
    return figure, axes[: len(margins)]


def _least(t: np.ndarray, y: np.ndarray, count: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Return the least value of each of `count` stretches, NaN where one is, with its time."""
    pieces = np.array_split(np.arange(y.size), min(count, y.size))
    at = np.array([piece[int(np.argmin(y[piece]))] for piece in pieces])
    return t[at], y[at]


def bounds(values: Mapping[str, tuple[float, str]]) -> Figure:
    """Numbers with their kind as bars on a logarithmic axis, what is proved in a colour of its own.

    Kinds are "proved", "along this run" and "what happens"; numbers that are not finite are left
    out.
    """
    shown = {name: pair for name, pair in values.items() if np.isfinite(pair[0])}
    numbers = [number for number, _ in shown.values()]
    figure = Figure(figsize=(9.0, 0.3 * len(shown) + 0.6), layout="constrained")
    ax = figure.subplots()
    _style(ax)
    for kind, colour in (("proved", GREEN), ("along this run", BLUE), ("what happens", GREY)):
        places = [i for i, (_, own) in enumerate(shown.values()) if own == kind]
        bars = ax.barh(places, [numbers[i] for i in places], 0.55, color=colour, label=kind)
        ax.bar_label(bars, fmt="%.4g", padding=4)
    ax.set_yticks(range(len(shown)), list(shown))
    ax.set(xscale="log", xlim=(0.5 * min(numbers), 3 * max(numbers)))
    ax.invert_yaxis()
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure
