"""Docstrings of public functions: each argument has a type and a description, what is returned
has a description, and each exception that the function raises by itself is named."""

import ast
import importlib
import inspect
import textwrap

from rows import each_row
from test_doctests import offered, section

from nlctl import arguments, names, params
from nlctl.diagrams import places
from nlctl.errors import BlockError, ParameterError, UnknownNameError

CHECKERS = (arguments, names, params, places)  # modules of what checks an argument
OFFERED = sorted(dict(offered()).items())


def entries(made, title):
    """The entries of a section: the line that begins each, and its description."""
    found = []
    for line in section(made, title) or []:
        if line and not line.startswith(" "):
            found.append((line, []))
        elif line.strip() and found:
            found[-1][1].append(line.strip())
    return [(head, " ".join(told)) for head, told in found]


@each_row(("name", "made"), OFFERED)
def test_arguments_have_a_type_and_a_description(name, made):
    """``name : type``, and below it what it is."""
    told = entries(made, "Parameters")
    assert [head for head, text in told if " : " not in head or not text] == [], name


@each_row(("name", "made"), OFFERED)
def test_what_is_returned_has_a_description(name, made):
    """Each value that is returned or yielded."""
    told = entries(made, "Returns") + entries(made, "Yields")
    assert [head for head, text in told if not text] == [], name


def own_nodes(node):
    """Yield what a function runs itself: not the bodies of functions that it makes."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef | ast.Lambda):
            yield child
            yield from own_nodes(child)


def resolved(node, known):
    """What a name or an attribute of one means, None where it is a variable."""
    if isinstance(node, ast.Attribute):
        return getattr(resolved(node.value, known), node.attr, None)
    return known.get(node.id) if isinstance(node, ast.Name) else None


def raised_by(thing):
    """The exceptions that ``raise thing(...)`` raises: a class, or what a function makes."""
    if inspect.isfunction(thing):
        thing = inspect.get_annotations(thing, eval_str=True)["return"]
    return {thing} if inspect.isclass(thing) and issubclass(thing, BaseException) else set()


def checked_by(thing):
    """The exceptions that a check of an argument raises, by its own docstring."""
    thing = inspect.unwrap(thing) if callable(thing) else thing
    if not inspect.isfunction(thing) or inspect.getmodule(thing) not in CHECKERS:
        return set()
    known = inspect.getmodule(thing).__dict__
    return {known[head] for head, _ in entries(thing, "Raises")}


def raises(made):
    """The exceptions that a function raises itself, or by a check that it calls itself."""
    made = inspect.unwrap(made)
    tree = ast.parse(textwrap.dedent(inspect.getsource(made))).body[0]
    known = dict(made.__globals__)
    for node in own_nodes(tree):
        if isinstance(node, ast.ImportFrom):  # inside the function
            home = importlib.import_module(
                "." * node.level + (node.module or ""), known["__package__"]
            )
            known |= {alias.asname or alias.name: getattr(home, alias.name) for alias in node.names}
    found = set()
    for node in own_nodes(tree):
        if isinstance(node, ast.Raise) and node.exc is not None:
            told = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            found |= raised_by(resolved(told, known))
        elif isinstance(node, ast.Call):
            found |= checked_by(resolved(node.func, known))
    return found


def untold(made):
    """The exceptions that a function raises, and no section Raises names them or their kind."""
    told = {name.strip() for head, _ in entries(made, "Raises") for name in head.split(",")}
    return {error for error in raises(made) if not told & {kind.__name__ for kind in error.mro()}}


@each_row(("name", "made"), OFFERED)
def test_what_is_raised_is_told(name, made):
    """A section Raises names each exception of the function's own body and of its checks."""
    assert untold(made) == set(), name
    assert [head for head, text in entries(made, "Raises") if not text] == [], name
