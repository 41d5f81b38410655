"""Names that users give, as labels of figures: harmless to draw, and of bounded length."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font

from .axes import WIDTH, set_style

__all__ = ["arms", "number_axes", "plain"]

_LONGEST = 30


def plain(name: object) -> str:
    """Return a name as text that the font can draw, cut to a length that fits a figure.

    Use it with ``parse_math=False``.  Tables show names in full.
    """
    text = "".join(_drawn(character) for character in str(name))
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 12]}…{text[-11:]}"


@cache
def _drawn(character: str) -> str:
    """Return a character, or a box where the font lacks it or it only steers others."""
    if unicodedata.category(character)[0] == "C":
        return "□"
    font = get_font(findfont(FontProperties()))
    return character if font.get_char_index(ord(character)) else "□"


def number_axes(names: Iterable[object]) -> tuple[Figure, Axes]:
    """Return axes with one line for each name, from the top: names may be alike once cut."""
    labels = [plain(name) for name in names]
    figure = Figure(figsize=(WIDTH, 0.32 * len(labels) + 0.9), layout="constrained")
    ax = figure.subplots()
    set_style(ax)
    ax.set_yticks(np.arange(len(labels)), labels, parse_math=False)
    ax.set_ylim(len(labels) - 0.4, -0.6)
    return figure, ax


def arms(value: np.ndarray, low: object, high: object) -> np.ndarray:
    """Return the lengths of error bars; a bootstrap interval may lie beside its estimate."""
    return np.maximum([value - np.asarray(low), np.asarray(high) - value], 0.0)
