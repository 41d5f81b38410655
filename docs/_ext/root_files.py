"""Pages that show a file of the repository's root; links to such a file lead to its page."""

import re
from pathlib import Path

from docutils.nodes import reference

INCLUDED = re.compile(r"\{include\} \.\./\.\./(\S+)")


def pages(folder):
    """Return the document that shows each file: ``{"CHANGELOG.md": "project/release-notes"}``."""
    found = {}
    for path in sorted((Path(folder) / "project").glob("*.md")):
        for name in INCLUDED.findall(path.read_text(encoding="utf-8")):
            found[name] = f"project/{path.stem}"
    return found


def resolve(app, env, node, content):
    """Return a link to the page of a file, None where it has none."""
    document = pages(app.srcdir).get(node.get("reftarget", ""))
    if document is None:
        return None
    uri = app.builder.get_relative_uri(node["refdoc"], document)
    return reference("", "", *content.children, internal=True, refuri=uri)


def setup(app):
    """Resolve what Sphinx and MyST do not find."""
    app.connect("missing-reference", resolve)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
