"""Names that users give, as labels of figures: harmless to draw, and of bounded length."""

from __future__ import annotations

import unicodedata
from functools import cache

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
