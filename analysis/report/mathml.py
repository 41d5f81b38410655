"""LaTeX -> MathML, through a whitelist: what is not known to be harmless is shown as its source."""

import base64
import re
import unicodedata
from functools import cache
from importlib.resources import files
from xml.etree import ElementTree

from latex2mathml.converter import convert_to_element
from markupsafe import Markup

from .document import Equation

ELEMENTS = frozenset(
    (
        *("math", "mfrac", "mi", "mn", "mo", "mover", "mpadded", "mphantom", "mroot", "mrow"),
        *("mspace", "msqrt", "mstyle", "msub", "msubsup", "msup", "mtable", "mtd", "mtext", "mtr"),
        *("munder", "munderover"),
    )
)
ATTRIBUTES = frozenset(
    (
        *("accent", "accentunder", "columnspan", "depth", "display", "displaystyle", "fence"),
        *("form", "height", "largeop", "linebreak", "linethickness", "lspace", "mathvariant"),
        *("maxsize", "minsize", "movablelimits", "rowspan", "rspace", "scriptlevel", "separator"),
        *("stretchy", "symmetric", "voffset", "width"),
    )
)
IGNORED = frozenset(["mathbackground", "mathcolor", "xmlns"])  # the page has its own colours
ACCENTS = {"^": "ˆ", "~": "˜", "¯": "¯", "˙": "˙", "¨": "¨", "→": "→"}
UPRIGHT = frozenset("ΓΔΘΛΞΠΣΥΦΨΩ")
COMBINING = {"ˆ": "\u0302", "˜": "\u0303", "¯": "\u0304", "˙": "\u0307", "¨": "\u0308"}
_BINARY = frozenset("=≤≥<>+−-∈±→")
_SIGNS = frozenset("+−±-")
_CLOSING = frozenset(")]}⟩‖|!…")
OPERANDS = frozenset(["mfrac", "mi", "mn", "mover", "msqrt", "msub", "msubsup", "msup"])
THIN, _WIDE = "0.167em", "0.8em"
FUNCTION = re.compile("[A-Za-z]{2,}")


class NotMathError(ValueError):
    """An element or attribute that has no place in a formula."""


def mathml(equation: Equation) -> Markup:
    """Return a formula as MathML; one that cannot be read or trusted, as its LaTeX source."""
    return inline(equation.latex, "block")


def inline(latex: str, display: str = "inline") -> Markup:
    """Return a formula inside a line of text; else as `mathml`."""
    root = _tree(latex, display)
    if root is None:
        return Markup("<code>{}</code>").format(latex)
    return Markup(ElementTree.tostring(root, encoding="unicode"))


def spoken(latex: str) -> str:
    """Return the letters and signs of a formula in a row: V̇ ≤ −α_1 V."""
    root = _tree(latex, "inline")
    return latex if root is None else unicodedata.normalize("NFC", " ".join(_letters(root).split()))


def _letters(element: ElementTree.Element) -> str:
    parts = [_letters(child) for child in element]
    if element.tag == "mover" and len(parts) == 2:
        return parts[0] + COMBINING.get(parts[1].strip(), parts[1])
    if element.tag in ("msub", "msup", "msubsup") and len(parts) > 1:
        marks = {"msub": "_", "msup": "^", "msubsup": "_^"}[element.tag]
        scripts = (p.strip() if len(p.strip()) < 4 else f"({p.strip()})" for p in parts[1:])
        letters = (mark + script for mark, script in zip(marks, scripts, strict=True))
        return f"{parts[0].rstrip()}{''.join(letters)}"
    if element.tag == "mspace":
        return " "
    if element.tag == "mfrac":
        return "/".join(parts)
    if element.tag == "msqrt":
        return f"√({''.join(parts)})"
    text = element.text or ""
    if element.tag == "mo" and text == ",":
        return ", "
    spaced = element.tag == "mo" and text in _BINARY and element.get("form") != "prefix"
    row = f" {text} " if spaced else text + "".join(parts)
    return f"−{row[3:]}" if row.startswith(" − ") and parts else row  # the sign of the first term


