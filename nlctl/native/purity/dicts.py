"""Other people's functions, unchanged: dict parameters and unpacked arguments.

A function of python-control takes ``params``, a dict, and ``x`` and ``u``, arrays of a size that
is only known when it runs.  In machine code the parameters become a type of their own, made of a
named tuple, that numba is taught here to read as a dict is read; what named tuples mean in a user's
own numba code stays as it is.  An argument that the function takes apart (``x1, x2 = x``) becomes a
tuple.
"""

from __future__ import annotations

import ast
import functools
import operator
from collections import namedtuple
from collections.abc import Sequence
from types import CellType, FunctionType
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import (
    intrinsic,
    models,
    overload,
    overload_method,
    register_jitable,
    register_model,
)

from ...errors import UsageError
from ...expressions.source import Unreadable, definition
from .objects import moved_function
from .values import python_function

FILLER = "no_parameters"  # numba cannot call methods of a record without fields
_LIBRARIES = ("numpy", "scipy", "numba")  # numba has its own versions of their functions


def params_record(path: str, names: Sequence[str]) -> type:
    """Return the record type that stands for a parameter dict in machine code."""
    try:
        return namedtuple("Params", names or [FILLER])
    except ValueError as error:
        raise UsageError(
            f"block '{path}' has a parameter that cannot be compiled: {error}; rename it"
        ) from None


def unpacked_arguments(function: object) -> set[int]:
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


def callable_now(function: FunctionType, **options: Any) -> Any:
    """Return a function that machine code can call, with the plain functions that it refers to."""
    # numba keeps the machine code of a function for ever, with what its constants were at first.
    # So it is given copies; the functions themselves stay as they are.
    return _copied(function, {}, options)


def _copied(function: FunctionType, copies: dict[FunctionType, Any], options: Any) -> Any:
    names, cells = dict(function.__globals__), function.__closure__ or ()
    places = [CellType() for _ in cells]
    copied = moved_function(function, function.__code__, names, places)
    code = copies[function] = numba.njit(**options)(copied)  # a function may call itself
    for name in function.__code__.co_names:
        if name in names:
            names[name] = _callable_part(names[name], copies)
    for place, cell in zip(places, cells, strict=True):
        place.cell_contents = _callable_part(cell.cell_contents, copies)
    return code


def _callable_part(thing: object, copies: dict[FunctionType, Any]) -> Any:
    """Return what a function refers to, a plain function as one that machine code can call."""
    library = str(getattr(thing, "__module__", None)).partition(".")[0]
    if not isinstance(thing, FunctionType) or library in _LIBRARIES:
        return thing
    return copies[thing] if thing in copies else _copied(thing, copies, {})


def callable_constant(value: object) -> Any:
    """Return a function as one that machine code can hand on; any other value as it is."""
    if isinstance(value, np.ufunc):
        return numba.njit(error_model="numpy")(lambda v: value(v))
    return callable_now(value, error_model="numpy") if isinstance(value, FunctionType) else value


class Params(types.Type):
    """Type of a parameter dict in machine code: a named tuple, read by keys."""

    def __init__(self, values: types.NamedTuple) -> None:
        self.values = values
        super().__init__(name=f"Params({values})")

    @property
    def key(self) -> Any:
        """What distinguishes it from other types: names may be alike."""
        return self.values

    def field(self, key: object) -> int | None:
        """Return the position of a field, None if there is none; the key must be written out."""
        if not isinstance(key, types.StringLiteral) or key.literal_value not in self.values.fields:
            return None
        return self.values.fields.index(key.literal_value)


@register_model(Params)
class _ParamsModel(models.StructModel):
    def __init__(self, manager, fe_type):
        super().__init__(manager, fe_type, [("values", fe_type.values)])


@intrinsic
def read_by_keys(typing_context, values):
    """Return a named tuple as a parameter dict."""

    def generate(context, builder, sig, args):
        params = context.make_helper(builder, sig.return_type)
        params.values = args[0]
        context.nrt.incref(builder, sig.args[0], args[0])
        return params._getvalue()

    return Params(values)(values), generate


@intrinsic
def _values(typing_context, params):
    """Return the named tuple of a parameter dict."""

    def generate(context, builder, sig, args):
        values = context.make_helper(builder, sig.args[0], args[0]).values
        context.nrt.incref(builder, sig.return_type, values)
        return values

    return params.values(params), generate


@overload(operator.getitem, prefer_literal=True)
def _getitem(params, key):
    index = params.field(key) if isinstance(params, Params) else None
    return None if index is None else (lambda params, key: _values(params)[index])  # pyright: ignore[reportCallIssue]


@overload(operator.contains, prefer_literal=True)
def _contains(params, key):
    if not (isinstance(params, Params) and isinstance(key, types.StringLiteral)):
        return None
    is_there = params.field(key) is not None
    return lambda params, key: is_there


@overload_method(Params, "get", prefer_literal=True)
def _get(params, key, default=None):
    if not isinstance(key, types.StringLiteral):
        return None
    index = params.field(key)
    if index is None:
        return lambda params, key, default=None: default
    return lambda params, key, default=None: _values(params)[index]  # pyright: ignore[reportCallIssue]


# -- what a function returns, as something that can be indexed -------------------------------------


MESSAGE = "a function returns another number of values than its block has states or outputs"


def as_vector(value: object, count: int) -> Any:
    """Return a function's result, an array, tuple, list or number, as `count` values."""
    return _counted(value if isinstance(value, tuple) else np.asarray(value).reshape(-1), count)


@register_jitable
def _counted(values, count):
    if len(values) != count:
        raise ValueError(MESSAGE)
    return values


@overload(as_vector)
def _as_vector_native(value, count):  # numba compares signatures: no annotations here
    if isinstance(value, types.BaseTuple):
        return lambda value, count: _counted(value, count)
    if isinstance(value, types.Array):
        if value.ndim == 1:  # no copy: it is only read
            return lambda value, count: _counted(value, count)
        return lambda value, count: _counted(value.copy().reshape(-1), count)
    if isinstance(value, types.List | types.ListType):
        return lambda value, count: _counted(np.array(value).reshape(-1), count)
    if isinstance(value, types.Number | types.Boolean):
        return lambda value, count: _counted((value,), count)
    return None
