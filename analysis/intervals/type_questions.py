"""What a function may not ask of its arguments: their type, text, identity, attributes.

A run gives it floats, a proof balls, the compiler symbols.  A function that asks which of these it
got may do one thing in a run and another in a proof, at points that no comparison looks at.  So
its code is read before it is called, with all that it calls, and the question is named.
"""

from __future__ import annotations

import builtins
import dis
import functools
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import control as ct
import flint
import numba
import numpy as np
import scipy

import nlctl

__all__ = ["is_of_library", "type_question"]

_TYPE = ("isinstance", "issubclass", "type", "hasattr", "getattr", "callable", "vars", "dir",
         "singledispatch", "singledispatchmethod", "attrgetter", "methodcaller", "getmembers",
         "isscalar", "issubdtype", "issubclass_", "result_type", "common_type", "min_scalar_type",
         "can_cast", "iscomplexobj", "isrealobj", "promote_types", "typename", "mintypecode",
         "isfunction", "get_type_hints", "Real", "Number", "supports_index")  # fmt: skip
_TEXT = ("repr", "str", "format", "ascii", "hash", "id", "is_", "is_not", "getsizeof", "getrefcount",
         "dumps", "array2string", "array_repr", "array_str", "format_float_positional", "bytes",
         "format_float_scientific", "may_share_memory", "shares_memory", "print",
         "memoryview", "pformat", "suppress", "array_equiv")  # fmt: skip
_REACH = ("eval", "exec", "compile", "globals", "locals", "__import__", "open", "input", "delattr",
          "setattr", "_getframe", "currentframe", "stack", "getframeinfo", "__builtins__", "super",
          "import_module")  # fmt: skip
_CALLS = {*_TYPE, *_TEXT, *_REACH}
ATTRIBUTES = {"dtype", "itemsize", "nbytes", "strides", "flags", "ctypes", "data", "hex",
              "is_integer", "as_integer_ratio", "real", "imag", "conjugate", "bit_length", "tobytes",
              "value", "gradient", "chain", "apply", "here", "base", "quotient", "is_constant",
              "terms", "partial", "key", "coefficient", "expr", "graph", "cells", "registry",
              "dispatch", "isbuiltin", "newbyteorder", "numerator", "denominator",
              "fromhex", "mro", "setflags", "_text", "watched"}  # fmt: skip
# of these, what records and named tuples of parameters may have, too
_KNOWN_DUNDERS = {"__name__", "__doc__"}
_LIBRARIES = tuple(
    str(Path(module.__file__ or "").parent) for module in (np, scipy, numba, ct, flint, nlctl, dis)
) + (str(Path(__file__).parent.parent),)
_BUILTINS = {id(getattr(builtins, name)): name for name in _CALLS if hasattr(builtins, name)}
_MOST = 2_000


def type_question(function: Any) -> str | None:
    """Return what a function, or one that it calls, asks of its arguments; None for nothing.

    Parameters
    ----------
    function : callable
        Functions of nlctl and of libraries are not read, but those that they close over are.

    Returns
    -------
    str or None
        In words: function, line, and what it does.

    Examples
    --------
    >>> from analysis.intervals.type_questions import type_question
    >>> print(type_question(lambda v: v if isinstance(v, float) else 2 * v).partition(" in ")[0])
    asks isinstance
    >>> print(type_question(lambda v: 2 * v))
    None
    """
    waiting, seen = [function], set()
    while waiting and len(seen) < _MOST:
        thing = waiting.pop()
        if id(thing) in seen:
            continue
        seen.add(id(thing))
        found = _question_of(thing)
        if found:
            return found
        waiting += _reached(thing)
    return None


def _question_of(thing: Any) -> str | None:
    if id(thing) in _BUILTINS:
        return f"asks {_BUILTINS[id(thing)]} under another name"
    if isinstance(thing, types.CodeType):
        return _question_in(thing)
    return None


