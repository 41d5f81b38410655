"""What is drawn on a page, read from its HTML: whether two pages have the same picture."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from xml.etree import ElementTree

__all__ = ["drawings"]

_SHAPES = re.compile(r'<svg class="shapes".*?</svg>', re.DOTALL)
_FIGURE = re.compile(r'<figure id="([^"]*)"><div class="drawing".*?(<svg .*?</svg>)', re.DOTALL)


def drawings(page: Path) -> dict[str, str]:
    """Return a key of every drawing of a page by its anchor; none of a page that is not there.

    Letters and marks are shared by all figures of a page, and numbered: they count by what they
    are.
    """
    try:
        text = page.read_text(encoding="utf-8", errors="replace")
        shapes = _SHAPES.search(text)
        known = {} if shapes is None else _by_name(ElementTree.fromstring(shapes[0]))
        return {
            anchor: _key(ElementTree.fromstring(drawn), known, anchor)
            for anchor, drawn in _FIGURE.findall(text)
        }
    except (OSError, ElementTree.ParseError):
        return {}


def _by_name(shapes: ElementTree.Element) -> dict[str, str]:
    """Return what each shape is, words in letters."""
    every = {e.get("id", ""): e for e in shapes.iter() if e.get("id")}
    letters: dict[str, str] = {}
    for _ in range(2):  # words are made of letters, and come before or after them
        for name, element in every.items():
            plain = [
                (
                    part.tag,
                    sorted((k, letters.get(v[1:], v)) for k, v in part.attrib.items() if k != "id"),
                )
                for part in element.iter()
            ]
            letters[name] = hashlib.sha256(repr(plain).encode()).hexdigest()
    return letters


def _key(drawn: ElementTree.Element, shapes: dict[str, str], anchor: str) -> str:
    """Return a key of one drawing, whatever is said of it and whatever its anchor is."""
    plain = []
    for part in drawn.iter():
        if part.tag in ("title", "desc"):
            continue
        attributes = {k: v for k, v in part.attrib.items() if not k.startswith("aria-")}
        told = [(k, shapes.get(v[1:], v.replace(anchor, ""))) for k, v in attributes.items()]
        plain.append((part.tag, sorted(told)))
    return hashlib.sha256(repr(plain).encode()).hexdigest()
