"""matplotlib figure -> inline SVG: the same bytes every time, in the page's colours."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from itertools import takewhile
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl import drawing

from ..figures import axes
from .document import Figure, Section
from .svg_compact import compact, shared_shape, short_path
from .typography import plain

__all__ = ["draw_ahead", "shapes_svg", "svg", "svg_files"]

# Colours of the figures that follow the page's theme, by the page's own names for them.
THEME = {
    "#000000": "currentColor",
    drawing.INK: "currentColor",
    drawing.GREY: "var(--soft)",
    drawing.FILL: "var(--panel)",
    axes.GREY: "var(--soft)",
    axes.BLUE.lower(): "var(--blue)",
    axes.ORANGE.lower(): "var(--orange)",
    axes.GREEN.lower(): "var(--green)",
    axes.PURPLE.lower(): "var(--purple)",
}
SETTINGS: dict[Any, Any] = {"svg.hashsalt": "nlctl", "svg.fonttype": "path", "font.size": 9.0}
WIDE, BROAD = 400.0, 560.0  # points; as wide as the text, and as wide as the page
DECIMALS = re.compile(r"-?\d+\.\d{2,}")
PLACE = re.compile(r"translate\([^)]*\)|^[-\d.]+$")
TAG = re.compile(r"<(\w+)")
URL = re.compile(r"url\(#([^)]*)\)")

Drawn = Mapping[MatplotlibFigure, bytes]  # figures and their SVG files
NONE_DRAWN: Drawn = MappingProxyType({})


def svg_files(
    figures: Sequence[MatplotlibFigure],
    pool: Executor | None = None,
    drawn: Drawn = NONE_DRAWN,
) -> list[bytes]:
    """Return figures as SVG files; this process and those of a pool share the work.

    Those in `drawn`, of `draw_ahead`, are not drawn again.
    """
    files, left = dict(drawn), [figure for figure in figures if figure not in drawn]
    waiting = {} if pool is None else {figure: pool.submit(_svg_file, figure) for figure in left}
    for figure in reversed(left):  # a pool begins with the first one
        if waiting and not waiting[figure].cancel():
            break
        files[figure] = _svg_file(figure)
    return [files[f] if f in files else waiting[f].result() for f in figures]


def draw_ahead(sections: Iterable[Section], until: Callable[[], bool]) -> Drawn:
    """Draw figures while there is nothing else to do; return them as SVG files, see `svg_files`.

    Parameters
    ----------
    sections : iterable of Section
    until : callable
        Asked before each figure whether to end.
    """
    items = (item for section in sections for item in section.items)
    figures = (item.figure for item in items if isinstance(item, Figure))
    return {figure: _svg_file(figure) for figure in takewhile(lambda _: not until(), figures)}


def _svg_file(figure: MatplotlibFigure) -> bytes:
    buffer = io.BytesIO()
    with mpl.rc_context(SETTINGS):
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    return buffer.getvalue()


def svg(figure: Figure, file: bytes, key: str, shapes: dict[str, str]) -> Markup:
    """Return a figure as inline SVG, the same bytes every time.

    Letters and markers are drawn from `shapes`, which all figures of a page share.  Of the other
    ids only those that are referred to stay, with `key` in front.  Styles become attributes,
    because the page's content policy forbids inline styles; ink, grey and fill take the page's
    colours, so that dark pages work.

    Parameters
    ----------
    figure : Figure
    file : bytes
        What `svg_files` made of it.
    key : str
        Unique on the page.
    shapes : dict
        Definition of each shape, and its id; new ones are added.
    """
    root = ElementTree.fromstring(file)
    for element in root.iter():
        _plain(element)
    shared = _share(root, shapes)
    referred = {name for e in root.iter() for v in e.attrib.values() for name in URL.findall(v)}
    for element in root.iter():
        _rename(element, key, shared, referred)
    compact(root, shapes)
    attributes = {"role": "img", "aria-labelledby": f"{key}-title {key}-desc"}
    width = float(root.get("width", "0pt").removesuffix("pt"))
    if width > WIDE:
        attributes["class"] = "broad" if width > BROAD else "wide"
    root.attrib = attributes | {k: v for k, v in root.attrib.items() if k != "version"}
    title = ElementTree.Element("title", id=f"{key}-title")
    description = ElementTree.Element("desc", id=f"{key}-desc")
    title.text, description.text = plain(figure.caption), plain(figure.description)
    root[:] = [title, description, *root]
    return Markup(ElementTree.tostring(root, encoding="unicode"))


def shapes_svg(shapes: Mapping[str, str]) -> Markup:
    """Return the shapes that the figures of a page are drawn from, as an SVG without size."""
    named = "".join(TAG.sub(rf'<\1 id="{name}"', text, count=1) for text, name in shapes.items())
    return Markup(
        f'<svg class="shapes" aria-hidden="true" width="0" height="0"><defs>{named}</defs></svg>'
    )


def _plain(element: ElementTree.Element) -> None:
    """Drop namespaces, styles and addresses; set colours of the theme."""
    element.tag = _local(element.tag)
    attributes = {_local(name): value for name, value in element.attrib.items()}
    for rule in attributes.pop("style", "").split(";"):
        name, colon, value = rule.partition(":")
        if colon:
            attributes[name.strip()] = value.strip()
    target = attributes.pop("href", "")
    if target.startswith(("#", "data:image/png;")):
        attributes["href"] = "".join(target.split())
    for name in {"x", "y", "transform"} & attributes.keys():
        attributes[name] = PLACE.sub(lambda m: DECIMALS.sub(_hundredths, m[0]), attributes[name])
    if attributes.get("fill") == "#ffffff" and "stroke" in attributes:
        attributes["fill"] = "var(--page)"  # frames of legends, faces of markers; not white text
    element.attrib = {
        name: THEME.get(value.lower(), " ".join(value.split()))
        for name, value in attributes.items()
    }
    element.text = None  # letters are paths
    element.tail = "\n"


def _share(root: ElementTree.Element, shapes: dict[str, str]) -> dict[str, str]:
    """Move letters and markers to the shapes of the page; return their ids, old and new."""
    shared = {}
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in ("metadata", "style"):
                parent.remove(child)
            elif parent.tag == "defs" and child.tag == "path":
                parent.remove(child)
                old = child.attrib.pop("id", "")
                child.set("d", short_path(child.get("d", "")))
                shared[old] = shared_shape(ElementTree.tostring(child, encoding="unicode"), shapes)
    for parent in list(root.iter()):
        parent[:] = [child for child in parent if child.tag != "defs" or len(child)]
    return shared


def _rename(
    element: ElementTree.Element, key: str, shared: Mapping[str, str], referred: set[str]
) -> None:
    """Make ids and the references to them those of the page."""
    attributes = element.attrib
    if attributes.get("href", "").startswith("#"):
        target = attributes.pop("href")[1:]
        if target in shared:
            attributes["href"] = f"#{shared[target]}"
    own = attributes.pop("id", None)
    if own in referred:
        attributes["id"] = f"{key}-{own}"
    for name, value in attributes.items():
        attributes[name] = URL.sub(rf"url(#{key}-\1)", value)


def _hundredths(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")


def _local(name: str) -> str:
    """Return a name without its namespace."""
    return name.rpartition("}")[2]
