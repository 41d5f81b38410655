"""The examples in docstrings run, and the functions met first have one."""

import doctest
import importlib
import inspect
import pkgutil
import re

from rows import each_row

import analysis
import nlctl


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
        name: doctest.testmod(importlib.import_module(name), extraglobs={"nlctl": nlctl})
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


@each_row("name", sorted(functions("nlctl")))
def test_functions_of_nlctl_have_an_example(name):
    """All but those that make a picture, many runs, or a part of a record."""
    without = {"draw", "ensemble_response", "param", "record"}
    shown = ">>> " in (inspect.getdoc(functions("nlctl")[name]) or "")
    assert shown == (name not in without)


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
