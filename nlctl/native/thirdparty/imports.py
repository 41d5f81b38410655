"""Functions that import inside their body, with the imports moved out: numba knows none."""

from __future__ import annotations

import ast
import copy
from types import CodeType, FunctionType
from typing import Any

from .source import Unreadable, definition


def without_imports(function: FunctionType) -> FunctionType:
    """Return a function whose imports have become globals of its own.

    One whose source cannot be read stays as it is.
    """
    try:
        found = definition(function)
    except Unreadable:
        return function
    if not any(isinstance(node, ast.Import | ast.ImportFrom) for node in ast.walk(found)):
        return function
    hoisted = _Hoist()
    body = hoisted.visit(copy.deepcopy(found))
    if not isinstance(body, ast.FunctionDef):
        return function
    body.decorator_list = []
    names = dict(function.__globals__)
    exec(compile(ast.Module(hoisted.found, []), "imports", "exec"), names)
    made = _compiled(body, function)
    result = FunctionType(
        made, names, function.__name__, function.__defaults__,
        tuple(_cells(function)[name] for name in made.co_freevars),
    )  # fmt: skip
    result.__module__, result.__qualname__ = function.__module__, function.__qualname__
    return result


class _Hoist(ast.NodeTransformer):
    """Takes the import statements out of a tree."""

    def __init__(self) -> None:
        self.found: list[ast.stmt] = []

    def _take(self, node: Any) -> ast.AST:
        self.found.append(node)
        return ast.copy_location(ast.Pass(), node)

    visit_Import = _take
    visit_ImportFrom = _take


def _cells(function: FunctionType) -> dict[str, Any]:
    return dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))


def _compiled(node: ast.FunctionDef, function: FunctionType) -> CodeType:
    """Compile one function definition where its free variables are local names."""
    outer = ast.parse(f"def outer({', '.join(function.__code__.co_freevars)}): pass")
    definition = outer.body[0]
    assert isinstance(definition, ast.FunctionDef)
    definition.body = [node]
    whole = compile(ast.fix_missing_locations(outer), function.__code__.co_filename, "exec")
    return _inside(_inside(whole, "outer"), function.__name__)


def _inside(code: CodeType, name: str) -> CodeType:
    return next(c for c in code.co_consts if isinstance(c, CodeType) and c.co_name == name)