def _tree(latex: str, display: str) -> ElementTree.Element | None:
    """Return a formula as elements that are on the lists; None if it is another formula."""
    try:
        root = convert_to_element(latex, display=display)
        for element in root.iter():
            _check(element)
    except Exception:  # the parser fails in many ways, and none may cost the report
        return None
    for element in list(root.iter()):
        _accent(element)
        _set_row(element)
    return root


def _check(element: ElementTree.Element) -> None:
    """Refuse what is not on the lists; make text of character references."""
    if element.tag not in ELEMENTS:
        raise NotMathError(f"<{element.tag}> is not an element of a formula")
    for name in list(element.attrib):
        value = element.attrib.pop(name)
        if name == "columnalign" and value in ("left", "right"):
            element.set("class", value)  # Chromium aligns cells by CSS only
        elif name in ATTRIBUTES:
            element.set(name, value)
        elif name not in IGNORED:
            raise NotMathError(f"'{name}' is not an attribute of a formula")
    if element.text:
        element.text = re.sub(
            "&#x([0-9A-F]{4,6});", lambda match: chr(int(match[1], 16)), element.text
        )
    if element.tag in ("mi", "mo") and (element.text or "").startswith("\\"):
        raise NotMathError(f"{element.text} is an unknown command")
    if element.tag == "mo" and FUNCTION.fullmatch(element.text or ""):
        element.tag = "mi"  # names like min are no operators
    if element.tag == "mi" and (element.text or "") in UPRIGHT:
        element.set("mathvariant", "normal")


def _accent(element: ElementTree.Element) -> None:
    """Say that a hat is a hat, so that it sits on its letter; keep scripts off hats and ∫."""
    if element.tag == "mover" and len(element) == 2 and element[1].text in ACCENTS:
        element.set("accent", "true")
        element[1].text = ACCENTS[element[1].text]
        if element[0].tag == "mi":
            element[1].set("stretchy", "false")
    if element.tag in ("msup", "msubsup"):
        lean = {"mover": THIN, "∫": _WIDE}.get(element[0].text or element[0].tag)
        if lean:
            high = ElementTree.Element("mrow")
            high.extend([ElementTree.Element("mspace", width=lean), element[-1]])
            element[-1] = high


def _set_row(row: ElementTree.Element) -> None:
    """Set signs that belong to their number close to it, and names of functions apart."""
    if row.tag not in ("math", "mrow", "mtd", "mstyle"):
        return
    parts = list(row)
    for place in range(len(parts) - 1, 0, -1):
        before, here = parts[place - 1], parts[place]
        if here.tag == "mo" and here.text in _SIGNS and _opens(before):
            here.set("form", "prefix")
        name, last = _name(here), _name(before)
        if (name and before.tag not in ("mo", "mspace")) or (last and _is_operand(here)):
            row.insert(place, ElementTree.Element("mspace", width=THIN))


def _opens(element: ElementTree.Element) -> bool:
    return element.tag == "mo" and element.text not in _CLOSING


def _is_operand(element: ElementTree.Element) -> bool:
    """Whether an element is a number, a symbol or a word, and not in brackets."""
    is_row = element.tag == "mrow" and len(element) > 0
    return (element[0] if is_row else element).tag in OPERANDS


def _name(element: ElementTree.Element) -> bool:
    """Whether an element is the name of a function, perhaps with an exponent."""
    if element.tag in ("msup", "msub") and len(element):
        return _name(element[0])
    return element.tag == "mi" and bool(FUNCTION.fullmatch(element.text or ""))


FAMILY = "nlctl Math"  # a changed STIX font must not be called STIX
FILE = "fonts/nlctl-math.woff2"


@cache
def font_face() -> str:
    """Return the CSS rule that holds the whole font, so that the page fetches nothing."""
    data = base64.b64encode(files("nlctl.analysis.report").joinpath(FILE).read_bytes()).decode()
    return (
        f'@font-face {{ font-family: "{FAMILY}"; '
        f'src: url("data:font/woff2;base64,{data}") format("woff2"); }}\n'
    )
