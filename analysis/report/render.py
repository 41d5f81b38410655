"""Report -> one self-contained HTML file, and ``report.json`` beside it.

Text is escaped by Jinja2.  The only markup that passes unescaped is what this module makes
itself: figures drawn by matplotlib and formulas from the LaTeX in our own source.
"""

from __future__ import annotations

import html
import io
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from jinja2 import Environment, PackageLoader, StrictUndefined
from latex2mathml.converter import convert
from markupsafe import Markup

from nlctl import drawing
from nlctl._files import replace_file

from .. import figures
from .document import Equation, Figure, Paragraph, Report, Table

__all__ = ["render_html", "render_json", "write_report"]

# Colours of the figures that follow the page's theme, by the page's own names for them.
THEME = {
    "#000000": "currentColor",
    drawing.INK: "currentColor",
    drawing.GREY: "var(--soft)",
    drawing.FILL: "var(--panel)",
    figures.GREY: "var(--soft)",
}
SVG_SETTINGS: dict[Any, Any] = {"svg.hashsalt": "nlctl", "svg.fonttype": "path", "font.size": 9.0}


def svg(figure: Figure) -> Markup:
    """Return a figure as inline SVG, the same bytes every time.

    Ids get the figure's key in front, so that figures on one page do not refer to each other's
    parts; ink, grey and fill take the page's colours, so that dark pages work.
    """
    buffer = io.StringIO()
    with mpl.rc_context(SVG_SETTINGS):
        figure.figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{figure.key}-', text)
    text = re.sub(r'(href="|url\()#', rf"\g<1>#{figure.key}-", text)
    for colour, themed in THEME.items():
        text = text.replace(colour, themed)
    head = f'<svg role="img" aria-labelledby="{figure.key}-title {figure.key}-desc" '
    names = (
        f'<title id="{figure.key}-title">{html.escape(figure.caption)}</title>'
        f'<desc id="{figure.key}-desc">{html.escape(figure.description)}</desc>'
    )
    text = re.sub(r"<svg ([^>]*)>", lambda m: f"{head}{m.group(1)}>{names}", text, count=1)
    return Markup(text)


def mathml(equation: Equation) -> Markup:
    """Return a formula as MathML."""
    return Markup(convert(equation.latex, display="block"))


def cell(value: Any) -> str:
    """Return a table cell's text: numbers with the digits that a reader can use."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)


def _kind(item: object) -> str:
    return type(item).__name__.lower()


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("analysis.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"svg": svg, "mathml": mathml, "cell": cell, "kind": _kind}
    return environment


def render_html(report: Report) -> str:
    """Return the report as one HTML page without references to anything outside."""
    return _environment().get_template("report.html").render(report=report)


def render_json(report: Report) -> str:
    """Return every number and table of the report as JSON."""
    content = {
        "title": report.title,
        "verdict": report.verdict,
        "claims": [vars(claim) for claim in report.claims],
        "sections": {
            section.key: {"title": section.title, "items": [_plain(i) for i in section.items]}
            for section in report.sections
        },
        "numbers": report.numbers,
        "command": report.command,
        "provenance": dict(report.provenance),
    }
    return json.dumps(_json_value(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _json_value(value: Any) -> Any:
    """Return `value` as JSON can hold it: NaN and infinities become text."""
    if isinstance(value, Mapping):
        return {str(k): _json_value(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_json_value(v) for v in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    return value


def _plain(item: Paragraph | Equation | Table | Figure) -> dict[str, Any]:
    content = {k: v for k, v in vars(item).items() if k != "figure"}
    return {"kind": _kind(item)} | content


def write_report(report: Report, folder: str | os.PathLike[str]) -> Path:
    """Write ``index.html`` and ``report.json``; nothing is half written.

    Parameters
    ----------
    report : Report
    folder : path
        Made where it does not exist.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    """
    folder = Path(folder)
    pages: Sequence[tuple[str, str]] = (
        ("report.json", render_json(report)),
        ("index.html", render_html(report)),
    )
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages:
        replace_file(folder / name, lambda file, text=text: file.write(text.encode()))
    return folder / "index.html"
