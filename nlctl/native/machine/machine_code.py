"""Compiled functions as bytes and back.

numba's own cache writes files that nobody verifies, keyed by the file of the outermost function
alone.  Here a function's dispatcher is given a cache of ours, which asks `store`.
"""

import functools
import hashlib
import pickle
import platform
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import cloudpickle
import control as ct
import llvmlite
import numba
import numpy as np
import scipy

from ...upstream.numba_internals import (
    CodeCache,
    NumbaError,
    give_cache,
    is_jit_disabled,
    processor,
    settings,
)
from ..purity import dicts
from . import address, store
from .fingerprint import module_key

TEACHERS = (address, dicts)  # they extend numba; functions do not name them


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A function that is to be machine code."""

    function: Callable[..., Any]  # plain Python
    signature: Any
    options: Mapping[str, Any]  # of `numba.njit`
    name: str = ""  # what it is called by, if not as the function is

    @property
    def called(self) -> str:
        """What it is called by."""
        return self.name or self.function.__name__


def machine_code(key: str, request: Wanted) -> Any:
    """Return a function as machine code, from the store, or compiled and kept there."""
    # With NUMBA_DISABLE_JIT=1 it is returned unchanged.
    if is_jit_disabled():
        return request.function
    place = store_key(key, str(request.signature), request.options)
    code: Any = numba.njit(**request.options)(request.function)
    give_cache(code, _Stored(place))
    code.compile(request.signature)
    code.disable_compile()
    return code


def machine_code_if_taken(key: str, request: Wanted) -> Any:
    """Return a function as machine code, None if numba refuses it; that is kept as well."""
    refused = store_key(key, "refused", str(request.signature), request.options)
    if store.read(refused) is not None:
        return None
    try:
        return machine_code(key, request)
    except NumbaError:
        store.write(refused, b"refused")
    except Exception:  # numba passes on whatever typing raises
        pass
    return None


class _Stored(CodeCache):
    """Gives numba the code of a function of one signature from the store, or takes it."""

    def __init__(self, key: str) -> None:
        self.key = key

    def load(self, signature: object) -> Any:
        return _read(self.key)

    def save(self, signature: object, data: object) -> None:
        _write(self.key, data)


def store_key(key: str, *more: object) -> str:
    """Return the key of what was compiled by this numba, for this processor, with its settings."""
    python = sys.implementation.cache_tag, platform.python_version()
    text = repr((key, more, python, _compiler(), processor(), settings()))
    return hashlib.sha256(text.encode()).hexdigest()


@functools.cache
def _compiler() -> tuple[str, ...]:
    """Return the versions of what compiles code and is called in it, and a key of what we add."""
    # a function of python-control or SciPy, which keys name and do not read, may be in the code
    versions = (library.__version__ for library in (numba, llvmlite, np, scipy, ct))
    return (*versions, module_key(*TEACHERS))


def _write(key: str, data: object) -> None:
    try:
        body = cloudpickle.dumps(data)
    except Exception:  # a constant that is an object of this process: costs time and nothing else
        return
    store.write(key, body)


def _read(key: str) -> Any:
    body = store.read(key)
    if body is None:
        return None
    try:
        return pickle.loads(body)
    except Exception:  # it names a module that this process does not have
        return None
