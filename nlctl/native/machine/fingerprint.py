"""Keys of functions and programs: they change whenever their machine code may.

A key is made of everything that a function consists of, as it is in memory: its code, its default
arguments, what it closes over, and the functions and constants that these refer to.  A file that
was edited after it was imported misleads nobody.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import re
import sys
import sysconfig
import types
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Protocol

import numba
import numpy as np

_LIBRARIES = {"numpy", "scipy", "numba", "llvmlite"} | {  # their versions stand for them
    *("pandas", "pyarrow", "matplotlib", "jinja2", "rich"),  # in no equation, and
    *("pydantic", "pydantic_core", "annotated_types", "typing_extensions"),  # built from sets
}
MODULE = "\1of "  # begins a text that names a module and nothing of its content
HEAP_TYPE = 1 << 9  # Py_TPFLAGS_HEAPTYPE: made by a class statement
_CONSTANTS = (int, float, complex, str, bytes, tuple, list, dict, np.ndarray, np.generic)
STANDARD = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib")]


class Sourced(Protocol):
    """Emitted source, and what it refers to: a `Program`, or one that was lowered."""

    @property
    def source(self) -> str: ...

    def namespace(self, *, native: bool) -> dict[str, Any]: ...


def program_key(program: Sourced) -> str:
    """Return a key of a program's source and of everything that it refers to."""
    parts = program.namespace(native=True)
    return _digest(program.source, *(x for name in sorted(parts) for x in (name, parts[name])))


def function_key(*things: Any) -> str:
    """Return a key of functions, and of other things that their machine code depends on."""
    return _digest(*things)


def content_key(*things: Any) -> str:
    """Return a key of what functions compute: the same wherever their files are.

    Unlike `function_key` it does not tell functions of the same content in different modules.
    """
    seen: set[int] = set()
    texts = (text for thing in things for text in _fingerprint(thing, seen))
    return _digest_of(text for text in texts if not text.startswith(MODULE))


def module_key(*modules: types.ModuleType) -> str:
    """Return a key of all that modules define: numba calls what they teach it, but not by name."""
    return _digest_of(text for module in modules for text in _defined(module))


def _digest(*things: Any) -> str:
    seen: set[int] = set()
    return _digest_of(text for thing in things for text in _fingerprint(thing, seen))


def _digest_of(texts: Iterable[str]) -> str:
    digest = hashlib.sha256()
    for text in texts:
        digest.update(text.encode() + b"\0")
    return digest.hexdigest()[:32]


def _fingerprint(thing: Any, seen: set[int], names: Iterable[str] = ()) -> Iterator[str]:
    """Yield text for a thing and all that it refers to; `names` are what is read of a module."""
    if isinstance(thing, str):
        yield repr(thing)
    elif isinstance(thing, tuple | list | dict):
        yield from _of_container(thing, seen)
    elif isinstance(thing, types.ModuleType):
        yield from _of_module(thing, seen, names)
    elif isinstance(thing, numba.types.Type):
        yield from _of_numba_type(thing, seen)
    elif isinstance(function := _plain(thing), types.FunctionType):
        yield _constant(sorted(getattr(thing, "targetoptions", {}).items()))
        yield from _of_function(function, seen)
    elif isinstance(thing, functools.partial):
        yield "partial"
        yield from _fingerprint((thing.func, thing.args, thing.keywords), seen)
    elif isinstance(thing, types.MethodType):
        yield from _fingerprint(thing.__func__, seen)
        yield from _fingerprint(thing.__self__, seen, names)
    elif isinstance(thing, type):
        yield from _of_class(thing, seen)
    elif _is_users(type(thing)):
        yield from _of_object(thing, seen)
    else:
        yield _constant(thing)


def _plain(thing: Any) -> Any:
    """Return the function that numba has compiled or will compile; any other thing as it is."""
    if isinstance(thing, types.FunctionType):
        return thing
    return getattr(thing, "py_func", getattr(thing, "__wrapped__", thing))


def _of_container(thing: tuple | list | dict, seen: set[int]) -> Iterator[str]:
    yield f"{type(thing).__name__} of {len(thing)} {getattr(thing, '_fields', '')}"
    if id(thing) in seen:  # it is inside itself
        return
    seen.add(id(thing))
    for item in thing.items() if isinstance(thing, dict) else thing:
        yield from _fingerprint(item, seen)
    seen.discard(id(thing))


def _of_function(function: types.FunctionType, seen: set[int]) -> Iterator[str]:
    if _is_library(function.__module__):
        yield f"{function.__module__}.{function.__qualname__}"
        return
    if id(function) in seen:
        return
    seen.add(id(function))
    yield f"{MODULE}{function.__module__}"  # what is on disk refers to it by this name
    yield from _code_text(function.__code__)
    for given in (function.__defaults__, function.__kwdefaults__):
        yield from _fingerprint(given, seen)
    names = _all_names(function.__code__)
    for cell in function.__closure__ or ():
        yield from _fingerprint(_content(cell), seen, names)
    for name in names:
        if name in function.__globals__:
            yield name
            yield from _fingerprint(function.__globals__[name], seen, names)


