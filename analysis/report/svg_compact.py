"""An SVG of matplotlib's in fewer characters: the same picture, half the page."""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element, tostring

__all__ = ["compact", "shared_shape", "short_path"]

DECIMALS = re.compile(r"-?\d+\.\d{2,}")
NUMBER = re.compile(r"-?\d+(?:\.\d*)?")
CURVED = re.compile("[CQ]")
PLACE = re.compile(r"translate\((-?[\d.]+)[ ,](-?[\d.]+)\)")
STRAIGHT = re.compile(r"M[^MLCQz]*L?[^MLCQz]*")
INITIAL = {"stroke-linejoin": "miter", "stroke-dashoffset": "0"}  # what SVG has without them
FRAME = {"x", "y", "transform", "href", "clip-path"}  # of a mark: where it is; the rest is how


def compact(root: Element, shapes: dict[str, str]) -> None:
    """Shorten a drawing in place.

    Parameters
    ----------
    root : Element
        Without namespaces; styles are attributes, letters refer to `shapes`.
    shapes : dict
        Definition of each shape of the page, and its id; words and marks are added.
    """
    for element in root.iter():
        for name, value in INITIAL.items():
            if element.get(name) == value:
                del element.attrib[name]
        if element.tag == "use":
            _place(element)
    _unwrap(root)
    for parent in list(root.iter()):
        parent[:] = [child for child in parent if not _invisible(child)]
        _join_lines(parent)
    by_id = {name: text for text, name in shapes.items()}
    for element in list(root.iter()):
        if element.tag == "g" and _is_word(element):
            _share_word(element, shapes)
        elif element.tag == "use":
            _share_mark(element, shapes, by_id)
    for element in root.iter():
        if element.tag == "path" and "d" in element.attrib:
            element.set("d", short_path(element.attrib["d"]))


def shared_shape(text: str, shapes: dict[str, str]) -> str:
    """Return the id of a shape; a new one is added."""
    return shapes.setdefault(text, f"g:{len(shapes) + 1}")


def _place(use: Element) -> None:
    """Write a shift as x and y, without zeros."""
    shift = PLACE.fullmatch(use.get("transform", ""))
    if shift:
        del use.attrib["transform"]
        for name, value in zip("xy", shift.groups(), strict=True):
            use.set(name, value)
    for name in "xy":
        if float(use.get(name, "1")) == 0:
            del use.attrib[name]


def _unwrap(element: Element) -> None:
    """Put the content of groups that say nothing in their place."""
    children = []
    for child in element:
        _unwrap(child)
        children += list(child) if child.tag == "g" and not child.attrib else [child]
    element[:] = children


def _invisible(element: Element) -> bool:
    """Whether a path has neither line nor face."""
    style = element.attrib
    return element.tag == "path" and style.get("fill") == "none" and "stroke" not in style


def _join_lines(parent: Element) -> None:
    """Make one path of all straight lines of one look, such as those of a grid."""
    first: dict[tuple[tuple[str, str], ...], Element] = {}
    for child in list(parent):
        d = child.get("d", "")
        if child.tag != "path" or not STRAIGHT.fullmatch(" ".join(d.split())):
            continue
        if len(NUMBER.findall(d)) != 4 or "stroke-dasharray" in child.attrib:
            continue
        look = tuple((k, v) for k, v in child.attrib.items() if k != "d")
        if look in first:
            first[look].set("d", f"{first[look].get('d')} {d}")
            parent.remove(child)
        else:
            first[look] = child


def _is_word(group: Element) -> bool:
    letters = [child.tag == "use" and not set(child.attrib) - FRAME for child in group]
    return len(letters) > 1 and all(letters)


def _share_word(group: Element, shapes: dict[str, str]) -> None:
    """Make a word of several letters a shape: tick labels come again and again."""
    word = Element("g")
    word[:] = list(group)
    for letter in word:
        letter.tail = None
    name = shared_shape(tostring(word, encoding="unicode"), shapes)
    group[:] = []
    group.tag = "use"
    group.set("href", f"#{name}")


def _share_mark(use: Element, shapes: dict[str, str], by_id: dict[str, str]) -> None:
    """Give a mark that has a look of its own a shape with that look."""
    look = {name: value for name, value in use.attrib.items() if name not in FRAME}
    text = by_id.get(use.get("href", "")[1:], "")
    if not look or not text.startswith("<path "):
        return
    style = " ".join(f'{name}="{value}"' for name, value in look.items())
    use.set("href", f"#{shared_shape(text.replace('<path ', f'<path {style} ', 1), shapes)}")
    for name in look:
        del use.attrib[name]


def short_path(path: str) -> str:
    """Return path data in fewer characters: curves to a hundredth of a point, lines to a tenth.

    Lines are written as steps from point to point; rounding does not add up.
    """
    path = " ".join(path.split())
    if CURVED.search(path):
        return DECIMALS.sub(lambda m: f"{float(m[0]):.2f}".rstrip("0").rstrip("."), path)
    here = (0, 0)
    told = ""
    for part in re.findall(r"[MLz][^MLz]*", path):
        numbers = [round(10 * float(n)) for n in NUMBER.findall(part)]
        told += {"M": "m", "L": "l" if told.endswith("z") else "", "z": "z"}[part[0]]
        for x, y in zip(numbers[::2], numbers[1::2], strict=True):
            told += _tenths(x - here[0], told) + _tenths(y - here[1], "0")
            here = (x, y)
        if part[0] == "M":
            start = here
        elif part[0] == "z":
            here = start
    return told


def _tenths(number: int, before: str) -> str:
    """Return a number of tenths, with a space where it would run into what stands before it."""
    text = f"{number / 10:g}".replace("0.", ".", 1) if abs(number) < 10 else f"{number / 10:g}"
    return text if text[0] == "-" or not before[-1:].isdigit() else f" {text}"