def _reached(thing: Any) -> Iterator[Any]:
    """Yield the functions, and what else it reads, that a thing is made of."""
    if isinstance(thing, types.MethodType):
        yield thing.__func__
    elif isinstance(thing, staticmethod | classmethod):
        yield thing.__func__
    elif isinstance(thing, functools.partial):
        yield from (thing.func, *thing.args, *thing.keywords.values())
    elif isinstance(thing, types.FunctionType):
        yield from _of_function(thing)
    elif isinstance(thing, types.CodeType):
        yield from (part for part in thing.co_consts if isinstance(part, types.CodeType))
    elif isinstance(thing, tuple | list) and len(thing) < 50:
        yield from (part for part in thing if callable(part))
    elif isinstance(thing, dict) and len(thing) < 50:
        yield from (part for part in thing.values() if callable(part))
    elif hasattr(thing, "py_func"):  # numba's
        yield thing.py_func
    elif isinstance(thing, type) or not hasattr(type(thing), "__call__"):
        return
    elif not _is_of_library(type(thing).__module__):
        yield from (getattr(type(thing), "__call__", None), getattr(thing, "__wrapped__", None))


def _of_function(function: types.FunctionType) -> Iterator[Any]:
    """Yield its code, what it closes over and, of a user's, the globals that it names."""
    wrapped = getattr(function, "__wrapped__", None)
    yield from [] if wrapped is None else [wrapped]
    for cell in function.__closure__ or ():
        try:
            yield cell.cell_contents
        except ValueError:  # it has no value yet
            continue
    yield from function.__defaults__ or ()
    yield from (function.__kwdefaults__ or {}).values()
    if function.__code__.co_filename.startswith(_LIBRARIES):
        return
    yield function.__code__
    names = set(_names(function.__code__))
    for name in names & set(function.__globals__):
        yield function.__globals__[name]


def _names(code: types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for part in code.co_consts:
        if isinstance(part, types.CodeType):
            yield from _names(part)


def _question_in(code: types.CodeType) -> str | None:
    """Return what one body of code asks."""
    line, last, raised, entered = code.co_firstlineno, None, 0, 0
    for step in dis.get_instructions(code):
        line = step.starts_line if type(step.starts_line) is int else line
        name, op = step.argval, step.opname
        asked = None
        if op in ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_DEREF") and name in _CALLS:
            asked = name
        elif op in ("LOAD_ATTR", "LOAD_METHOD", "LOAD_FROM_DICT_OR_GLOBALS", "IMPORT_FROM"):
            dunder = str(name).startswith("__") and name not in _KNOWN_DUNDERS
            asked = f".{name}" if dunder or name in _CALLS | ATTRIBUTES else None
        elif op == "IS_OP" and not (last is not None and last.argval is None):
            asked = "whether it is an object ('is')"
        elif op in ("FORMAT_VALUE", "FORMAT_SIMPLE", "FORMAT_WITH_SPEC", "CONVERT_VALUE"):
            asked = "for a text ('f\"{...}\"')"
        elif op in ("MATCH_CLASS", "MATCH_MAPPING", "MATCH_SEQUENCE"):
            asked = "for a class ('match')"
        entered += op in ("WITH_EXCEPT_START",)
        raised += op in ("PUSH_EXC_INFO",)
        if asked:
            return f"asks {asked} in {code.co_qualname}, line {line}"
        last = step
    return f"catches exceptions in {code.co_qualname} ('try')" if raised > entered else None


def is_of_library(function: Any) -> bool:
    """Whether a function is one of nlctl or of a library, whatever it closes over."""
    code = getattr(getattr(function, "py_func", function), "__code__", None)
    return code is not None and code.co_filename.startswith(_LIBRARIES)


def _is_of_library(module: str) -> bool:
    return module.partition(".")[0] in ("numpy", "scipy", "numba", "control", "nlctl", "analysis")
