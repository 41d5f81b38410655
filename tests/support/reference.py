"""The names that the reference of the site documents."""

import re

from places import ROOT

PUBLIC = re.compile(r"^\.\. public:: (\S+)\n\n((?: +.*\n?)+)", re.MULTILINE)


def documented_names():
    """Yield the package that offers it and the name, page after page."""
    for page in sorted((ROOT / "docs" / "reference").glob("*.rst")):
        for home, names in PUBLIC.findall(page.read_text(encoding="utf-8")):
            yield from ((home, name) for name in names.split())
