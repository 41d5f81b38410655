"""Docstrings are written to be read as text; this says to Sphinx which of it is a formula.

Paragraphs that are laid out in columns or indented become literal blocks, and ``|e|`` is an
absolute value, not a substitution.
"""

import re

UNDERLINE = re.compile(r"-{3,}$")
LAID_OUT = re.compile(r"\S   +\S")
SIGNS = re.compile(r"(\||_(?!\w))")  # a bar, or an underscore that a reference would end in
CODE = re.compile(r"(``.+?``)")


def _paragraphs(lines):
    paragraph = []
    for line in [*lines, ""]:
        if line.strip():
            paragraph.append(line)
        elif paragraph:
            yield paragraph
            paragraph = []


def _is_formula(paragraph):
    if paragraph[0].lstrip().startswith((">>>", "*", "-", "..")):
        return False
    indented = any(line[0] == " " for line in paragraph)
    return indented or any(LAID_OUT.search(line) for line in paragraph)


def _escaped(line):
    if line.lstrip().startswith((">>>", "...")):
        return line
    parts = CODE.split(line)
    return "".join(p if p.startswith("``") else SIGNS.sub(r"\\\1", p) for p in parts)


def marked_up(lines):
    """Return a docstring with its formulas as literal blocks."""
    heading = next((i for i, line in enumerate(lines) if UNDERLINE.match(line.strip())), None)
    end = len(lines) if heading is None else heading - 1
    done = []
    for paragraph in _paragraphs(lines[:end]):
        if _is_formula(paragraph):
            done += [".. code-block:: text", "", *(f"    {line}" for line in paragraph), ""]
        else:
            done += [*map(_escaped, paragraph), ""]
    return done + [_escaped(line) for line in lines[end:]]


def _process(app, what, name, obj, options, lines):
    lines[:] = marked_up(lines)


def setup(app):
    """Read docstrings before numpydoc does."""
    app.connect("autodoc-process-docstring", _process, priority=100)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
