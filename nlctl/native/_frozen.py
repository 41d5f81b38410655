"""Functions that read objects, made functions of the numbers that these hold.

Machine code knows no objects: where a function reads ``plant.A`` or ``self.gain``, the object is
replaced by a record of the attributes that are read, with the values that they have when the
diagram is compiled.
"""

from __future__ import annotations

import dis
import functools
import itertools
from collections import namedtuple
from collections.abc import Callable, Collection, Iterator
from types import CellType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np
from numba.core.registry import CPUDispatcher

from ._imports import without_imports

# what machine code takes as a constant, or can call
UNDERSTOOD = (
    bool | int | float | complex | str | tuple | list | dict | set | type(None) | np.ndarray
    | np.generic | type | ModuleType | FunctionType | CPUDispatcher | np.ufunc
)  # fmt: skip
READS = ("LOAD_ATTR", "LOAD_METHOD")
NAMES = ("LOAD_GLOBAL", "LOAD_DEREF", "LOAD_CLOSURE", "LOAD_FAST", "LOAD_NAME")


def frozen(function: Any) -> Any:
    """Return a function with constants in the place of the objects that it reads.

    Methods, `functools.partial` and objects that can be called become functions as well.  What
    cannot be replaced stays as it is, and numba will say so.
    """
    if isinstance(function, functools.partial) and not function.keywords:
        return _bound(frozen(function.func), function.args)
    if isinstance(function, MethodType):
        return _method(function.__func__, function.__self__)
    if isinstance(function, CPUDispatcher):
        return function
    if not isinstance(function, FunctionType):
        call = vars(type(function)).get("__call__")
        return _method(call, function) if isinstance(call, FunctionType) else function
    function = without_imports(function)
    code = function.__code__
    old_cells = _cells(function)
    new_cells = [_cell(name, cell, code) for name, cell in old_cells]
    new_globals = {
        name: record
        for name in code.co_names
        if name in function.__globals__
        and (record := _record(function.__globals__[name], name, code)) is not None
    }
    same = all(new is old for new, (_, old) in zip(new_cells, old_cells, strict=True))
    if same and not new_globals:
        return function
    return _with(function, function.__globals__ | new_globals, new_cells)


def _with(function: FunctionType, names: dict[str, Any], cells: list[CellType]) -> FunctionType:
    made = FunctionType(
        function.__code__, names, function.__name__, function.__defaults__, tuple(cells)
    )
    made.__kwdefaults__ = function.__kwdefaults__
    made.__module__, made.__qualname__ = function.__module__, function.__qualname__
    return made


def _cells(function: FunctionType) -> list[tuple[str, CellType]]:
    return list(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))


def _cell(name: str, cell: CellType, code: CodeType) -> CellType:
    try:
        record = _record(cell.cell_contents, name, code)
    except ValueError:  # not yet filled
        return cell
    return cell if record is None else CellType(record)


def _method(function: Any, owner: Any) -> Any:
    """Return a method as a function of its other arguments."""
    if not isinstance(function, FunctionType):
        return function
    record = _record(owner, function.__code__.co_varnames[0], function.__code__)
    return _bound(frozen(function), () if record is None else (record,))


def _bound(function: Any, first: tuple[Any, ...]) -> Callable[..., Any]:
    """Return ``f(t, x, u, params)`` of a function with one more argument in front."""
    if len(first) != 1:
        return function
    given = first[0]

    def bound(t, x, u, params):
        return function(given, t, x, u, params)

    return bound


def _record(thing: Any, name: str, code: CodeType) -> Any:
    """Return the attributes of an object that a function reads; None where that is not all."""
    return None if isinstance(thing, UNDERSTOOD) else _held(thing, list(_uses(name, code)))


def _held(thing: Any, chains: list[tuple[str, ...]]) -> Any:
    """Return a record of what is read, ``a.b`` as ("a", "b"); None if it is not all constant."""
    if not chains or () in chains:
        return None
    values: dict[str, Any] = {}
    for attribute in dict.fromkeys(chain[0] for chain in chains):
        value = getattr(thing, attribute, None)
        if not _is_constant(value):
            value = _held(value, [chain[1:] for chain in chains if chain[0] == attribute])
        if value is None:
            return None
        is_array = isinstance(value, np.ndarray) and value.ndim
        values[attribute] = np.ascontiguousarray(value) if is_array else value
    return namedtuple(type(thing).__name__, values)(**values)


def _uses(name: str, code: CodeType) -> Iterator[tuple[str, ...]]:
    """Yield the chains of attributes that a function reads of a name; () for any other use."""
    instructions = [i for i in dis.get_instructions(code) if i.opname != "CACHE"]
    for k, here in enumerate(instructions):
        if here.argval != name or here.opname == "LOAD_CLOSURE":
            continue
        if here.opname in NAMES:
            reads = itertools.takewhile(lambda i: i.opname in READS, instructions[k + 1 :])
            yield tuple(i.argval for i in reads)
        elif here.opname.startswith("STORE") and here.opname != "STORE_ATTR":
            yield ()
    for constant in code.co_consts:
        if isinstance(constant, CodeType) and name in _all(constant):
            yield from _uses(name, constant)


def _all(code: CodeType) -> Collection[str]:
    return (*code.co_freevars, *code.co_names)


def _is_constant(value: Any) -> bool:
    return isinstance(value, bool | int | float | str | np.number | np.ndarray)
