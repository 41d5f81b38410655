"""Keys of functions and programs: they change whenever their machine code may.

A key is made of everything that a function consists of, as it is in memory: its code, its default
arguments, what it closes over, and the functions and constants that these refer to.  A file that
was edited after it was imported misleads nobody.
"""

import contextlib
import dis
import functools
import hashlib
import inspect
import os
import re
import sys
import sysconfig
import types
from collections.abc import Iterable, Iterator
from numbers import Number
from pathlib import Path
from typing import Any

import numba
import numpy as np

from ...annotations import unreported
from ...expressions.source import codes_in, in_cell
from ..purity.captured import held_attributes
from ..purity.held import LAID_OUT, OPAQUE, held_by, inherited
from ..purity.outside import asked_outside, imports_in

_LIBRARIES = {"numpy", "scipy", "numba", "llvmlite"} | {  # their versions stand for them
    *("pandas", "pyarrow", "matplotlib", "jinja2", "rich"),  # in no equation, and
    *("pydantic", "pydantic_core", "annotated_types", "typing_extensions"),  # built from sets
}
MODULE = "\1of "  # begins a text that names a module and nothing of its content
HEAP_TYPE = 1 << 9  # Py_TPFLAGS_HEAPTYPE: made by a class statement
_CONSTANTS = (int, float, complex, str, bytes, tuple, list, dict, np.ndarray, np.generic)
_NUMBERS = frozenset({int, float, complex, bool, type(None)})
_HOLDERS = (str, tuple, list, dict)
_PYTHONS = ("__", "_abc_impl", "_is_protocol")  # beginnings of attributes that Python makes
_MACHINERY = (
    types.MemberDescriptorType,
    types.GetSetDescriptorType,
    types.WrapperDescriptorType,
) + (types.ClassMethodDescriptorType, types.MethodDescriptorType, property)
_RECORDS = ("nlctl.params", "nlctl.pickles")
RUNNERS = {"eval", "exec", "__import__"}
FINDERS = {"globals", "vars", *RUNNERS}
READERS = {"open", "loadtxt", "genfromtxt", "fromfile", "memmap", "loadmat", "read_csv"} | {
    *("read_excel", "read_hdf", "read_json", "read_parquet", "read_pickle", "read_table"),
    *("read_text", "read_bytes", "read_feather", "read_sql", "urlopen", "open_memmap"),
}
STANDARD = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib")]


class _Seen(dict[int, Any]):
    """Things that have been gone through, kept so that no other one takes their places."""

    def __init__(self, *, deep: bool) -> None:
        super().__init__()
        self.deep = deep  # whether objects of libraries are read
        self.kept: list[Any] = []

    def add(self, thing: object) -> bool:
        """Note a thing; return whether it is new."""
        if id(thing) in self:
            return False
        self[id(thing)] = thing
        return True


def function_key(*things: object) -> str:
    """Return a key of functions, and of other things that their machine code depends on."""
    seen = _Seen(deep=False)
    return _digest_of(text for thing in things for text in _fingerprint(thing, seen))


def content_key(*things: object) -> str:
    """Return a key of what functions compute: the same wherever their files are."""
    # Unlike `function_key` it is the same for functions of the same content in different modules.
    return content_of(*things)[0]


def unseen_in(*things: object) -> list[str]:
    """Return what `content_key` cannot see of functions: another content has the same key."""
    return content_of(*things)[1]


def content_of(*things: object) -> tuple[str, list[str]]:
    """Return a key of what functions compute, and what it cannot see of them."""
    seen = _Seen(deep=True)  # into objects of libraries as well
    texts = [text for thing in things for text in _fingerprint(thing, seen)]
    key = _digest_of(text for text in texts if not _is_place(text))
    unseen = (text.removeprefix(OPAQUE) for text in texts if text.startswith(OPAQUE))
    return key, list(dict.fromkeys(unseen))


def _is_place(text: str) -> bool:
    """Whether a text only says where something is, or what its module is called."""
    names_module = text.startswith("module ") and not _is_library(text.split(" ")[1])
    return text.startswith(MODULE) or names_module


def module_key(*modules: types.ModuleType) -> str:
    """Return a key of all that modules define: numba calls what they teach it, but not by name."""
    return _digest_of(text for module in modules for text in _defined(module))


