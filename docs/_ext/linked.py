"""Names in code style become links, to our own reference and to other libraries' pages.

``ct.interconnect`` and ``nlctl.block(record, name)`` are names; a literal that is not one stays as it is.
"""

import re

from docutils import nodes
from sphinx import addnodes
from sphinx.ext.intersphinx import InventoryAdapter
from sphinx.transforms.post_transforms import SphinxPostTransform

CALLED = re.compile(r"([A-Za-z_][\w.]*\.\w+)(\(.*\))?$")
LINKS = nodes.reference | addnodes.pending_xref
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
        found |= {name: f":py:obj:`{name}`" for names in kinds.values() for name in names}
    return found


class Linked(SphinxPostTransform):
    """Put a reference around each literal that is a known name, before references are resolved."""

    default_priority = 5

    def run(self, **_):
        others = InventoryAdapter(self.env).main_inventory
        known = {name for kind in others for name in others[kind]}
        known |= self.env.get_domain("py").objects.keys()
        for literal in list(self.document.findall(nodes.literal)):
            name = full_name(literal.astext())
            if name in known and not isinstance(literal.parent, LINKS):
                literal.replace_self(self.linked(literal, name))

    def linked(self, literal, name):
        """Return a literal within a reference to a name."""
        kind = {"refdomain": "py", "reftype": "obj", "reftarget": name, "refexplicit": False}
        link = addnodes.pending_xref("", literal.deepcopy(), refdoc=self.env.docname, **kind)
        link["py:module"] = link["py:class"] = None
        return link


def without_python(app, config):
    """Leave out what numpydoc adds, links to Python's own types: there is no inventory of them."""
    config.numpydoc_xref_aliases_complete = dict(config.numpydoc_xref_aliases)


def setup(app):
    """Look at all literals."""
    app.add_post_transform(Linked)
    app.connect("config-inited", without_python, priority=900)  # after numpydoc has added them
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
