"""matplotlib figure -> inline SVG: the same bytes every time, in the page's colours."""

import io
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from itertools import takewhile
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, tostring

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl.drawing import picture
from nlctl.plotting import axes

from .document import Figure, Section
from .typography import plain_text

# Colours of the figures that follow the page's theme, by the page's own names for them.
THEME = {
    "#000000": "currentColor",
    picture.INK: "currentColor",
    picture.WIRE_GREY: "var(--soft)",
    picture.FILL: "var(--panel)",
    axes.GREY: "var(--soft)",
    axes.BLUE.lower(): "var(--blue)",
    axes.ORANGE.lower(): "var(--orange)",
    axes.GREEN.lower(): "var(--green)",
    axes.PURPLE.lower(): "var(--purple)",
}
LEAST_LETTERS = 11.2  # points: 9 px where a figure of WIDTH is as wide as a phone
_SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "nlctl",
    "svg.fonttype": "path",
    "font.size": LEAST_LETTERS,
}
_WIDE, BROAD = 400.0, 560.0  # points; as wide as the text, and as wide as the page
_DECIMALS = re.compile(r"-?\d+\.\d{2,}")
_PLACE = re.compile(r"translate\([^)]*\)|^[-\d.]+$")
TAG = re.compile(r"<(\w+)")
URL = re.compile(r"url\(#([^)]*)\)")

Drawn = Mapping[MatplotlibFigure, bytes]  # figures and their SVG files
NONE_DRAWN: Drawn = MappingProxyType({})


def inline_drawings(
    figures: Mapping[str, Figure], pool: Executor | None = None, drawn: Drawn = NONE_DRAWN
) -> tuple[dict[str, Markup], Markup]:
    """Return the figures of a page as inline SVG by their keys, and the shapes that they share."""
    files = svg_files([figure.figure for figure in figures.values()], pool, drawn)
    shapes: dict[str, str] = {}
    drawings = {
        key: svg(figure, file, key, shapes)
        for (key, figure), file in zip(figures.items(), files, strict=True)
    }
    return drawings, shapes_svg(shapes)


def svg_files(
    figures: Sequence[MatplotlibFigure], pool: Executor | None = None, drawn: Drawn = NONE_DRAWN
) -> list[bytes]:
    """Return figures as SVG files; this process and those of a pool share the work."""
    # Those in `drawn`, of `draw_ahead`, are not drawn again.
    files, left = dict(drawn), [figure for figure in figures if figure not in drawn]
    waiting = {} if pool is None else {figure: pool.submit(_svg_file, figure) for figure in left}
    for figure in reversed(left):  # a pool begins with the first one
        if waiting and not waiting[figure].cancel():
            break
        files[figure] = _svg_file(figure)
    return [files[f] if f in files else waiting[f].result() for f in figures]


def draw_ahead(sections: Iterable[Section], until: Callable[[], bool]) -> Drawn:
    """Draw figures while there is nothing else to do; return them as SVG files, see `svg_files`."""
    items = (item for section in sections for item in section.items)
    figures = (item.figure for item in items if isinstance(item, Figure))
    return {figure: _svg_file(figure) for figure in takewhile(lambda _: not until(), figures)}


def _svg_file(figure: MatplotlibFigure) -> bytes:
    buffer = io.BytesIO()
    with mpl.rc_context(_SETTINGS):
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    return buffer.getvalue()


def svg(figure: Figure, file: bytes, key: str, shapes: dict[str, str]) -> Markup:
    """Return a figure as inline SVG, the same bytes every time."""
    # Letters and markers are drawn from `shapes`, which all figures of a page share. Of the other
    # ids only those that are referred to stay, with `key` in front. Styles become attributes,
    # because the page's content policy forbids inline styles; ink, grey and fill take the page's
    # colours, so that dark pages work.
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
    looks = ["broad" if width > BROAD else "wide"] * (width > _WIDE)
    looks += ["diagram"] * isinstance(figure.figure, picture.Drawing)  # letters of its own size
    if looks:
        attributes["class"] = " ".join(looks)
    root.attrib = attributes | {k: v for k, v in root.attrib.items() if k != "version"}
    title = ElementTree.Element("title", id=f"{key}-title")
    description = ElementTree.Element("desc", id=f"{key}-desc")
    title.text, description.text = plain_text(figure.caption), plain_text(figure.description)
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
        attributes[name] = _PLACE.sub(lambda m: _rounded(m[0]), attributes[name])
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
    identifier = attributes.pop("id", None)
    if identifier in referred:
        attributes["id"] = f"{key}-{identifier}"
    for name, value in attributes.items():
        attributes[name] = URL.sub(rf"url(#{key}-\1)", value)


def _rounded(text: str) -> str:
    """Return a text with its numbers in hundredths, without zeros."""
    return _DECIMALS.sub(lambda m: f"{float(m[0]):.2f}".rstrip("0").rstrip("."), text)


def _local(name: str) -> str:
    """Return a name without its namespace."""
    return name.rpartition("}")[2]


_NUMBER = re.compile(r"-?\d+(?:\.\d*)?")
CURVED = re.compile("[CQ]")
_SHIFT = re.compile(r"translate\((-?[\d.]+)[ ,](-?[\d.]+)\)")
_STRAIGHT = re.compile(r"M[^MLCQz]*L?[^MLCQz]*")
INITIAL = {"stroke-linejoin": "miter", "stroke-dashoffset": "0"}  # what SVG has without them
FRAME = {"x", "y", "transform", "href", "clip-path"}  # of a mark: where it is; the rest is how


def compact(root: Element, shapes: dict[str, str]) -> None:
    """Shorten a drawing in place."""
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
    shift = _SHIFT.fullmatch(use.get("transform", ""))
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
        if child.tag != "path" or not _STRAIGHT.fullmatch(" ".join(d.split())):
            continue
        if len(_NUMBER.findall(d)) != 4 or "stroke-dasharray" in child.attrib:
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
    """Return path data in fewer characters: curves to a hundredth of a point, lines to a tenth."""
    # Lines are written as steps from point to point; rounding does not add up.
    path = " ".join(path.split())
    if CURVED.search(path):
        return _rounded(path)
    here = (0, 0)
    short = ""
    for part in re.findall(r"[MLz][^MLz]*", path):
        numbers = [round(10 * float(n)) for n in _NUMBER.findall(part)]
        short += {"M": "m", "L": "l" if short.endswith("z") else "", "z": "z"}[part[0]]
        for x, y in zip(numbers[::2], numbers[1::2], strict=True):
            short += _tenths(x - here[0], short) + _tenths(y - here[1], "0")
            here = (x, y)
        if part[0] == "M":
            start = here
        elif part[0] == "z":
            here = start
    return short


def _tenths(number: int, before: str) -> str:
    """Return a number of tenths, with a space where it would run into what stands before it."""
    text = f"{number / 10:g}".replace("0.", ".", 1) if abs(number) < 10 else f"{number / 10:g}"
    return text if text[0] == "-" or not before[-1:].isdigit() else f" {text}"