def _digest_of(texts: Iterable[str]) -> str:
    every = "\0".join((*texts, ""))
    return hashlib.sha256(every.encode()).hexdigest()[:32]


def _fingerprint(thing: object, seen: _Seen, names: Iterable[str] = ()) -> Iterator[str]:
    """Yield text for a thing and all that it refers to; `names` are what is read of a module."""
    kind = type(thing)
    if kind in _NUMBERS:
        yield repr(thing)
    elif kind is str and isinstance(thing, str):
        yield _of_text(thing, seen)
    elif isinstance(thing, _HOLDERS):
        is_text = isinstance(thing, str)
        yield from (_of_text(thing, seen),) if is_text else _of_container(thing, seen)
        if seen.deep and _is_users(type(thing)):
            yield from _of_object(thing, seen)
    elif isinstance(thing, types.ModuleType):
        yield from _of_module(thing, seen, names)
    elif isinstance(thing, numba.types.Type):
        yield from _of_numba_type(thing, seen)
    elif isinstance(function := _plain(thing, seen), types.FunctionType):
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
        yield from _of_library_object(thing, seen)


def _of_text(text: str, seen: _Seen) -> str:
    """Return a text as it counts: python-control numbers the systems of a process, ``sys[7]``."""
    return repr(re.sub(r"sys\[\d+\]", "sys[]", text) if seen.deep and "sys[" in text else text)


def _plain(thing: object, seen: _Seen | None = None) -> Any:
    """Return the function that numba has compiled or will compile; any other thing as it is."""
    if isinstance(thing, types.FunctionType):
        return thing
    if seen is not None and seen.deep and _is_users(type(thing)):  # it may hold more
        return thing
    try:
        return getattr(thing, "py_func", getattr(thing, "__wrapped__", thing))
    except OSError:  # `ctypes.cdll` looks for a library of that name
        return thing


def _of_container(thing: tuple | list | dict, seen: _Seen) -> Iterator[str]:
    yield f"{type(thing).__name__} of {len(thing)} {getattr(thing, '_fields', '')}"
    if not seen.add(thing):  # it is inside itself
        return
    for item in thing.items() if isinstance(thing, dict) else thing:
        yield from _fingerprint(item, seen)
    del seen[id(thing)]
    seen.kept.append(thing)


def _of_function(function: types.FunctionType, seen: _Seen) -> Iterator[str]:
    if (called := unreported(function)) is not function:  # which only words the errors of the other
        yield from _fingerprint(called, seen)
        return
    if _is_library(function.__module__) or (seen.deep and _is_controls(function)):
        yield f"{function.__module__}.{function.__qualname__}"
        if seen.deep and (function.__closure__ or function.__dict__) and seen.add(function):
            cells = [in_cell(cell) for cell in function.__closure__ or ()]
            yield from _fingerprint((cells, function.__defaults__, vars(function)), seen)
        return
    if not seen.add(function):
        return
    yield f"{MODULE}{function.__module__}"  # what is on disk refers to it by this name
    yield _code_text(function.__code__)
    for given in (function.__defaults__, function.__kwdefaults__):
        yield from _fingerprint(given, seen)
    names = _all_names(function.__code__)
    if "getattr" in names:
        names = sorted({*names, *_all_texts(function.__code__)})
    for cell in function.__closure__ or ():
        yield from _fingerprint(in_cell(cell), seen, names)
    for name in names:
        if name in function.__globals__:
            yield name
            yield from _fingerprint(function.__globals__[name], seen, names)
    if seen.deep:
        yield from _looked_up(function, names, seen)
        yield from _fingerprint(vars(function), seen)


