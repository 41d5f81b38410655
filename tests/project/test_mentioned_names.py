"""Names in backticks are names that there are: a docstring that mentions what has gone misleads."""

import ast
import importlib
import re
from collections import defaultdict

import pytest
from test_layers import MODULES

NAME = re.compile(r"(?<!`)`([A-Za-z_]\w*(?:\.\w+)*)`(?!`)")
TOLD = ast.Module | ast.FunctionDef | ast.ClassDef


def mentioned():
    """Module and name of everything that docstrings have in backticks."""
    for module, tree in MODULES.items():
        for node in ast.walk(tree):
            if isinstance(node, TOLD):
                for name in NAME.findall(ast.get_docstring(node) or ""):
                    yield module, name


def words_of_code():
    """Every word of the code: names, attributes, arguments and texts that are no docstrings."""
    found = set()
    for tree in MODULES.values():
        docstrings = {
            id(node.body[0].value)
            for node in ast.walk(tree)
            if isinstance(node, TOLD) and ast.get_docstring(node) is not None
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.update([] if id(node) in docstrings else re.findall(r"\w+", node.value))
            else:
                fields = ("id", "attr", "arg", "name", "module", "asname")
                for text in (getattr(node, field, None) for field in fields):
                    found.update(re.findall(r"\w+", text) if isinstance(text, str) else ())
    return found | {part for module in MODULES for part in module.split(".")}


@pytest.fixture(scope="module")
def known():
    return words_of_code()


def exists(name):
    """Whether a name of a library, or of a package of ours, can be reached."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for part in parts[count:]:
            thing = getattr(thing, part, None)
        return thing is not None
    return False


def test_every_word_of_a_name_is_one_of_the_code(known):
    """Or the name is a library's."""
    gone = {(m, n) for m, n in mentioned() if not set(n.split(".")) <= known and not exists(n)}
    assert gone == set()


def test_what_is_said_to_be_in_a_module_is_there():
    """``module.name``: a module of that name defines or imports it."""
    bound = defaultdict(set)
    for module, tree in MODULES.items():
        for node in ast.walk(tree):
            names = [getattr(node, "name", None), getattr(node, "id", None)]
            names += [one.asname or one.name for one in getattr(node, "names", [])
                      if isinstance(one, ast.alias)]  # fmt: skip
            bound[module.rpartition(".")[2]].update(name for name in names if name)
    modules = {part for module in MODULES for part in module.split(".")}
    gone = set()
    for module, name in mentioned():
        *_, home, last = ["", *name.split(".")]
        if home in bound and last not in bound[home] | modules and not exists(name):
            gone.add((module, name))
    assert gone == set()
