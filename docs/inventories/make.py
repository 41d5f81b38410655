"""Make the inventories of other libraries' pages: python docs/inventories/make.py.

They hold the functions and classes that nlctl's pages and docstrings mention, and no more. Where a page lies follows
from the rule by which each library makes its reference; building the site fetches nothing.
"""

import ast
import importlib
import inspect
import re
import zlib
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
NAME = re.compile(r"\b(ct|control|np|numpy|scipy)((?:\.[A-Za-z_]\w*)+)")
SHORT = {"ct": "control", "np": "numpy"}
LIBRARIES = {  # the page of a name, below the address that `conf.py` has
    "control": "generated/{}.html#$",
    "numpy": "reference/generated/{}.html#$",
    "scipy": "reference/generated/{}.html#$",
}
KINDS = ((inspect.isclass, "class"), (callable, "function"))
TOLD = ast.Module | ast.ClassDef | ast.FunctionDef
OWN_CHAPTERS = ("numpy.random", "numpy.ma", "numpy.testing", "numpy.polynomial")


def texts():
    """Yield what is read on the site: pages, scripts that are shown, docstrings."""
    pages = [p for p in (ROOT / "docs").rglob("*.*") if p.suffix in (".md", ".rst", ".py")]
    for path in [*ROOT.glob("*.md"), *pages]:
        if not {"auto", "_ext", "inventories"} & {*path.relative_to(ROOT).parts}:
            yield path.read_text(encoding="utf-8")
    for path in [p for folder in ("nlctl", "analysis") for p in (ROOT / folder).rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, TOLD):
                yield ast.get_docstring(node) or ""


def mentioned():
    """Return the full names that are mentioned."""
    found = {each for text in texts() for each in NAME.findall(text)}
    return {SHORT.get(library, library) + rest for library, rest in found}


def documented(name):
    """Return what a name is called where it is public, and its kind; None if it has no page."""
    library, *parts = name.split(".")
    if any(part.startswith("_") for part in parts) or name.startswith(OWN_CHAPTERS):
        return None
    thing = importlib.import_module(library)
    for count, part in enumerate(parts, 1):
        if not inspect.ismodule(thing):  # a method: it is on the page of its class
            return None
        try:
            thing = getattr(thing, part)
        except AttributeError:
            try:
                thing = importlib.import_module(".".join([library, *parts[:count]]))
            except ImportError:
                return None
    if inspect.isclass(thing) and issubclass(thing, np.generic | np.dtype):  # in another chapter
        return None
    kind = next((kind for test, kind in KINDS if test(thing)), None)
    return kind and (name, kind)


def inventory(library, names):
    """Return the bytes of an inventory of version 2."""
    version = importlib.import_module(library).__version__
    head = f"# Sphinx inventory version 2\n# Project: {library}\n# Version: {version}\n"
    head += "# The remainder of this file is compressed using zlib.\n"
    place = LIBRARIES[library]
    lines = [f"{name} py:{kind} 1 {place.format(name)} -\n" for name, kind in sorted(names)]
    return head.encode() + zlib.compress("".join(lines).encode(), 9)


def main():
    """Write one file a library."""
    found = list(filter(None, map(documented, mentioned())))
    for library in LIBRARIES:
        names = {each for each in found if each[0].startswith(f"{library}.")}
        (HERE / f"{library}.inv").write_bytes(inventory(library, names))
        print(f"{library}.inv: {len(names)} names")


if __name__ == "__main__":
    main()
