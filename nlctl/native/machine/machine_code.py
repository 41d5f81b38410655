"""Compiled functions as bytes and back: the one place for what numba does not document.

numba's own cache writes files that nobody verifies, keyed by the file of the outermost function
alone.  Here a function's dispatcher is given a cache of ours, which asks `store`.  Relied on, and
held by a test each, are

- ``Dispatcher._cache`` with ``load_overload`` and ``save_overload``, which `numba` calls in
  ``Dispatcher.compile`` before and after it compiles a signature;
- ``CompileResult._reduce`` and ``_rebuild``: compiled code as plain data;
- ``library.has_dynamic_globals`` and ``lifted``: code that holds addresses of this process;
- ``codegen().magic_tuple()``: the processor that code is made for;
- ``overloads``, ``fndesc.llvm_cfunc_wrapper_name``, ``get_pointer_to_function``: addresses;
- ``global_compiler_lock``: several threads may ask at the same time;
- the names in `SETTINGS`, of `numba.core.config`.
"""

from __future__ import annotations

import functools
import hashlib
import pickle
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cloudpickle
import llvmlite
import numba
import numpy as np
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import NumbaError
from numba.core.registry import cpu_target

from . import store
from .fingerprint import function_key

# settings of numba that change the code
SETTINGS = ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "USING_SVML")
SETTINGS += ("DEBUGINFO_DEFAULT", "LLVM_REFPRUNE_PASS", "LLVM_REFPRUNE_FLAGS")


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A function that is to be machine code.

    Attributes
    ----------
    function : callable
        Plain Python.
    signature : numba signature
    options : mapping
        Of `numba.njit`.
    """

    function: Callable[..., Any]
    signature: Any
    options: Mapping[str, Any]


def machine_code(key: str, wanted: Sequence[Wanted]) -> list[Any]:
    """Return functions as machine code, from the store, or compiled and kept there as one entry.

    With NUMBA_DISABLE_JIT=1 they are returned as they stand.

    Parameters
    ----------
    key : str
        Of all that their code is made of; what compiles it is added here.
    wanted : sequence of Wanted

    Raises
    ------
    numba.core.errors.NumbaError
        If a function cannot be compiled.
    """
    if getattr(config, "DISABLE_JIT", False):
        return [each.function for each in wanted]
    key = store_key(key, *((str(each.signature), each.options) for each in wanted))
    with global_compiler_lock:  # types are made, as by a compilation
        known = _read(key)
    caches = [_Given(data) for data in known or [None] * len(wanted)]
    made = [_compiled(*pair) for pair in zip(wanted, caches, strict=True)]
    if any(cache.is_new for cache in caches):
        _write(key, [cache.data for cache in caches])
    return made


def machine_code_if_taken(key: str, wanted: Wanted) -> Any:
    """Return a function as machine code, None if numba refuses it; that is kept as well.

    Parameters
    ----------
    key : str
        As in `machine_code`.
    wanted : Wanted
    """
    refused = store_key(key, "refused", str(wanted.signature), wanted.options)
    if store.read(refused) is not None:
        return None
    try:
        return machine_code(key, [wanted])[0]
    except NumbaError:
        store.write(refused, b"refused")
    except Exception:  # numba passes on whatever typing raises
        pass
    return None


def _compiled(wanted: Wanted, cache: NullCache) -> Any:
    code: Any = numba.njit(**wanted.options)(wanted.function)
    code._cache = cache
    code.compile(wanted.signature)
    code.disable_compile()
    return code


def kept(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator like `numba.njit`, whose code for each type of arguments is kept."""

    def decorate(function: Callable[..., Any]) -> Any:
        code: Any = numba.njit(**options)(function)
        if not getattr(config, "DISABLE_JIT", False):
            code._cache = _ByArguments(code)
        return code

    return decorate


class _Given(NullCache):
    """Gives numba the code of one function, or takes it."""

    def __init__(self, data: Any) -> None:
        self.data, self.is_new = data, False

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        return None if self.data is None else _rebuilt(self.data, target_context)

    def save_overload(self, sig: Any, cres: CompileResult) -> None:
        if _may_be_kept(cres):
            self.data, self.is_new = cres._reduce(), True


class _ByArguments(NullCache):
    """Gives numba the code of a function for given types of arguments, or takes it."""

    def __init__(self, code: Any) -> None:
        self.code = code

    @functools.cached_property
    def key(self) -> str:
        return function_key(self.code)

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        known = _read(store_key(self.key, str(sig)))
        return None if known is None else _rebuilt(known[0], target_context)

    def save_overload(self, sig: Any, cres: CompileResult) -> None:
        if _may_be_kept(cres):
            _write(store_key(self.key, str(sig)), [cres._reduce()])


def store_key(key: str, *more: Any) -> str:
    """Return the key of what was compiled by this numba, for this processor, with its settings."""
    python = sys.implementation.cache_tag, platform.python_version()
    versions = numba.__version__, llvmlite.__version__, np.__version__
    target: Any = cpu_target.target_context
    processor = target.codegen().magic_tuple()
    settings = {name: getattr(config, name, None) for name in SETTINGS}
    text = repr((key, more, python, versions, processor, settings))
    return hashlib.sha256(text.encode()).hexdigest()


def _may_be_kept(cres: CompileResult) -> bool:
    """Whether code means the same in another process."""
    return not cres.library.has_dynamic_globals and not cres.lifted


def _write(key: str, data: list[Any]) -> None:
    try:
        body = cloudpickle.dumps(data)
    except Exception:  # a constant that is an object of this process: costs time and nothing else
        return
    store.write(key, body)


def _read(key: str) -> list[Any] | None:
    body = store.read(key)
    if body is None:
        return None
    try:
        return pickle.loads(body)
    except Exception:  # it names a module that this process does not have
        return None


def _rebuilt(data: Any, target_context: Any) -> CompileResult | None:
    target_context.refresh()  # numba's own functions, as for compiling
    try:
        return CompileResult._rebuild(target_context, *data)
    except Exception:  # LLVM does not find here what the code calls: it is compiled again
        return None


def address_of(code: Any, signature: Any) -> int:
    """Return the address of a compiled function as a C function; it holds as long as the code."""
    made = code.overloads[signature.args]
    return made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name)
