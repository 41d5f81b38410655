"""Figures of the paper's runs: signals over time, and the actuator's characteristic."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nlctl.functions import nussbaum
from nlctl.plotting.axes import (
    BLUE,
    GREY,
    ORANGE,
    SHORT_LINE,
    STYLES,
    TIME,
    WIDTH,
    draw_lines,
    legend_above,
    set_style,
    stacked_axes,
)

from ..reproductions.paper import PaperRun
from . import TAIL
from .burst import Burst

# of the controllers on computers
SAMPLED_CONTROLLERS = ("paper", "sliding mode", "PID", "certified")


def _one(time: np.ndarray, curves: Mapping[str, np.ndarray], label: str) -> Figure:
    """Draw up to four signals into one pair of axes."""
    figure, (ax,) = stacked_axes()
    draw_lines(ax, time, curves)
    ax.set(xlabel=TIME, ylabel=label)
    return figure


def tracking(run: PaperRun) -> Figure:
    """Output y against the reference yd."""
    figure, (ax,) = stacked_axes()
    ax.plot(run.time, run.signals["yd"], "--", color=GREY, linewidth=1.4, label="$y_d$")
    ax.plot(run.time, run.signals["y"], "-", color=BLUE, linewidth=1.4, label="$y$")
    legend_above(ax)
    ax.set(xlabel=TIME, ylabel="output")
    return figure


def tracking_error(run: PaperRun) -> Figure:
    """Tracking error e1, with the largest one of the last half marked."""
    figure, (ax,) = stacked_axes()
    bound = run.metrics["tail_max_e"]
    draw_lines(ax, run.time, {"$e_1$": run.signals["e"]})
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


def upper_states(run: PaperRun) -> Figure:
    """The states x2, ..., xn."""
    numbers = [i for i in range(2, 10) if f"x{i}" in run.signals]
    curves = {f"$x_{i}$": run.signals[f"x{i}"] for i in numbers}
    return _one(run.time, curves, "state " + ", ".join(curves))


def control_input(run: PaperRun) -> Figure:
    """Control input u and what the actuator makes of it, v."""
    curves = {"$u$": run.signals["u"], "$v$": run.signals["v"]}
    return _one(run.time, curves, "input $u$, actuator output $v$")


def actuator_path(run: PaperRun) -> Figure:
    """The part of the actuator's characteristic that was travelled: v over u."""
    figure = Figure(figsize=(4.6, 3.6), layout="constrained")
    ax = figure.subplots()
    set_style(ax)
    u, v = run.signals["u"], run.signals["v"]
    late = run.time >= TAIL
    ax.plot(u, v, "-", color=GREY, linewidth=0.9, label=f"t < {TAIL:g} s")
    ax.plot(u[late], v[late], "-", color=BLUE, linewidth=1.6, label=f"t ≥ {TAIL:g} s")
    ax.legend(frameon=False, loc="upper left")
    ax.set(xlabel="input $u$", ylabel="actuator output $v$")
    return figure


def nussbaum_gain(run: PaperRun) -> Figure:
    """The argument zeta, and the gain N(zeta) that it gives."""
    figure, (top, bottom) = stacked_axes(rows=2, height=1.9)
    zeta = run.signals["zeta"]
    draw_lines(top, run.time, {"$\\zeta$": zeta})
    draw_lines(bottom, run.time, {"$N(\\zeta)$": nussbaum(zeta)})
    top.set(ylabel="$\\zeta$")
    bottom.set(xlabel=TIME, ylabel="$N(\\zeta)$")
    return figure


def adaptation(run: PaperRun) -> Figure:
    """Norm of the network's weights, and the estimate delta_hat."""
    curves = {"$\\|\\hat W\\|$": run.signals["W_norm"], "$\\hat\\delta$": run.signals["delta_hat"]}
    return _one(run.time, curves, ", ".join(curves))


def after_burst(burst: Burst) -> Figure:
    """Example 2 through its burst: r and u over zeta, and the error afterwards."""
    figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
    through, late = figure.subplots(1, 2, width_ratios=(1.25, 1))
    zeta = burst.signals["zeta"]
    for ax in (through, late):
        set_style(ax)
    for (name, label), (colour, style) in zip(
        (("r", "$|r|$"), ("u", "$|u|$")), STYLES, strict=False
    ):
        y = np.abs(burst.signals[name])
        through.semilogy(
            zeta, np.where(y > 0, y, np.nan), style, color=colour, linewidth=1.4, label=label
        )
    for end in (burst.bounds.wrong.low, burst.bounds.wrong.high):
        through.axvline(end, color=GREY, linewidth=1.0, linestyle="--")
    through.set(xlabel="$\\zeta$", ylim=(1e-2, None))
    legend_above(through)
    for (K, e), (colour, style) in zip(burst.late.items(), STYLES, strict=False):
        late.plot(burst.late_time, e, style, color=colour, linewidth=1.2, label=f"$N = -{K:g}$")
    legend_above(late, line=SHORT_LINE // 2)
    late.set(xlabel="time after the burst (s)", ylabel="$e_1$")
    return figure


def error_comparison(runs: Sequence[PaperRun], labels: Sequence[str]) -> Figure:
    """Tracking errors of up to four runs above each other."""
    curves = dict(zip(labels, (run.signals["e"] for run in runs), strict=True))
    return _one(runs[0].time, curves, "tracking error $e_1$")


def sampling_errors(record: pd.DataFrame, titles: Mapping[str, str], band: float) -> Figure:
    """Largest late errors against the sampling time, a panel for each example."""
    figure, axes = stacked_axes(rows=len(titles), height=2.2)
    shown: dict[str, object] = {}
    for ax, (example, title) in zip(axes, titles.items(), strict=True):
        part: Any = record[(record["example"] == example) & (record["quantity"] == "dt")]
        for label, (colour, style) in zip(SAMPLED_CONTROLLERS, STYLES, strict=True):
            line = part[part["controller"] == label].sort_values("value")
            good = line["error"].notna().to_numpy()
            last = int(np.argmin(good)) if not good.all() else good.size
            x, y = 1e3 * line["value"].to_numpy()[:last], line["error"].to_numpy()[:last]
            (shown[label],) = ax.plot(x, y, style, color=colour, linewidth=1.4)
            if 0 < last < good.size:
                ax.plot(x[-1:], y[-1:], "x", color=colour, markersize=7)
        ax.axhline(band, color=ORANGE, linewidth=1.2, linestyle="--")
        ax.set(xscale="log", yscale="log", ylim=(5e-3, 10), ylabel=f"{title}: $|y - y_d|$")
    axes[-1].set(xlabel="sampling time (ms)")
    legend_above(axes[0], shown)
    return figure
