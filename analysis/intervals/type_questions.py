"""What a function may not ask of its arguments: their type, text, identity, attributes.

A run gives it floats, a proof balls, the compiler symbols.  A function that asks which of these it
got may do one thing in a run and another in a proof, at points that no comparison visits.  So
its code is read before it is called, with all that it calls, and the question is named.
"""

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

from nlctl import wording
from nlctl.expressions.source import codes_in, in_cell

_BUILTINS = ("isinstance", "issubclass", "type", "hasattr", "getattr", "setattr", "delattr",
             "vars", "dir", "callable", "repr", "str", "format", "ascii", "bytes", "memoryview",
             "hash", "id", "print", "eval", "exec", "compile", "globals", "locals", "open",
             "input", "super", "__import__", "__builtins__")  # fmt: skip
_NUMPY = ("isscalar", "issubdtype", "result_type", "common_type", "min_scalar_type", "can_cast",
          "promote_types", "iscomplexobj", "isrealobj", "typename", "mintypecode", "array2string",
          "array_repr", "array_str", "format_float_positional", "format_float_scientific",
          "may_share_memory", "shares_memory", "array_equiv")  # fmt: skip
_OPERATOR = ("is_", "is_not", "attrgetter", "methodcaller")
_CALLS = {*_BUILTINS, *_NUMPY, *_OPERATOR}
_MODULES = {"sys", "inspect", "gc", "traceback", "ctypes", "pickle", "json", "numbers", "types",
            "typing", "abc", "pprint", "reprlib", "weakref", "contextlib", "builtins", "importlib",
            "copyreg", "marshal", "dis", "ast", "_ctypes", "_pickle"}  # fmt: skip
# what numbers have and balls do not, or arrays of both have with another value
_ATTRIBUTES = {"dtype", "itemsize", "nbytes", "strides", "flags", "ctypes", "data", "tobytes",
               "newbyteorder", "setflags", "real", "imag", "conjugate", "hex", "fromhex",
               "is_integer", "as_integer_ratio", "bit_length", "mro"}  # fmt: skip
_OPERATORS = {f"__{name}__" for name in (
    "call", "getitem", "getattr", "getattribute", "add", "radd", "sub", "rsub", "mul", "rmul",
    "pow", "rpow", "truediv", "rtruediv", "matmul", "rmatmul", "neg", "pos", "abs", "lt", "le",
    "gt", "ge", "array_ufunc", "array_function", "array", "float")}  # fmt: skip
_KNOWN_DUNDERS = {"__name__", "__doc__", "__version__"}
_LIBRARIES = tuple(
    str(Path(module.__file__ or "").parent) for module in (np, scipy, numba, ct, flint, wording)
) + (str(Path(__file__).parent.parent),)
_OF_BUILTINS = {id(getattr(builtins, name)): name for name in _BUILTINS if hasattr(builtins, name)}
_MOST = 2_000


def type_question(function: object) -> str | None:
    """Return what a function, or one that it calls, asks of its arguments; None for nothing."""
    waiting, seen = [function], {}
    while waiting and len(seen) < _MOST:
        thing = waiting.pop()
        if id(thing) in seen:
            continue
        seen[id(thing)] = thing  # kept, so that no other one gets its identity
        question = _question_of(thing)
        if question:
            return question
        waiting += _reached(thing)
    return None


def _question_of(thing: object) -> str | None:
    if id(thing) in _OF_BUILTINS:
        return f"asks {_OF_BUILTINS[id(thing)]} under another name"
    if isinstance(thing, types.CodeType):
        return _question_in(thing)
    module = thing.__name__ if isinstance(thing, types.ModuleType) else _module_of(thing)
    return f"uses {module}, which distinguishes types and objects" if module in _MODULES else None


def _module_of(thing: object) -> str:
    """Return the module of a function or class, without what is inside of it."""
    named = isinstance(thing, type | types.FunctionType | types.BuiltinFunctionType)
    return str(getattr(thing, "__module__", "")).partition(".")[0] if named else ""


