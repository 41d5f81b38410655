"""Figures that rank quantities and controllers: one line each; and a study over its revisions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from nlctl.plotting.axes import BLUE, GREY, LINE, ORANGE, PURPLE, SHORT_LINE, legend_above, plain

from .labels import arms, drawable, draws, number_axes, panels, within_reach


@draws
def screening(effects: pd.DataFrame) -> Figure:
    """Mean magnitude of the effects of each quantity with its interval, and their deviation.

    Parameters
    ----------
    effects : pandas.DataFrame
        As `elementary_effects` returns it, a row for each quantity.
    """
    effects = effects.sort_values("mu_star", ascending=False, kind="stable")
    effects = drawable(effects, "mu_star", "low", "high", "sigma")
    figure, ax = number_axes(effects.index)
    _bar(ax, effects, ("mu_star", "low", "high"), BLUE, "$\\mu^*$, mean magnitude")
    at = np.arange(len(effects))
    ax.plot(effects["sigma"], at, "D", color=PURPLE, markersize=5, label="$\\sigma$, deviation")
    legend_above(ax, line=SHORT_LINE)
    ax.set_xlabel("effect: change of the response per width of the box")
    return figure


@draws
def shares(indices: pd.DataFrame) -> Figure:
    """Shares of the variance: of each quantity by itself, and with all its interactions.

    Parameters
    ----------
    indices : pandas.DataFrame
        As `sobol_indices` returns them, a row for each quantity.
    """
    indices = indices.sort_values("ST", ascending=False, kind="stable")
    indices = drawable(indices, "S1", "S1_low", "S1_high", "ST", "ST_low", "ST_high")
    figure, ax = number_axes(indices.index)
    _bar(ax, indices, ("S1", "S1_low", "S1_high"), BLUE, "$S_1$, by itself", -0.18)
    _bar(ax, indices, ("ST", "ST_low", "ST_high"), PURPLE, "$S_T$, with interactions", 0.18, "///")
    legend_above(ax, line=SHORT_LINE)
    ax.set_xlabel("share of the variance (1)")
    return figure


@draws
def tornado(effects: pd.DataFrame, value: float) -> Figure:
    """What each quantity does to a number at either end of its box, by derivatives and by runs.

    Parameters
    ----------
    effects : pandas.DataFrame
        A row for each quantity: changes ``low``, ``high`` by derivatives, ``run_low``,
        ``run_high`` by runs.
    value : float
        The number at the nominal values.
    """
    reach = effects[["low", "high"]].abs().max(axis=1).fillna(-1.0)
    order = np.argsort(-reach.to_numpy(), kind="stable")
    effects = drawable(effects, "low", "high", "run_low", "run_high").iloc[order]
    value = float(within_reach(value))
    figure, ax = number_axes(effects.index)
    figure.set_figheight(figure.get_figheight() + 0.4)
    at, ends = np.arange(len(effects)), (("low", PURPLE, "v", "///"), ("high", BLUE, "^", ""))
    wide = 3.0 * float(effects[["low", "high"]].abs().max(axis=None, skipna=True)) or 1.0
    for end, colour, marker, hatch in ends:
        name = "lower end" if end == "low" else "upper end"
        ax.barh(
            at, effects[end].to_numpy(), 0.6, left=value, color=colour, hatch=hatch,
            edgecolor="white", label=f"derivative, {name}", alpha=0.85,
        )  # fmt: skip
        runs = np.clip(effects[f"run_{end}"].to_numpy(dtype=float), -wide, wide)
        ax.plot(
            value + runs, at, marker, color=colour, markeredgecolor="black", markersize=6,
            label=f"run, {name}",
        )  # fmt: skip
    ax.axvline(value, color=GREY, linewidth=1.0, linestyle="--")
    legend_above(ax, line=SHORT_LINE + 8)
    ax.set_xlabel("value (nominal: dashed)")
    return figure


@draws
def set_apart(table: pd.DataFrame) -> Figure:
    """How far failing runs lie from passing ones in each quantity.

    Parameters
    ----------
    table : pandas.DataFrame
        A row for each quantity, with the column ``statistic``.
    """
    table = table.sort_values("statistic", ascending=False, kind="stable")
    figure, ax = number_axes(table.index)
    ax.barh(np.arange(len(table)), within_reach(table["statistic"]), 0.6, color=BLUE)
    ax.set(xlabel="distance between failing and passing runs (1)", xlim=(0.0, 1.0))
    return figure


@draws
def violation_rates(ranking: pd.DataFrame) -> Figure:
    """Share of violations of each option with its interval.

    Parameters
    ----------
    ranking : pandas.DataFrame
        A row for each option, with its rate and the interval.
    """
    figure, ax = number_axes(ranking.index)
    shares = drawable(ranking, "rate", "rate_low", "rate_high")
    _bar(ax, shares, ("rate", "rate_low", "rate_high"), ORANGE, "", hatch="///")
    ax.set(xlabel="share of runs that violate the spec", xlim=(0.0, 1.02))
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    return figure


@draws
def paired_differences(table: pd.DataFrame, labels: Sequence[str], quantity: str) -> Figure:
    """Median paired differences with their intervals; what is infinite is drawn at the edge.

    Parameters
    ----------
    table : DataFrame
        Columns median, median_low, median_high.
    labels : sequence of str
        One for each row of `table`.
    quantity : str
        Name of the axis.
    """
    figure, ax = number_axes(labels)
    exact = table["median"].to_numpy(dtype=float)
    numbers = within_reach(table[["median", "median_low", "median_high"]])
    reach = float(np.max(np.abs(numbers), initial=0.0, where=~np.isnan(numbers))) or 1.0
    middle, low, high = numbers.T
    at = np.arange(len(table))
    ax.hlines(at, low, high, color=BLUE)
    for infinite, marker in ((exact == -np.inf, "<"), (exact == np.inf, ">")):
        ax.plot(middle[infinite], at[infinite], marker, color=ORANGE, markersize=7)
    inside = np.isfinite(exact)
    ax.plot(middle[inside], at[inside], "o", color=BLUE, markersize=5)
    ax.axvline(0.0, color=GREY, linewidth=1.0, linestyle="--")
    ax.set_xlim(-1.05 * reach, 1.05 * reach)
    ax.xaxis.set_major_locator(MaxNLocator(5))
    ax.set_xlabel(quantity, parse_math=False)
    return figure


def _bar(
    ax: Axes,
    table: pd.DataFrame,
    columns: tuple[str, str, str],
    colour: str,
    label: str,
    shift: float = 0.0,
    hatch: str = "",
) -> None:
    """Draw a bar for each row, with its interval."""
    value, low, high = (table[column].to_numpy(dtype=float) for column in columns)
    at = np.arange(len(table)) + shift
    height = 0.34 if shift else 0.6
    ax.barh(at, value, height, color=colour, hatch=hatch, edgecolor="white", label=label or None)
    ax.errorbar(
        value,
        at,
        xerr=arms(value, low, high),
        fmt="none",
        ecolor="black",
        elinewidth=1.2,
        capsize=2,
    )


_LOOKS = {  # how a claim ended: colour, marker, word
    "holds": (BLUE, "o", "holds"),
    "open": (GREY, "D", "open"),
    "fails": (ORANGE, "X", "fails or is refuted"),
}
ROW, PANEL, _FRAME = 0.3, 1.1, 0.9  # in
_MOST = 20  # labels of revisions


@draws
def trend(
    labels: Sequence[str],
    claims: Mapping[str, Sequence[str]],
    numbers: Mapping[str, Sequence[float]],
) -> Figure:
    """Marks for claims, and a line for each number, over revisions.

    Parameters
    ----------
    labels : sequence of str
        The revisions, the oldest first.
    claims : mapping of str to sequence of str
        By name how each claim ended: ``"holds"``, ``"open"``, ``"fails"``, or nothing where it was
        not made.
    numbers : mapping of str to sequence of float
        By name; what is not finite is a gap.
    """
    heights = [_FRAME / 2 + ROW * len(claims)] * bool(claims) + [PANEL] * len(numbers)
    shape = {"sharex": True, "height_ratios": heights or None}
    figure, rows = panels(sum(heights) + _FRAME, max(1, len(heights)), **shape)
    at = np.arange(len(labels))
    if claims:
        _marks(rows.pop(0), claims)
    for ax, (name, row) in zip(rows, numbers.items(), strict=False):
        ax.plot(at, np.asarray(row, dtype=float), "-o", color=BLUE, markersize=4, linewidth=1.4)
        ax.set_title(plain(name), loc="left", fontsize="medium", parse_math=False)
        ax.yaxis.set_major_locator(MaxNLocator(3))
        ax.margins(y=0.2)
    last = figure.axes[-1]
    last.set_xlim(-0.4, len(labels) - 0.6)
    step = -(-len(labels) // _MOST)  # of very many not each has its label
    turned = max(map(len, labels), default=0) * len(labels) > LINE
    last.set_xticks(
        at[::step],
        [plain(x) for x in labels[::step]],
        parse_math=False,
        rotation=90 if turned else 0,
    )
    return figure


def _marks(ax: Axes, claims: Mapping[str, Sequence[str]]) -> None:
    """Draw a row of marks for each claim, the first one at the top."""
    drawn: dict[str, Any] = {}
    for row, ends in enumerate(claims.values()):
        for place, end in enumerate(ends):
            if end in _LOOKS:
                colour, marker, word = _LOOKS[end]
                (drawn[word],) = ax.plot([place], [row], marker, color=colour, markersize=7)
    ax.set_yticks(range(len(claims)), [plain(name) for name in claims], parse_math=False)
    ax.set_ylim(len(claims) - 0.5, -0.5)
    legend_above(ax, drawn)
