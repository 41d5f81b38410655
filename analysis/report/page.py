"""The shell of a page: Jinja2 environment, own style and script, content policy, writing."""

import base64
import hashlib
import json
import os
import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from nlctl.errors import UsageError
from nlctl.host.files import replace_file

from .document import Live
from .mathml import font_face, inline, mathml
from .outline import cells, claim_status, is_long, is_short, numeric
from .typography import pieces, plain_text

UPLOT = "vendor/uplot"
CONTROL = {code: "\ufffd" for code in [*range(32), *range(127, 160)] if chr(code) not in "\t\n\r"}


def fill(template: str, *, interactive: bool = False, live: bool = False, **content: object) -> str:
    """Return a template filled in, with the page's style and script, and the policy for them.

    An interactive page has uPlot (MIT licence) in them, and what draws its charts; a live one what
    runs its loops, and may make code of WebAssembly.
    """
    style = font_face() + _own("templates/colours.css") + _own("templates/report.css")
    script = _own("templates/make.js") + _own("templates/report.js")
    if interactive:
        style += _own(f"{UPLOT}/uPlot.min.css") + "\n" + _own("templates/history.css")
        licence = f"\n/*\n{_own(f'{UPLOT}/LICENSE')}\n*/\n"
        script += licence + _own(f"{UPLOT}/uPlot.iife.min.js") + _own("templates/history.js")
    if live:
        style += _own("templates/live.css")
        script += _live_script()
    page = _environment().get_template(template)
    text = page.render(
        style=Markup(style),
        script=Markup(script),
        policy=_policy(style, script, live=live),
        generator=generator(template),
        **content,
    )
    return text.translate(CONTROL)


def _live_script() -> str:
    """Return what runs loops, with names of its own."""
    parts = (_own(f"templates/{name}.js") for name in ("live_engine", "live"))
    return "\n{\n" + "\n".join(parts) + "}\n"


def live_figure(item: Live) -> str:
    """Return a loop that runs as part of another page, which needs `live_files`."""
    macros: Any = _environment().get_template("macros.html").module
    return str(macros.live(item, item.key))


def live_files(dark: str) -> dict[str, str]:
    """Return style and script of other pages with loops that run.

    `dark` is how a selector begins that holds where such a page is dark.
    """
    light, night = _own("templates/colours.css").split("@media (prefers-color-scheme: dark) { ")
    colours = light.replace(":root", "figure.live").replace("light dark", "light")
    begun = f"{dark} figure.live {{ color-scheme: dark;"
    colours += night.replace(":root {", begun).replace("} }", "}")
    script = "{\n" + _own("templates/make.js") + _live_script() + "}\n"
    return {"live.css": colours + _own("templates/live.css"), "live.js": script}


def _policy(style: str, script: str, *, live: bool = False) -> str:
    """Return the content policy: this style, this script, pictures and fonts in the page."""
    code = " 'wasm-unsafe-eval'" * live  # of WebAssembly alone: nothing else is made code of
    return (
        f"default-src 'none'; style-src '{_digest(style)}'; script-src '{_digest(script)}'{code}; "
        "img-src data:; font-src data:; base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _own(name: str) -> str:
    return files("nlctl.analysis.report").joinpath(name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("nlctl.analysis.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "cells": cells,
        "claim_status": claim_status,
        "long": is_long,
        "short": is_short,
        "inline": inline,
        "mathml": mathml,
        "numeric": numeric,
        "pieces": pieces,
        "plain": plain_text,
    }
    return environment


def to_bytes(text: str) -> bytes:
    """Return a text as UTF-8; halves of characters, which have no UTF-8, are spelt out."""
    return text.encode(errors="backslashreplace")


def write_files(folder: Path, texts: dict[str, str]) -> None:
    """Write texts as files of a folder, which is made where it does not exist."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        replace_file(folder / name, lambda file, text=text: file.write(to_bytes(text)))


PARTS = ("title", "verdict", "claims", "numbers", "sections")  # of a report.json
MADE = re.compile(r'<meta name="generator" content="(nlctl \w+)">')
HEAD = 4096  # bytes of a page in which its generator stands


def generator(template: str) -> str:
    """Return the generator that a page names."""
    return f"nlctl {Path(template).stem}"


def check_report_folder(folder: str | os.PathLike[str]) -> None:
    """Refuse a folder whose files a report would replace, unless a report has made them."""
    folder = Path(folder)
    page, content, *others_of_page = (
        folder / n for n in ("index.html", "report.json", "report.pdf", "signals.json")
    )
    is_own = _maker(page) == generator("report.html")
    others = [p for p, is_ours in ((page, is_own), (content, _is_report(content))) if not is_ours]
    others += [] if is_own else others_of_page
    _refuse([path for path in others if path.exists()], "take another folder with --out")


def check_gallery_folder(folder: str | os.PathLike[str]) -> None:
    """Refuse a folder whose ``index.html`` is not that of a gallery."""
    page = Path(folder) / "index.html"
    if page.exists() and _maker(page) != generator("gallery.html"):
        _refuse([page], "move it away")


def _refuse(others: Sequence[Path], remedy: str) -> None:
    if others:
        raise UsageError(
            f"'{others[0]}' would be replaced, and this command has not made it: {remedy}, or "
            "replace it with --force"
        )


def _maker(page: Path) -> str:
    """Return who made a page; nothing if it does not say, or cannot be read."""
    try:
        with page.open("rb") as file:
            match = MADE.search(file.read(HEAD).decode(errors="replace"))
    except OSError:
        return ""
    return match[1] if match else ""


def _is_report(path: Path) -> bool:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(content, dict) and all(part in content for part in PARTS)