def _of_class(kind: type, seen: set[int]) -> Iterator[str]:
    """Yield text for a class: a user's own for its functions and constants, and its bases."""
    yield _constant(kind)
    if not _is_users(kind) or id(kind) in seen:
        return
    seen.add(id(kind))
    for name, part in sorted(vars(kind).items()):
        functions = [getattr(part, key, None) for key in ("__func__", "func", "fget")]
        function = next(filter(None, functions), part)  # of a method, a property
        if isinstance(_plain(function), types.FunctionType):
            yield name
            yield from _fingerprint(function, seen)
        elif not name.startswith("__") and isinstance(part, _CONSTANTS):
            yield name
            yield from _fingerprint(part, seen)
    for base in kind.__bases__:
        yield from _of_class(base, seen)


def _is_users(kind: type) -> bool:
    """Whether somebody has written a class in Python; one in text that was run is of no module."""
    in_text = kind.__module__ == "builtins"
    return kind.__flags__ & HEAP_TYPE != 0 and (in_text or not _is_library(kind.__module__))


def _of_object(thing: Any, seen: set[int]) -> Iterator[str]:
    """Yield text for an object: its class, and what its attributes are."""
    if id(thing) in seen:
        return
    seen.add(id(thing))
    yield from _of_class(type(thing), seen)
    slots = [name for kind in type(thing).__mro__ for name in getattr(kind, "__slots__", ())]
    held = {name: getattr(thing, name) for name in slots if hasattr(thing, name)}
    for name, value in sorted({**held, **getattr(thing, "__dict__", {})}.items()):
        yield name
        yield from _fingerprint(value, seen)


def _content(cell: types.CellType) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not yet filled
        return None


def _of_module(module: types.ModuleType, seen: set[int], names: Iterable[str]) -> Iterator[str]:
    """Yield text for what is read of a module, ``module.name``; a library's version stands for it.

    Every name that the reader uses may be one.
    """
    yield f"module {module.__name__} {getattr(module, '__version__', '')}"
    if _is_library(module.__name__) or id(module) in seen:
        return
    seen.add(id(module))
    for name in names:
        if name in vars(module):
            yield name
            yield from _fingerprint(vars(module)[name], seen, names)
    seen.discard(id(module))  # another function may read other names of it


def _of_numba_type(kind: numba.types.Type, seen: set[int]) -> Iterator[str]:
    """Yield text for a type; one of our own also for the module that generates its code."""
    yield f"type {kind}"
    module = sys.modules[type(kind).__module__]
    if not _is_library(module.__name__) and id(type(kind)) not in seen:
        seen.add(id(type(kind)))
        yield from _defined(module)


def _defined(module: types.ModuleType) -> Iterator[str]:
    """Yield a module's source, and its functions and methods as they are in memory.

    What these refer to is in the source, and may change while they are used.
    """
    with contextlib.suppress(OSError, TypeError):  # there is none
        yield inspect.getsource(module)
    for name, thing in vars(module).items():
        if getattr(thing, "__module__", None) != module.__name__:
            continue
        for part in vars(thing).values() if isinstance(thing, type) else [thing]:
            if isinstance(function := _plain(part), types.FunctionType):
                yield name
                yield from _code_text(function.__code__)


@functools.cache
def _is_library(name: str | None) -> bool:
    """Whether a module is Python's own or a library's: a version stands for its content."""
    top = (name or "").partition(".")[0]
    if top not in sys.stdlib_module_names:
        return top in _LIBRARIES
    file = getattr(sys.modules.get(top), "__file__", None)  # a user's file may have that name
    return file is None or any(Path(file).is_relative_to(f) for f in STANDARD)


def _code_text(code: types.CodeType) -> Iterator[str]:
    yield code.co_code.hex() + code.co_exceptiontable.hex()
    yield " ".join(code.co_names + code.co_varnames + code.co_freevars)
    yield f"{code.co_argcount} {code.co_kwonlyargcount} {code.co_flags}"
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code_text(constant)
        else:
            yield _constant(constant)


def _all_names(code: types.CodeType) -> list[str]:
    """Return the global names of a code object and of those nested in it, in a fixed order."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names.update(_all_names(constant))
    return sorted(names)


def _constant(value: Any) -> str:
    """Return text for a value that machine code may contain; types by their names."""
    if isinstance(value, type):
        return f"type {value.__qualname__} {getattr(value, '_fields', '')}"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, set | frozenset):
        return f"{type(value).__name__} {sorted(map(repr, value))}"  # in an order of its own
    return re.sub(r" at 0x[0-9a-f]+", "", repr(value))  # addresses differ between processes