def _reached(member: object) -> Iterator[Any]:
    """Yield the functions, and what else it reads, that a thing is made of."""
    if isinstance(member, staticmethod | classmethod):
        yield member.__func__
    elif isinstance(member, types.MethodType):
        yield member.__func__
        code = getattr(member.__func__, "__code__", None)
        yield from _of_object(member.__self__, _names(code) if code else set())
    elif isinstance(member, property):
        yield member.fget
    elif isinstance(member, functools.partial):
        yield from (member.func, *member.args, *member.keywords.values())
    elif isinstance(member, types.FunctionType):
        yield from _of_function(member)
    elif isinstance(member, types.CodeType):
        yield from (part for part in member.co_consts if isinstance(part, types.CodeType))
    elif isinstance(member, tuple | list | dict) and len(member) < 50:
        parts = member.values() if isinstance(member, dict) else member
        yield from (part for part in parts if callable(part))
    else:
        yield from _of_object(member, set())


def _of_function(function: types.FunctionType) -> Iterator[Any]:
    """Yield its code, what it closes over and, of a user's, what it names."""
    yield getattr(function, "__wrapped__", None)
    held = [*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()]
    held += [in_cell(cell) for cell in function.__closure__ or ()]
    if is_of_library(function):
        yield from held
        return
    yield function.__code__
    names = _names(function.__code__)
    held += [function.__globals__[name] for name in names & set(function.__globals__)]
    for thing in held:
        yield thing
        yield from _of_object(thing, names)


def _of_object(owner: object, names: set[str]) -> Iterator[Any]:
    """Yield what is called of an object, a class or a module: by name, or by operators."""
    if isinstance(owner, types.ModuleType) and _is_of_library(owner.__name__):
        return
    if not isinstance(owner, type | types.FunctionType | types.ModuleType):
        yield getattr(owner, "py_func", None)  # numba's
        yield getattr(owner, "__wrapped__", None)
        yield getattr(owner, "pyfunc", None)  # of np.vectorize
    fields = {} if isinstance(owner, type) else getattr(owner, "__dict__", {})
    members: dict[str, Any] = {}
    for kind in reversed(owner.__mro__ if isinstance(owner, type) else type(owner).__mro__):
        members |= {} if _is_of_library(kind.__module__) else vars(kind)
    members |= fields
    waiting, done = (names | _OPERATORS) & set(members), set()
    while waiting:
        name = waiting.pop()
        done.add(name)
        yield members[name]
        if name in fields:
            yield from _of_object(fields[name], names - {name})
        function = getattr(members[name], "fget", getattr(members[name], "__func__", members[name]))
        if isinstance(function, types.FunctionType):  # what it calls of its own object
            waiting |= (_names(function.__code__) & set(members)) - done


def _names(code: types.CodeType) -> set[str]:
    return {name for part in codes_in(code) for name in part.co_names}


def _question_in(code: types.CodeType) -> str | None:
    """Return what one body of code asks."""
    line, last, caught, entered = code.co_firstlineno, None, 0, 0
    for step in dis.get_instructions(code):
        line = step.starts_line if type(step.starts_line) is int else line
        name, op = step.argval, step.opname
        question = None
        if op in ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_DEREF") and name in _CALLS:
            question = name
        elif op in ("LOAD_ATTR", "LOAD_METHOD", "LOAD_FROM_DICT_OR_GLOBALS", "IMPORT_FROM"):
            dunder = str(name).startswith("__") and name not in _KNOWN_DUNDERS
            question = f".{name}" if dunder or name in _CALLS | _ATTRIBUTES else None
        elif op == "IMPORT_NAME" and str(name).partition(".")[0] in _MODULES:
            question = f"the module {name}"
        elif op == "IS_OP" and not (last is not None and last.argval is None):
            question = "whether it is an object ('is')"
        elif op in ("FORMAT_VALUE", "FORMAT_SIMPLE", "FORMAT_WITH_SPEC", "CONVERT_VALUE"):
            question = "for a text ('f\"{...}\"')"
        elif op in ("MATCH_CLASS", "MATCH_MAPPING", "MATCH_SEQUENCE"):
            question = "for a class ('match')"
        entered += op == "WITH_EXCEPT_START"
        caught += op == "PUSH_EXC_INFO"
        if question:
            return f"asks {question} in {code.co_qualname}, line {line}"
        last = step
    return f"catches exceptions in {code.co_qualname} ('try')" if caught > entered else None


def is_of_library(function: object) -> bool:
    """Whether a function is one of nlctl or of a library, whatever it closes over."""
    code = getattr(getattr(function, "py_func", function), "__code__", None)
    return code is not None and code.co_filename.startswith(_LIBRARIES)


def _is_of_library(module: str) -> bool:
    libraries = ("numpy", "scipy", "numba", "control", "flint", "nlctl", "builtins", "math")
    return module.partition(".")[0] in libraries
