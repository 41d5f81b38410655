"""Pages that show a file of the repository's root; links to such a file lead to its page."""

import re
from pathlib import Path

from sphinx.addnodes import pending_xref
from sphinx.transforms.post_transforms import SphinxPostTransform

INCLUDED = re.compile(r"\{include\} \.\./\.\./(\S+)")


def pages(folder):
    """Return the document that shows each file: ``{"CHANGELOG.md": "project/release-notes"}``."""
    found = {}
    for path in sorted((Path(folder) / "project").glob("*.md")):
        for name in INCLUDED.findall(path.read_text(encoding="utf-8")):
            found[name] = f"project/{path.stem}"
    return found


class RootFiles(SphinxPostTransform):
    """Turn links to files of the root into links to their pages, before MyST looks for them."""

    default_priority = 4

    def run(self, **_):
        shown = pages(self.app.srcdir)
        for node in list(self.document.findall(pending_xref)):
            document = shown.get(node.get("reftarget", ""))
            if document and node["reftype"] == "myst":
                node.attributes |= {"refdomain": "std", "reftype": "doc", "refexplicit": True}
                node["reftarget"] = f"/{document}"


def setup(app):
    """Look at all links."""
    app.add_post_transform(RootFiles)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
