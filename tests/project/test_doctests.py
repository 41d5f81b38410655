"""The examples in docstrings run, and the functions met first have one."""

import doctest
import importlib
import inspect
import pkgutil
import re

from places import ROOT
from rows import each_row

import analysis
import nlctl

PUBLIC = re.compile(r"^\.\. public:: (\S+)\n\n((?:   .*\n?)+)", re.MULTILINE)
REFERS = re.compile(r"\nExamples\n--------\nSee `(\w+)`\.$")


def modules():
    """Names of all modules whose source has an example."""
    for package in (nlctl, analysis):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not found.ispkg and not found.name.endswith("__main__"):
                source = inspect.getsource(importlib.import_module(found.name))
                if ">>> " in source:
                    yield found.name


def test_the_examples_run():
    """They print what they say, those of each module by themselves."""
    results = {
        name: doctest.testmod(
            importlib.import_module(name),
            extraglobs={"nlctl": nlctl},
            optionflags=doctest.ELLIPSIS,
        )
        for name in modules()
    }
    assert results
    assert all(each.attempted for each in results.values()), results
    assert [name for name, each in results.items() if each.failed] == []


def functions(package):
    """The public functions of a package, by name."""
    home = importlib.import_module(package)
    found = {name: getattr(home, name) for name in home.__all__}
    return {name: made for name, made in found.items() if inspect.isfunction(made)}


def documented():
    """Every name of the reference, by the package that offers it."""
    for page in sorted((ROOT / "docs" / "reference").glob("*.rst")):
        for home, names in PUBLIC.findall(page.read_text(encoding="utf-8")):
            for name in names.split():
                made = getattr(importlib.import_module(home), name)
                if callable(made) and home.startswith(("nlctl", "analysis.robustness")):
                    yield f"{home}.{name}", made


def has_example(made):
    """Whether its own docstring has one, or names what makes it."""
    told = inspect.getdoc(made) or ""
    return ">>> " in told or REFERS.search(told) is not None


@each_row(("name", "made"), sorted(dict(documented()).items()))
def test_public_names_have_an_example(name, made):
    """Of their own, or that of the function which makes them, and nothing else refers."""
    assert has_example(made), name
    found = REFERS.search(inspect.getdoc(made))
    if found:
        home = importlib.import_module(name.rpartition(".")[0])
        assert ">>> " in inspect.getdoc(getattr(home, found[1])), f"{name} refers to {found[1]}"


def offered():
    """The public functions of all packages, by the names under which they are offered."""
    for package in (nlctl, analysis):
        homes = [package.__name__]
        walked = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
        homes += [found.name for found in walked if found.ispkg]
        for home in homes:
            if hasattr(importlib.import_module(home), "__all__"):
                for name, made in functions(home).items():
                    if made.__module__.partition(".")[0] in ("nlctl", "analysis"):
                        yield f"{home}.{name}", made


SECTION = r"^{}\n-+\n((?:.+\n?|\n(?!\w+\n-+\n))*)"


def section(made, title):
    """The lines of a section of a docstring, None without it."""
    text = f"{inspect.getdoc(made) or ''}\n"
    found = re.search(SECTION.format(title), text, re.MULTILINE)
    return found and found[1].splitlines()


@each_row(("name", "made"), sorted(dict(offered()).items()))
def test_public_functions_tell_of_every_argument(name, made):
    """A section Parameters names each of the signature, and nothing else is in it."""
    told = section(made, "Parameters") or []
    heads = [line for line in told if line and not line.startswith(" ")]
    named = {part.strip(" *") for head in heads for part in head.split(" :")[0].split(",")}
    assert named == set(inspect.signature(made).parameters), name


@each_row(("name", "made"), sorted(dict(offered()).items()))
def test_public_functions_tell_what_they_return(name, made):
    """A section Returns or Yields, of all that return something."""
    returns = inspect.signature(made).return_annotation not in (None, "None")
    assert returns == any(section(made, title) for title in ("Returns", "Yields")), name
