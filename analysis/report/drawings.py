"""What is drawn on a page, read from its HTML: whether two pages have the same picture."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

_SHAPE = re.compile(
    r'<(?:path|g) id="(g:\d+)"(.*?)(?=<(?:path|g) id="g:|</defs>)', re.DOTALL
)  # letters, words and marks that all figures of a page share, numbered as they came
_FIGURE = re.compile(r'<figure id="([^"]*)"><div class="drawing".*?(<svg .*?</svg>)', re.DOTALL)
_WORDS = re.compile(r"<(title|desc)[ >].*?</\1>", re.DOTALL)
_USED = re.compile(r'"#(g:\d+)"')


def drawings(page: Path) -> dict[str, str]:
    """Return a key of every drawing of a page by its anchor; none of a page that is not there."""
    # Shared shapes count by what they are, words about a figure do not count.
    try:
        text = page.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    shapes = dict(_SHAPE.findall(text[text.rfind('<svg class="shapes"') :]))
    letters = {name: _digest(drawn) for name, drawn in shapes.items()}  # words are made of them
    shapes = {name: _digest(_with_shapes(drawn, letters)) for name, drawn in shapes.items()}
    return {
        anchor: _digest(_with_shapes(_WORDS.sub("", drawn), shapes).replace(f'"{anchor}-', '"'))
        for anchor, drawn in _FIGURE.findall(text)
    }


def _with_shapes(drawn: str, shapes: dict[str, str]) -> str:
    return _USED.sub(lambda match: f'"{shapes.get(match[1], "")}"', drawn)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
