"""The examples in docstrings run, and the functions met first have one."""

import doctest
import importlib
import inspect
import pkgutil

import pytest
from rows import each_row

import analysis
import nlctl

PACKAGES = ("nlctl", "analysis.lyapunov", "analysis.robustness", "analysis.studies")


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


@pytest.mark.parametrize("package", PACKAGES)
def test_a_section_of_parameters_leaves_none_out(package):
    """Where there is one, it names every argument of the signature."""
    for name, made in functions(package).items():
        _, found, told = (inspect.getdoc(made) or "").partition("Parameters\n----------\n")
        wanted = [each for each in inspect.signature(made).parameters if found]
        heads = [line for line in told.splitlines() if line and not line.startswith(" ")]
        told_of = {part.strip(" *") for head in heads for part in head.split(" :")[0].split(",")}
        assert set(wanted) <= told_of, f"{package}.{name}: {set(wanted) - told_of}"
