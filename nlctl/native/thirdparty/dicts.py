"""Other people's functions, as they stand: dict parameters and unpacked arguments.

A function of python-control takes ``params``, a dict, and ``x`` and ``u``, arrays of a size that
is only known when it runs.  In machine code the parameters become a record of named fields, and
this module teaches numba to read such a record as a dict is read; an argument that the function
takes apart (``x1, x2 = x``) becomes a tuple.
"""

from __future__ import annotations

import ast
import functools
import operator
import weakref
from collections import namedtuple
from collections.abc import Sequence
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import overload, overload_method, register_jitable

from ...errors import UsageError
from .source import Unreadable, definition
from .values import python_function

RECORDS = (types.NamedTuple, types.NamedUniTuple)
FILLER = "no_parameters"  # numba cannot call methods of a record without fields
_LIBRARIES = ("numpy", "scipy", "numba")  # numba has its own versions of their functions


def params_record(path: str, names: Sequence[str]) -> type:
    """Return the record type that stands for a parameter dict in machine code.

    Raises
    ------
    UsageError
        If a name cannot be that of a field.
    """
    try:
        return namedtuple("Params", names or [FILLER])
    except ValueError as error:
        raise UsageError(
            f"block '{path}' has a parameter that cannot be compiled: {error}; rename it"
        ) from None


def unpacked_arguments(function: Any) -> set[int]:
    """Return the positions of the arguments that a function takes apart, as in ``a, b = x``."""
    bound = 0
    while isinstance(function, functools.partial):
        function, bound = function.func, bound + len(function.args)
    plain = python_function(function)
    bound += plain is not None and plain is not getattr(function, "py_func", function)
    try:
        node = definition(plain) if plain is not None else None
    except Unreadable:
        node = None
    if node is None:
        return set()
    names = [a.arg for a in node.args.posonlyargs + node.args.args][bound:]
    return {
        names.index(part.value.id)
        for part in ast.walk(node)
        if isinstance(part, ast.Assign)
        and isinstance(part.targets[0], ast.Tuple | ast.List)
        and isinstance(part.value, ast.Name)
        and part.value.id in names
    }


_KNOWN: weakref.WeakSet[FunctionType] = weakref.WeakSet()  # a function may call itself


def make_callable(function: FunctionType) -> None:
    """Let machine code call the plain functions that a function refers to, and theirs.

    numba knows them from then on; the functions themselves stay as they are.
    """
    closure = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
    used = [cell.cell_contents for cell in closure.values()]
    used += [function.__globals__.get(name) for name in function.__code__.co_names]
    for other in used:
        library = getattr(other, "__module__", None) or ""
        if not isinstance(other, FunctionType) or library.partition(".")[0] in _LIBRARIES:
            continue
        if other not in _KNOWN:
            _KNOWN.add(other)
            register_jitable(other)
            make_callable(other)


def callable_constant(value: Any) -> Any:
    """Return a function as one that machine code can hand on; any other value as it is."""
    if isinstance(value, np.ufunc):
        return numba.njit(error_model="numpy")(lambda v: value(v))
    if isinstance(value, FunctionType):
        make_callable(value)
        return numba.njit(error_model="numpy")(value)
    return value


def _field(record: Any, key: Any) -> int | None:
    """Return the position of a field, None if there is none; the key must be written out."""
    if not (isinstance(record, RECORDS) and isinstance(key, types.StringLiteral)):
        return None
    fields = record.fields
    return fields.index(key.literal_value) if key.literal_value in fields else None


@overload(operator.getitem, prefer_literal=True)
def _getitem(record, key):
    index = _field(record, key)
    return None if index is None else (lambda record, key: record[index])


@overload(operator.contains, prefer_literal=True)
def _contains(record, key):
    if not (isinstance(record, RECORDS) and isinstance(key, types.StringLiteral)):
        return None
    found = _field(record, key) is not None
    return lambda record, key: found


@overload_method(types.BaseNamedTuple, "get", prefer_literal=True)
def _get(record, key, default=None):
    index = _field(record, key)
    if index is None:
        return lambda record, key, default=None: default
    return lambda record, key, default=None: record[index]