def _looked_up(function: types.FunctionType, names: list[str], seen: _Seen) -> Iterator[str]:
    """Yield text for what a function finds by texts, ``globals()["K"]``, and what it reads then."""
    where = f" in '{function.__qualname__}'"
    calls = _globals_of(function.__code__) - set(function.__globals__)
    texts, named = _all_texts(function.__code__), list[str]()
    if calls & FINDERS:
        named = [text for text in texts if text in function.__globals__ and text not in names]
        for text in named:
            yield text
            yield from _fingerprint(function.__globals__[text], seen, names)
    if {"environ", "getenv"} & set(names):
        yield from (f"environment {text} {os.environ.get(text)}" for text in texts)
    unknown = calls & RUNNERS | (set() if named else calls & {"globals", "vars"})
    unknown |= {"import_module"} & set(names)
    for name in sorted(unknown):
        yield f"{OPAQUE}what '{name}' finds{where}"
    for answer in dict.fromkeys(asked_outside(function)):
        yield f"{OPAQUE}{answer}{where})"
    for name in imports_in(function, _is_named):
        yield f"{OPAQUE}what it imports when it is called ('{name}'{where})"
    for name in sorted((set(names) - {"open"}) & READERS | calls & {"open"}):
        yield f"{OPAQUE}files that are read when it is called ('{name}'{where})"


@functools.lru_cache(maxsize=4096)
def _all_texts(code: types.CodeType) -> list[str]:
    """Return the texts that stand in a code object and in those nested in it."""
    return sorted({c for part in codes_in(code) for c in part.co_consts if isinstance(c, str)})


@functools.lru_cache(maxsize=4096)  # code never changes, what names refer to may
def _globals_of(code: types.CodeType) -> set[str]:
    """Return the names that a code object, and those nested in it, read by themselves."""
    steps = (step for part in codes_in(code) for step in dis.get_instructions(part))
    return {step.argval for step in steps if "GLOBAL" in step.opname}


def _of_class(kind: type, seen: _Seen) -> Iterator[str]:
    """Yield text for a class: a user's own for its functions and constants, and its bases."""
    yield _constant(kind)
    if not _is_users(kind) or (seen.deep and _is_controls(kind)) or not seen.add(kind):
        return
    for name, part in sorted(vars(kind).items()):
        is_partial = isinstance(part, functools.partial | functools.partialmethod)
        keys = () if seen.deep and is_partial else ("__func__", "func", "fget")
        functions = [getattr(part, key, None) for key in keys]
        function = next(filter(None, functions), part)  # of a method, a property
        if getattr(function, "__module__", "") in _RECORDS:
            continue  # what every record has of nlctl, and how it is pickled
        if isinstance(_plain(function), types.FunctionType):
            yield name
            yield from _fingerprint(function, seen)
        elif not name.startswith("__") and isinstance(part, _CONSTANTS):
            yield name
            yield from _fingerprint(part, seen)
        elif seen.deep and not (name.startswith(_PYTHONS) or isinstance(part, _MACHINERY)):
            yield name
            yield from _fingerprint(getattr(part, "__func__", part), seen)
    for base in (*kind.__bases__, *((type(kind),) if seen.deep else ())):
        yield from _of_class(base, seen)


def _is_controls(thing: object) -> bool:
    """Whether a function or a class is python-control's, whose version stands next to every key."""
    return str(thing.__module__).partition(".")[0] == "control"


def _is_users(kind: type) -> bool:
    """Whether somebody has written a class in Python; one in text that was run is of no module."""
    module = getattr(kind, "__module__", None)  # arrays of ctypes have none
    if not isinstance(module, str):  # a class of C that describes those of its objects
        return False
    in_text = module == "builtins"
    return kind.__flags__ & HEAP_TYPE != 0 and (in_text or not _is_library(module))


def _of_object(thing: object, seen: _Seen) -> Iterator[str]:
    """Yield text for an object: its class, and what its attributes are."""
    if not seen.add(thing):
        return
    yield from _of_class(type(thing), seen)
    for name, value in sorted(held_attributes(thing).items()):
        if not (seen.deep and name in LAID_OUT):
            yield name
            yield from _fingerprint(value, seen)
    # objects of a library's class may hold what is in no attribute of Python's
    bases = [base for base in type(thing).__mro__[:-1] if not _is_users(base)]
    held_apart = (b.__flags__ & HEAP_TYPE == 0 or b.__module__.startswith("pandas.") for b in bases)
    if any(held_apart):
        held = inherited(thing)  # a float with a name, a list with more
        yield from (held,) if isinstance(held, str) else _fingerprint(held, seen)


