"""Names in code style become links, to our own reference and to other libraries' pages.

``ct.interconnect`` and ``nlctl.block(record, name)`` are names; a literal that is not one stays as it is.
"""

import re

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms.post_transforms import SphinxPostTransform

CALLED = re.compile(r"([A-Za-z_][\w.]*\.\w+)(\(.*\))?$")
SHORT = {"ct": "control", "np": "numpy"}


def full_name(text):
    """Return the full name that a literal is, None if it is not one of a library that is linked."""
    found = CALLED.match(text)
    library, _, rest = found[1].partition(".") if found else ("", "", "")
    library = SHORT.get(library, library)
    return f"{library}.{rest}" if library in ("control", "numpy", "scipy", "nlctl") else None


def linked_types(folder):
    """Return the full names of the inventories in a folder, as types of docstrings have them."""
    from sphinx.util.inventory import InventoryFile

    found = {}
    for path in sorted(folder.glob("*.inv")):
        kinds = InventoryFile.loads(path.read_bytes(), uri="").data
        found |= {name: name for names in kinds.values() for name in names}
    return found


class Linked(SphinxPostTransform):
    """Put a reference around each literal that is a name, before references are resolved."""

    default_priority = 5

    def run(self, **_):
        for literal in list(self.document.findall(nodes.literal)):
            name = full_name(literal.astext())
            if name is None or isinstance(literal.parent, nodes.reference | addnodes.pending_xref):
                continue
            linked = addnodes.pending_xref(
                "", literal.deepcopy(), refdomain="py", reftype="obj", reftarget=name,
                refwarn=False, refexplicit=False, refdoc=self.env.docname,
            )  # fmt: skip
            linked["py:module"] = linked["py:class"] = None
            literal.replace_self(linked)


def setup(app):
    """Look at all literals."""
    app.add_post_transform(Linked)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
