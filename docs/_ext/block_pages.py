"""One page a block, written from what there is: picture, equations, signals, docstring, examples.

``auto/blocks/`` has the pages, and one of each group with a table. Nothing lists blocks by hand.
"""

import importlib
from pathlib import Path

from block_pictures import draw_block, draw_made
from sphinx.util import logging

import nlctl
from nlctl.analysis.catalogue import block_records, block_summaries, function_summaries
from nlctl.errors import CompileError, UsageError

logger = logging.getLogger(__name__)
TITLES = {"sliding": "Sliding motion", "delays": "Transport delays"}


def groups():
    """Return what has a page: ``{group: {name: first line}}``, blocks before functions."""
    found = {group: dict(lines) for group, lines in block_summaries().items()}
    for group, lines in function_summaries().items():
        found.setdefault(group, {}).update(lines)
    return found


def home_of(group, name):
    """Return the module under whose name a block is documented."""
    return "nlctl" if name in nlctl.__all__ else f"nlctl.{group}"


def escaped(words):
    """Return text of a docstring as reStructuredText that shows it."""
    for sign in "\\*|_`":
        words = words.replace(sign, "\\" + sign)
    return " ".join(words.split())


def heading(title, sign="="):
    """Return a title with its line."""
    return [title, sign * len(title), ""]


def group_page(group, lines):
    """Return the page of a group: links with what each is, and the pages below it."""
    page = heading(TITLES.get(group, group.capitalize()))
    for name, caption in lines.items():
        page += [f":doc:`{name} <../{name}>`", f"    {escaped(caption)}", ""]
    page += [".. toctree::", "   :hidden:", ""]
    return page + [f"   ../{name}" for name in lines]


def figure(folder, name, drawing, caption):
    """Save a drawing next to the page; return the lines that show it."""
    import matplotlib as mpl

    with mpl.rc_context({"svg.hashsalt": "nlctl", "svg.fonttype": "path"}):
        drawing.savefig(folder / f"{name}.svg", metadata={"Date": None}, bbox_inches="tight")
    return [f".. image:: {name}.svg", f"   :alt: {caption}", "   :class: block-picture", ""]


def signals(made):
    """Return a table of what a block takes, outputs and keeps."""
    rows = {"inputs": made.input_labels, "outputs": made.output_labels, "states": made.state_labels}
    lines = [".. list-table::", "   :widths: 20 80", ""]
    for key, names in rows.items():
        shown = [f"``{name}``" for name in names]
        if len(shown) > 12:
            shown = [*shown[:5], "…", shown[-1], f"({len(names)} in all)"]
        lines += [f"   * - {key}", f"     - {', '.join(shown) or 'none'}"]
    return [*heading("Signals", "-"), *lines, ""]


def equations(made):
    """Return the equations as they are run, if they are expressions."""
    try:
        written = nlctl.typeset(made)
    except CompileError:
        return []
    lines = heading("Equations", "-")
    for one in written:
        if len(written) > 1:
            lines += [f"``{one.block}``", ""]
        for line in (*one.inputs, *one.equations, *one.where):
            lines += [".. math::", "", f"   {' '.join(line.split())}", ""]
    return lines


def made_of(thing, group):
    """Return a block with its defaults, what a function makes of its own, or None."""
    try:
        if not isinstance(thing, type):
            made = thing()
            return made if hasattr(made, "input_labels") else None
        record = thing()
        options = {"dt": True} if getattr(record, "discrete", False) else {}
        return nlctl.block(record, group.removesuffix("s"), **options)
    except (UsageError, TypeError):  # it has arguments that it needs
        return None


def block_page(folder, group, name):
    """Return the page of a block, or of a function that makes blocks."""
    home = home_of(group, name)
    thing = getattr(importlib.import_module(home), name)
    page, made = heading(name), made_of(thing, group)
    if made is not None:
        draw = draw_block if isinstance(thing, type) else draw_made
        page += figure(folder, name, draw(made), f"{name}: its signals, and how it responds")
    page += [f".. public:: {home}", "", f"   {name}", ""]
    if made is not None:
        page += [*signals(made), *(equations(made) if isinstance(thing, type) else [])]
    gallery = [f".. minigallery:: {home}.{name}", "   :add-heading: In the gallery"]
    return [*page, *gallery, "   :heading-level: -", ""]


def replace(path, lines):
    """Write a page if it is another than before, so that Sphinx reads only what has changed."""
    text = "\n".join(lines) + "\n"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def write_pages(app):
    """Write all pages, and remove those of blocks that there are no more."""
    folder = Path(app.srcdir) / "auto" / "blocks"
    (folder / "groups").mkdir(parents=True, exist_ok=True)
    found, records = groups(), block_records()
    logger.info("[blocks] %d pages, of %d records", sum(map(len, found.values())), len(records))
    kept = set()
    for group, lines in found.items():
        replace(folder / "groups" / f"{group}.rst", group_page(group, lines))
        for name in lines:
            replace(folder / f"{name}.rst", block_page(folder, group, name))
        kept |= {*lines, group}
    for path in (*folder.glob("*.*"), *folder.glob("groups/*")):
        if path.stem not in kept:
            path.unlink()


def setup(app):
    """Write the pages before Sphinx looks for them."""
    app.connect("builder-inited", write_pages, priority=600)  # after the gallery's own pages
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