def _of_library_object(thing: object, seen: _Seen) -> Iterator[str]:
    """Yield text for an object of a library, and for all that it holds."""
    if seen.deep and isinstance(thing, set | frozenset):
        yield f"{type(thing).__name__} {sorted(_digest_of(_fingerprint(t, seen)) for t in thing)}"
        return
    held = held_by(thing, _is_library) if seen.deep else None
    if held is None:
        yield _constant(thing)
    elif isinstance(held, str):
        yield held
    elif seen.add(thing):
        yield f"object {type(thing).__qualname__}"
        yield from _fingerprint(held, seen)


def _of_module(module: types.ModuleType, seen: _Seen, names: Iterable[str]) -> Iterator[str]:
    """Yield text for what is read of a module, ``module.name``; a library has its version."""
    # Every name that the reader uses may be one. Numbers of libraries count as well: ``physics.g``
    # is another one in another version, or where somebody has set it.
    yield f"module {module.__name__} {getattr(module, '__version__', '')}"
    if _is_library(module.__name__):
        read = ((name, vars(module).get(name)) for name in names)
        yield from (f"{name} {value!r}" for name, value in read if isinstance(value, Number))
        return
    if not seen.add(module):
        return
    for name in names:
        if name in vars(module):
            yield name
            yield from _fingerprint(vars(module)[name], seen, names)
    if seen.deep and "__getattr__" in vars(module):  # it makes what the module lacks
        yield from _fingerprint(vars(module)["__getattr__"], seen)
    del seen[id(module)]  # another function may read other names of it


def _of_numba_type(kind: numba.types.Type, seen: _Seen) -> Iterator[str]:
    """Yield text for a type; one of our own also for the module that generates its code."""
    yield f"type {kind}"
    module = sys.modules[type(kind).__module__]
    if not _is_library(module.__name__) and seen.add(type(kind)):
        yield from _defined(module)


def _defined(module: types.ModuleType) -> Iterator[str]:
    """Yield a module's source, and its functions, methods and constants as they are in memory."""
    # What these refer to is in the source, and may change while they are used.
    with contextlib.suppress(OSError, TypeError):  # there is none
        yield inspect.getsource(module)
    for name, thing in vars(module).items():
        if isinstance(thing, Number | str | tuple) and not name.startswith("__"):
            yield f"{name} {_constant(thing)}"
        if getattr(thing, "__module__", None) != module.__name__:
            continue
        for part in vars(thing).values() if isinstance(thing, type) else [thing]:
            if isinstance(function := _plain(part), types.FunctionType):
                yield name
                yield _code_text(function.__code__)


def _is_named(module: str) -> bool:
    """Whether the version of a module stands next to every key."""
    return module.partition(".")[0] in ("nlctl", "control") or _is_library(module)


@functools.cache
def _is_library(name: str | None) -> bool:
    """Whether a module is Python's own or a library's: a version stands for its content."""
    top = (name or "").partition(".")[0]
    if top not in sys.stdlib_module_names:
        return top in _LIBRARIES
    file = getattr(sys.modules.get(top), "__file__", None)  # a user's file may have that name
    return file is None or any(Path(file).is_relative_to(f) for f in STANDARD)


@functools.lru_cache(maxsize=4096)
def _code_text(code: types.CodeType) -> str:
    """Return text for a code object and those nested in it, which never change."""
    return "\0".join(_code_parts(code))


def _code_parts(code: types.CodeType) -> Iterator[str]:
    yield code.co_code.hex() + code.co_exceptiontable.hex()
    yield " ".join(code.co_names + code.co_varnames + code.co_freevars)
    yield f"{code.co_argcount} {code.co_kwonlyargcount} {code.co_flags}"
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code_parts(constant)
        else:
            yield _constant(constant)


@functools.lru_cache(maxsize=4096)
def _all_names(code: types.CodeType) -> list[str]:
    """Return the global names of a code object and of those nested in it, in a fixed order."""
    return sorted({name for part in codes_in(code) for name in part.co_names})


def _constant(value: object) -> str:
    """Return text for a value that machine code may contain; types by their names."""
    if isinstance(value, type):
        return f"type {value.__qualname__} {getattr(value, '_fields', '')}"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, set | frozenset):
        return f"{type(value).__name__} {sorted(map(repr, value))}"  # in an order of its own
    text = repr(value)  # addresses differ between processes
    return re.sub(r" at 0x[0-9a-f]+", "", text) if " at 0x" in text else text
