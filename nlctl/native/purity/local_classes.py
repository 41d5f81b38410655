"""Classes that a function defines: made once to be walked, as its own code would make them.

Their statements must do nothing but define methods and constants; then making the class is all that
happens.
"""

from __future__ import annotations

import abc
import ast
import builtins
import dataclasses
import inspect
import typing
from collections.abc import Iterator, Mapping
from types import CellType, FunctionType
from typing import Any

from ...expressions.source import codes_in
from .values import Impure

_OF_METHODS = ("property", "staticmethod", "classmethod", "abstractmethod", "abc.abstractmethod")
_OF_TYPES = (ast.Name, ast.Attribute, ast.Subscript, ast.Constant, ast.BinOp, ast.BitOr, ast.Tuple,
             ast.Load)  # fmt: skip
_OF_CONSTANTS = (ast.Constant, ast.UnaryOp, ast.USub, ast.BinOp, ast.operator, ast.Tuple, ast.List,
                 ast.Name, ast.Load)  # fmt: skip


def class_defined_in(
    node: ast.ClassDef, function: FunctionType, decorators: list[Any], bases: list[Any],
    others: Mapping[str, type],
) -> type:  # fmt: skip
    """Return the class that a function defines, or refuse one that is more than its methods."""
    codes = [c for c in codes_in(function.__code__) if _is_of(c, node)]
    simple = not node.keywords and all(map(_only_defines, node.body)) and all(map(_is_plain, bases))
    if len(codes) != 1 or not simple:
        raise Impure(f"defines the class {node.name}", "define it outside of the function")
    # of what is around it the methods find other classes; an empty cell may be anything
    cells = {
        name: CellType(others[name]) if name in others else CellType()
        for name in codes[0].co_freevars
    }
    around = tuple(cells.values())
    body: Any = FunctionType(codes[0], function.__globals__, node.name, (), around)
    defined: Any = builtins.__build_class__(body, node.name, *bases)
    for decorator, expression in zip(decorators, node.decorator_list, strict=True):
        if decorator is not dataclasses.dataclass:
            raise Impure(f"decorates the class {node.name}", "define it outside of the function")
        defined = decorator(**dict(_options(expression)))(defined)
    if node.name in cells:
        cells[node.name].cell_contents = defined
    return defined


def _is_plain(base: Any) -> bool:
    """Whether making a class from another runs nothing of anybody's."""
    of_python = getattr(base, "__module__", "") in ("enum", "typing", "abc")
    if of_python or not isinstance(base, type):
        return of_python and base is not typing.Generic
    beginning = inspect.getattr_static(base, "__init_subclass__")
    begins = beginning is inspect.getattr_static(object, "__init_subclass__")
    return begins and type(base) in (type, abc.ABCMeta)


def constants_in_class(node: ast.ClassDef) -> Iterator[ast.expr]:
    """Yield the expressions whose values a class keeps."""
    for statement in node.body:
        if isinstance(statement, ast.FunctionDef):
            yield from (d for d in (*statement.args.defaults, *statement.args.kw_defaults) if d)
        elif isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None:
            yield statement.value


def _is_of(code: Any, node: ast.ClassDef) -> bool:
    first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
    return code.co_name == node.name and code.co_firstlineno == first


def _options(decorator: ast.expr) -> Iterator[tuple[str, Any]]:
    for keyword in decorator.keywords if isinstance(decorator, ast.Call) else ():
        if keyword.arg is None or not isinstance(keyword.value, ast.Constant):
            raise Impure("makes a dataclass with options that it computes", "write them out")
        yield keyword.arg, keyword.value.value


def _only_defines(statement: ast.stmt) -> bool:
    """Whether a statement in a class runs nothing of anybody's."""
    if isinstance(statement, ast.FunctionDef):
        decorators = [ast.unparse(d) for d in statement.decorator_list]
        given = (*statement.args.defaults, *statement.args.kw_defaults)
        types = [a for a in ast.walk(statement.args) if isinstance(a, ast.arg)]
        types = [a.annotation for a in types] + [statement.returns]
        plain = all(d in _OF_METHODS for d in decorators) and all(map(_is_constant, given))
        return plain and all(map(_is_type, types))
    if isinstance(statement, ast.AnnAssign):
        return _is_type(statement.annotation) and _is_constant(statement.value)
    if isinstance(statement, ast.Assign):
        targets = [n for t in statement.targets for n in ast.walk(t)]
        names = all(isinstance(n, ast.Name | ast.Tuple | ast.Store) for n in targets)
        return names and _is_constant(statement.value)
    text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return text or isinstance(statement, ast.Pass)


def _is_constant(value: ast.expr | None) -> bool:
    return value is None or all(isinstance(n, _OF_CONSTANTS) for n in ast.walk(value))


def _is_type(value: ast.expr | None) -> bool:
    return value is None or all(isinstance(n, _OF_TYPES) for n in ast.walk(value))
