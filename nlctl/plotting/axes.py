"""What all figures share: colours, line styles, axes."""

import re
import unicodedata
from collections.abc import Mapping
from functools import cache
from typing import Any

import control as ct
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font

_LONGEST = 30


def plain(name: object) -> str:
    """Return a name as text that the font can draw, cut to a length that fits a figure."""
    # Use it with ``parse_math=False``. Tables show names in full.
    text = "".join(_drawn(character) for character in str(name))
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 12]}…{text[-11:]}"


@cache
def _drawn(character: str) -> str:
    """Return a character, or a box where the font lacks it or it only steers others."""
    if unicodedata.category(character)[0] == "C":
        return "□"
    font = get_font(findfont(FontProperties()))
    return character if font.get_char_index(ord(character)) else "□"


# Okabe-Ito, with a darker purple: distinguishable for colour-blind readers; line styles, markers or
# hatches distinguish as well.  One colour has one meaning in all figures:
#   BLUE           what a figure is about: the output, what was found, after a change
#   PURPLE, GREEN  the second and the third of several of a kind: signals, options, ways to search
#   GREY           what it is compared with: the reference, before a change, 0
#   TEXT_INK            single runs over bands, and the best so far: the colour of the text
#   ORANGE         a limit, and what violates it: a violation, a burst, a run that was lost
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#B3558A", "#6b7280"
TEXT_INK = "#000000"
STYLES = ((BLUE, "-"), (PURPLE, "--"), (GREEN, "-."), (GREY, ":"))  # of several of a kind
TIME = "time t (s)"
WIDTH = 6.2  # in, with letters that can still be read on a phone
_MARKUP = re.compile(r"[\\${}_^]")  # of a formula, no letters
LINE, SHORT_LINE = 54, 36  # characters that a legend above the axes has room for


def stacked_axes(
    rows: int = 1, height: float = 2.4, figure: Figure | None = None
) -> tuple[Figure, list[Axes]]:
    """Return a figure with axes above each other, which share their horizontal axis."""
    if figure is None:
        figure = Figure(layout="constrained")
    figure.set_size_inches(WIDTH, height * rows)
    axes = list(np.ravel(figure.subplots(rows, 1, sharex=rows > 1)))
    for ax in axes:
        set_style(ax)
        ax.margins(x=0.01)
    return figure, axes


def control_plot(figure: Figure, axes: list[Axes]) -> ct.ControlPlot:
    """Return what plots of python-control return, of axes above each other."""
    lines = np.empty((len(axes), 1), dtype=object)
    for k, ax in enumerate(axes):
        lines[k, 0] = list(ax.lines)
    return ct.ControlPlot(lines, np.array(axes)[:, None], figure)


def set_style(ax: Axes) -> None:
    """Give axes a grid behind what is drawn, and no frame."""
    ax.set_axisbelow(True)
    ax.grid(True, alpha=0.25, linewidth=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def draw_lines(ax: Axes, t: np.ndarray, curves: Mapping[str, np.ndarray]) -> None:
    """Draw up to four signals over time, with a legend above them if there are several."""
    for (label, y), (colour, style) in zip(curves.items(), STYLES, strict=False):
        ax.plot(t, y, style, color=colour, linewidth=1.4, label=label)
    if len(curves) > 1:
        legend_above(ax)


def legend_above(
    ax: Axes | Figure, shown: Mapping[str, Any] | None = None, line: int = LINE
) -> None:
    """Put the legend above axes, or above all of a figure, where it hides nothing."""
    if shown is None and isinstance(ax, Axes):
        handles, labels = ax.get_legend_handles_labels()
    else:
        labels, handles = list(shown or ()), list((shown or {}).values())
    if not labels:
        return
    widest = max(len(_MARKUP.sub("", label)) for label in labels) + 6
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0)}
    if isinstance(ax, Figure):
        place = {"loc": "outside upper left"}
    ax.legend(
        handles,
        labels,
        **place,
        ncols=max(1, min(len(labels), line // widest)),
        frameon=False,
        borderaxespad=0.2,
        columnspacing=1.4,
    )
