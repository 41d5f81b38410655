"""Functions that read objects, made functions of the numbers that these hold.

numba knows no objects: where a function reads ``plant.A`` or ``self.gain``, the object is
replaced by a record of the attributes that are read, with the values that they have when the
diagram is compiled.
"""

from __future__ import annotations

import ast
import copy
import functools
from collections import namedtuple
from collections.abc import Callable, Iterator
from types import CellType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ...expressions.source import Definition, Unreadable, cells_of, definition, in_cell
from ...upstream.numba_internals import CPUDispatcher

# what machine code takes as a constant, or can call
UNDERSTOOD = (
    bool | int | float | complex | str | tuple | list | dict | set | type(None) | np.ndarray
    | np.generic | type | ModuleType | FunctionType | CPUDispatcher | np.ufunc
)  # fmt: skip


def frozen(function: object) -> Any:
    """Return a function with constants instead of the objects that it reads."""
    # Methods, `functools.partial` and objects that can be called become functions as well. What
    # cannot be replaced stays as it is, and numba will say so.
    if isinstance(function, functools.partial):
        inner = frozen(function.func)
        plain = isinstance(inner, FunctionType | CPUDispatcher)
        return _bound(inner, function.args, function.keywords) if plain else function
    if isinstance(function, MethodType):
        return _method(function.__func__, function.__self__) or function
    if isinstance(function, CPUDispatcher):
        return function
    if not isinstance(function, FunctionType):
        call = vars(type(function)).get("__call__")
        return _method(call, function) or function
    function = without_imports(function)
    try:
        node = definition(function)
    except Unreadable:
        return function
    old_cells = cells_of(function).items()
    records = [_record(in_cell(cell), name, node) for name, cell in old_cells]
    new_cells = [
        cell if record is None else CellType(record)  # what needs none stays as it is
        for (_, cell), record in zip(old_cells, records, strict=True)
    ]
    new_globals = {
        name: record
        for name in {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
        if name in function.__globals__ and name not in function.__code__.co_varnames
        if (record := _record(function.__globals__[name], name, node)) is not None
    }
    same = all(new is old for new, (_, old) in zip(new_cells, old_cells, strict=True))
    if same and not new_globals:
        return function
    names = function.__globals__ | new_globals
    return moved_function(function, function.__code__, names, new_cells)


def moved_function(
    function: FunctionType, code: CodeType, names: dict[str, Any], cells: Any
) -> FunctionType:
    """Return a function with other code, which finds other things around it."""
    copied = FunctionType(code, names, function.__name__, function.__defaults__, tuple(cells))
    copied.__kwdefaults__ = function.__kwdefaults__
    copied.__module__, copied.__qualname__ = function.__module__, function.__qualname__
    return copied


def _method(function: object, owner: object) -> Any:
    """Return a method as a function of ``(t, x, u, params)``; None where it stays a method."""
    if not isinstance(function, FunctionType):
        return None
    try:
        node = definition(function)
    except Unreadable:
        return None
    if any(isinstance(n, ast.Name) and n.id in ("super", "__class__") for n in ast.walk(node)):
        return None  # these need the object itself
    name = function.__code__.co_varnames[0]
    chains = list(_uses(name, node))
    record = _held(owner, chains) if chains else 0.0  # one that it does not read
    return None if record is None else _bound(frozen(function), (record,), {})


def _bound(function: object, first: tuple[Any, ...], named: dict[str, Any]) -> Callable[..., Any]:
    """Return ``f(t, x, u, params)`` of a function some of whose arguments are given."""
    given = {f"given{i}": value for i, value in enumerate(first)}
    given |= {f"given_{name}": value for name, value in named.items()}
    arguments = [*(f"given{i}" for i in range(len(first))), "t", "x", "u", "params"]
    arguments += [f"{name}=given_{name}" for name in named]
    source = f"def bound(t, x, u, params):\n    return function({', '.join(arguments)})\n"
    names = {"function": function, **given, "__name__": getattr(function, "__module__", "")}
    exec(source, names)
    return names["bound"]


def _record(thing: object, name: str, node: Definition) -> Any:
    """Return the attributes of an object that a function reads; None where that is not all."""
    return None if isinstance(thing, UNDERSTOOD) else _held(thing, list(_uses(name, node)))


def _held(thing: object, chains: list[tuple[str, ...]]) -> Any:
    """Return a record of what is read, ``a.b`` as ("a", "b"); None if it is not all constant."""
    if not chains or () in chains:
        return None
    values: dict[str, Any] = {}
    for attribute in dict.fromkeys(chain[0] for chain in chains):
        value = getattr(thing, attribute, None)
        if not isinstance(value, bool | int | float | str | np.number | np.ndarray):
            value = _held(value, [chain[1:] for chain in chains if chain[0] == attribute])
        if value is None:
            return None
        is_array = isinstance(value, np.ndarray) and value.ndim
        values[attribute] = np.ascontiguousarray(value) if is_array else value
    return namedtuple(type(thing).__name__, values)(**values)


def _uses(name: str, node: Definition) -> Iterator[tuple[str, ...]]:
    """Yield the chains of attributes that a function reads of a name; () for any other use."""
    body = node.body if isinstance(node.body, list) else [node.body]
    inside = [n for part in body for n in ast.walk(part)]
    owner = {id(n.value): n for n in inside if isinstance(n, ast.Attribute)}
    for here in inside:
        if isinstance(here, ast.Name) and here.id == name:
            chain: list[str] = []
            around = owner.get(id(here))
            while around is not None and isinstance(around.ctx, ast.Load):
                chain.append(around.attr)
                around = owner.get(id(around))
            yield tuple(chain) if around is None and isinstance(here.ctx, ast.Load) else ()


# -- imports: numba knows none ---------------------------------------------------------------------


def without_imports(function: FunctionType) -> FunctionType:
    """Return a function whose imports have become globals of its own."""
    # One whose source cannot be read stays as it is.
    try:
        tree = definition(function)
    except Unreadable:
        return function
    if not any(isinstance(node, ast.Import | ast.ImportFrom) for node in ast.walk(tree)):
        return function
    hoisted = _Hoist()
    body = hoisted.visit(copy.deepcopy(tree))
    if not isinstance(body, ast.FunctionDef):
        return function
    body.decorator_list = []
    names = dict(function.__globals__)
    exec(compile(ast.Module(hoisted.found, []), "imports", "exec"), names)
    code = _moved(body, function)
    return moved_function(function, code, names, map(cells_of(function).get, code.co_freevars))


class _Hoist(ast.NodeTransformer):
    """Takes the import statements out of a tree."""

    def __init__(self) -> None:
        self.found: list[ast.stmt] = []

    def _take(self, node: Any) -> ast.AST:
        self.found.append(node)
        return ast.copy_location(ast.Pass(), node)

    visit_Import = _take
    visit_ImportFrom = _take


def _moved(node: ast.FunctionDef, function: FunctionType) -> CodeType:
    """Compile one function definition where its free variables are local names."""
    outer = ast.parse(f"def outer({', '.join(function.__code__.co_freevars)}): pass")
    definition = outer.body[0]
    assert isinstance(definition, ast.FunctionDef)
    definition.body = [node]
    whole = compile(ast.fix_missing_locations(outer), function.__code__.co_filename, "exec")
    return _inside(_inside(whole, "outer"), function.__name__)


def _inside(code: CodeType, name: str) -> CodeType:
    return next(c for c in code.co_consts if isinstance(c, CodeType) and c.co_name == name)
