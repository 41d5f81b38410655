"""The names that packages and the reference of the site offer, and sections of docstrings."""

import importlib
import inspect
import pkgutil
import re

from places import ROOT

import nlctl
import nlctl.analysis
from nlctl.analysis import catalogue

PUBLIC = re.compile(r"^\.\. public:: (\S+)\n\n((?: +.*\n?)+)", re.MULTILINE)
SECTION = r"^{}\n-+\n((?:.+\n?|\n(?!\w+\n-+\n))*)"


def documented_names():
    """Yield the package that offers it and the name, page after page, then blocks."""
    for page in sorted((ROOT / "docs" / "reference").glob("*.rst")):
        for home, names in PUBLIC.findall(page.read_text(encoding="utf-8")):
            yield from ((home, name) for name in names.split())
    for groups in (catalogue.block_summaries(), catalogue.function_summaries()):
        for group, lines in groups.items():
            yield from (("nlctl" if n in nlctl.__all__ else f"nlctl.{group}", n) for n in lines)


def functions(package):
    """The public functions of a package, by name."""
    home = importlib.import_module(package)
    found = {name: getattr(home, name) for name in home.__all__}
    return {name: made for name, made in found.items() if inspect.isfunction(made)}


def our_modules():
    """Every module below `nlctl`, in a checkout too, where `nlctl.analysis` lies elsewhere."""
    found = {}
    for package in (nlctl, nlctl.analysis):
        walked = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
        found |= {place.name: place for place in walked}
    return found.values()


def offered():
    """The public functions of all packages, by the names under which they are offered."""
    homes = ["nlctl", "nlctl.analysis", *(place.name for place in our_modules() if place.ispkg)]
    homes += [home for home, _ in documented_names() if home.startswith("nlctl.papers.")]
    for home in dict.fromkeys(homes):
        if hasattr(importlib.import_module(home), "__all__"):
            for name, made in functions(home).items():
                if made.__module__.partition(".")[0] == "nlctl":
                    yield f"{home}.{name}", made


def section(made, title):
    """The lines of a section of a docstring, None without it."""
    text = f"{inspect.getdoc(made) or ''}\n"
    found = re.search(SECTION.format(title), text, re.MULTILINE)
    return found and found[1].splitlines()


def entries(made, title):
    """The entries of a section: the line that begins each, and its description."""
    found = []
    for line in section(made, title) or []:
        if line and not line.startswith(" "):
            found.append((line, []))
        elif line.strip():
            found[-1][1].append(line.strip())
    return [(head, " ".join(told)) for head, told in found]


def methods():
    """The public methods of classes of the reference.

    What `nlctl.Spec` describes is left out, what a block's own equations call, without types, and
    `Sampled`, which `nlctl.sampled` makes: only the engine calls its methods.  Steppers are not
    blocks, and their `reset` is their own.
    """
    steppers = (nlctl.native.Stepper, nlctl.native.VectorStepper)
    heads = [head.partition(" : ")[0] for head, _ in entries(nlctl.Spec, "Attributes")]
    contract = {name for head in heads for name in head.split(", ")}
    for home, name in documented_names():
        made = getattr(importlib.import_module(home), name)
        if not inspect.isclass(made) or made is nlctl.sampling.Sampled:
            continue
        for key, method in vars(made).items():
            method = getattr(method, "__func__", method)  # of a class method, say
            if (
                key.startswith("_")
                or (key in contract and made not in steppers)
                or getattr(method, "__name__", "") != key
            ):
                continue
            if inspect.isfunction(method) and method.__annotations__ and inspect.getdoc(method):
                yield f"{home}.{name}.{key}", method
