"""The examples in docstrings run, and the functions met first have one."""

import doctest
import importlib
import inspect
import re

import control as ct
import numpy as np
import pytest
from reference import documented_names, our_modules
from rows import each_row

import nlctl

FIRST = {"nlctl": nlctl, "np": np, "ct": ct}  # as the reference of the site says
REFERS = re.compile(r"\nExamples\n--------\nSee `(\w+)`\.$")


LONG = {  # take seconds
    "nlctl.analysis.lyapunov.certificate.certify.certify",
    "nlctl.analysis.lyapunov.certificate.gains.design",
    "nlctl.analysis.lyapunov.conservatism.conservatism",
    "nlctl.analysis.lyapunov.ledger.ledger",
    "nlctl.analysis.lyapunov.tighten.tighten",
}


def examples(names):
    """The examples of all docstrings of modules, by name."""
    finder, found = doctest.DocTestFinder(exclude_empty=True), {}
    for name in names:
        module = importlib.import_module(name)
        if ">>> " in inspect.getsource(module):
            made = finder.find(module, name, extraglobs=FIRST)
            found |= {each.name: each for each in made if each.examples}
    return found


def failures(tests):
    """What the examples print that they do not say."""
    said = []
    for test in tests:
        doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=said.append)
    return "".join(said)


@pytest.mark.slow
def test_the_examples_run():
    """They print what they say, each docstring's by themselves."""
    places = (place for place in our_modules() if not place.ispkg)
    found = examples(place.name for place in places if not place.name.endswith("__main__"))
    assert found.keys() >= LONG
    assert failures(test for name, test in found.items() if name not in LONG) == ""


@pytest.mark.ci
@pytest.mark.parametrize("name", sorted(LONG))
def test_the_long_examples_run(name):
    assert failures([examples([name.rpartition(".")[0]])[name]]) == ""


def documented():
    """Every name of the reference that is not a value, by the package that offers it."""
    for home, name in documented_names():
        made = getattr(importlib.import_module(home), name)
        if callable(made):
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
