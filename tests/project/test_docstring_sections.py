"""Public functions tell what their arguments are, what they return and what they raise."""

import ast
import importlib
import inspect
import textwrap

from places import ROOT
from reference import entries, methods, offered
from rows import each_row

import nlctl
from nlctl import arguments, names, params
from nlctl.analysis import lyapunov
from nlctl.diagrams import places
from nlctl.errors import AmbiguousNameError, DiagramError, ParameterError, UnknownNameError

CHECKERS = (arguments, names, params, places)  # modules of what checks an argument
REQUIRED = inspect.Parameter.empty
OFFERED = sorted(dict(offered()).items())
WITH_METHODS = [*OFFERED, *methods()]


@each_row(("name", "made"), WITH_METHODS)
def test_arguments_have_a_type_and_a_description(name, made):
    """In order: ``name : type``, optional where there is a default, and below it what it is."""
    known, told = dict(inspect.signature(made).parameters), []
    if "." in made.__qualname__:
        known = {key: value for key, value in known.items() if key not in ("self", "cls")}
    for head, text in entries(made, "Parameters"):
        of, _, kind = head.partition(" : ")
        these = [one.strip(" *") for one in of.split(",")]
        optional = all(known[one].default is not REQUIRED for one in these)
        assert (bool(kind and text), "optional" in kind) == (True, optional), f"{name}: {head}"
        told += these
    assert told == list(known), name


@each_row(("name", "made"), WITH_METHODS)
def test_what_is_returned_has_a_description(name, made):
    """Each value that is returned or yielded; a class of ours is that of the signature."""
    told = entries(made, "Returns") + entries(made, "Yields")
    assert [head for head, text in told if not text] == [], name
    returned = inspect.signature(made).return_annotation
    returned = returned.__name__ if inspect.isclass(returned) else returned
    assert bool(told) == (returned not in (None, "None")), name
    if returned != "Any" and inspect.isclass(made.__globals__.get(returned)):
        assert returned in told[0][0], name


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


def called(made, thing):
    """The exceptions of a check, by its docstring, or of a private function of the module."""
    if not inspect.isfunction(thing) or thing is made:
        return set()
    if inspect.getmodule(thing) in CHECKERS:
        return {thing.__globals__[head] for head, _ in entries(thing, "Raises")}
    beside = thing.__module__ == made.__module__ and thing.__name__.startswith("_")
    return raises(thing) if beside else set()


def raises(made):
    """The exceptions that a function raises itself, or by a check of its arguments."""
    made, found = inspect.unwrap(made), set()
    known = made.__globals__
    nodes = list(own_nodes(ast.parse(textwrap.dedent(inspect.getsource(made))).body[0]))
    for node in nodes:
        if isinstance(node, ast.ImportFrom):
            path = "." * node.level + (node.module or "")
            known = vars(importlib.import_module(path, made.__globals__["__package__"])) | known
    for node in nodes:
        if isinstance(node, ast.Raise) and node.exc is not None:
            told = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            found |= raised_by(resolved(told, known))
        elif isinstance(node, ast.Call):
            found |= called(made, resolved(node.func, known))
    return found


@each_row(("name", "made"), WITH_METHODS)
def test_what_is_raised_is_told(name, made):
    """A section Raises has each exception, or its base, and says when it is raised."""
    told = entries(made, "Raises")
    assert [head for head, text in told if not text] == [], name
    named = {one.strip().rpartition(".")[2] for head, _ in told for one in head.split(",")}
    missing = [e.__name__ for e in raises(made) if not named & {kind.__name__ for kind in e.mro()}]
    assert missing == [], name


EXAMPLES = [  # by a private function of its module, by a function that makes it, by a check
    (nlctl.interconnect, {DiagramError, UnknownNameError}),
    (names.find_name, {AmbiguousNameError, UnknownNameError}),
    (lyapunov.disturbance, {ParameterError}),
]


@each_row(("made", "errors"), EXAMPLES)
def test_exceptions_are_found(made, errors):
    assert raises(made) == errors


def module_of(path):
    """The module of a file, as it is called in a checkout and where nlctl is installed."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    return name.removeprefix("analysis")


def functions_of(path):
    """Functions and methods of a file, by their first lines, with their docstrings."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
            yield first, node.name, ast.get_docstring(node) or ""


def test_what_is_not_offered_says_it_in_lines_and_not_in_sections():
    """Sections of functions that no page shows are read by nobody, and cost as much as code."""
    known = {
        (made.__module__.removeprefix("nlctl.analysis"), code.co_firstlineno)
        for _, made in WITH_METHODS
        if (code := getattr(inspect.unwrap(made), "__code__", None))
    }
    found = [
        f"{path.relative_to(ROOT)}: {name}"
        for package in ("nlctl", "analysis")
        for path in sorted((ROOT / package).rglob("*.py"))
        for first, name, text in functions_of(path)
        if "\nParameters\n---" in text and (module_of(path), first) not in known
    ]
    assert found == []
