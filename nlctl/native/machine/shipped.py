"""Functions that come with nlctl as bitcode, and are called from Python.

``python -m nlctl.native.ship`` makes it, after every change of what it is made of.  Where it is not
that of the sources here, or is of a newer LLVM than there is here, what numba makes of the sources
is used instead, and kept in the cache.

Relied on in numba, and held by tests: arguments are passed as scalars, an array as two pointers
that may be null, its elements, their size, where they begin, its shape and its strides, a tuple as
its items; a result is written to the first argument; what memory of a returned array is, `export`
says.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import json
import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import types

from ...host.checkout import file_of_nlctl
from ...upstream.numba_internals import as_dtype, checks_indices, is_jit_disabled
from . import store
from .address import data_address
from .export import NONE, RELEASE, RETURNED, exported
from .fingerprint import function_key
from .finish import Loaded, finished
from .machine_code import Wanted, store_key

_TUPLE: Any = types.BaseTuple  # also those with names
_ONCE = threading.Lock()  # of several threads that begin at the same time one compiles
_PLAIN = {types.float64: ctypes.c_double, types.int64: ctypes.c_int64, types.boolean: ctypes.c_bool}


@dataclass(frozen=True, kw_only=True, eq=False)
class Shipped:
    """Functions, and where their bitcode is."""

    path: Path
    wanted: tuple[Wanted, ...]
    # files of nlctl that the bitcode is made of as a whole, besides what the functions name
    whole: tuple[str, ...] = ()

    @property
    def functions(self) -> dict[str, Callable[..., Any]]:
        """Each by its name, ready to be called; without JIT plain Python."""
        with _ONCE:
            return functions_of(self)


@functools.cache
def functions_of(shipped: Shipped) -> dict[str, Callable[..., Any]]:
    """Return the functions, finished for this machine."""
    requests = {request.called: request for request in shipped.wanted}
    if is_jit_disabled():
        return {name: request.function for name, request in requests.items()}
    loaded = finished(bitcode(shipped) or _made_anew(shipped), [*requests, RELEASE])
    release = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(loaded.addresses[RELEASE])
    return {
        name: callable_at(loaded.addresses[name], request.signature, release, loaded)
        for name, request in requests.items()
    }


def bitcode(shipped: Shipped) -> bytes | None:
    """Return the bitcode that is shipped, if it is that of the sources and can be read here."""
    try:
        first, _, code = shipped.path.read_bytes().partition(b"\n")
        header = json.loads(first)
        fits = header["sources"] == sources_key(header["files"])
    except (OSError, ValueError, KeyError, TypeError):  # none, or damaged
        return None
    fits = fits and header["code"] == hashlib.sha256(code).hexdigest()
    readable = list(llvm.llvm_version_info) >= header["llvm"]  # old LLVM does not read new code
    # where indices are to be checked: they are not in this code
    return code if fits and readable and not checks_indices() else None


def sources_key(files: list[str]) -> str:
    """Return a key of files of nlctl, wherever it lies; ends of lines may be any system's."""
    digest = hashlib.sha256()
    for name in files:
        digest.update(f"{name}\0{file_of_nlctl(name).read_text(encoding='utf-8')}\0".encode())
    return digest.hexdigest()


def shipped_key(shipped: Shipped) -> str:
    """Return a key that changes with whatever the functions' machine code is made of."""
    return function_key(*((one.function, one.signature.args) for one in shipped.wanted))


def _made_anew(shipped: Shipped) -> bytes:
    """Return what numba makes of the sources, from the cache if it is there."""
    key = store_key(shipped_key(shipped), function_key(exported), "bitcode")
    code = store.read(key)
    if code is None:
        code = exported(shipped.wanted)
        store.write(key, code)
    return code


def callable_at(address: int, signature: Any, release: Any, owner: Loaded) -> Callable[..., Any]:
    """Return how Python calls a function of this signature."""
    kinds = [kind for argument in signature.args for kind in _kinds(argument)]
    pointers = [ctypes.c_void_p] * 2
    call = ctypes.CFUNCTYPE(ctypes.c_int32, *pointers, *kinds)(address)
    readers = [_reader(kind) for kind in signature.args]
    Result = _result(signature.return_type)

    def call_all(every: Iterable[tuple[Any, ...]]) -> Any:
        """Call it with arguments as it takes them, one time after the other."""
        result, exception = Result(), ctypes.c_void_p()
        for values in every:
            status = call(ctypes.addressof(result), ctypes.addressof(exception), *values)
            if status not in (RETURNED, NONE):
                raise MemoryError(f"machine code has failed for want of memory ({status})")
        return result

    def function(*given: Any) -> Any:
        values = [read(value) for read, value in zip(readers, given, strict=True)]
        result = call_all([tuple(number for numbers in values for number in numbers)])
        return _value(signature.return_type, result.value, release)

    function.each = call_all  # type: ignore[attr-defined]
    function.owner = owner  # type: ignore[attr-defined]
    return function


def _kinds(kind: Any) -> Iterator[Any]:
    """Yield as what an argument is passed."""
    if isinstance(kind, _TUPLE):
        for item in kind.types:
            yield from _kinds(item)
    elif isinstance(kind, types.Array):
        yield from _ARRAY
        yield from [ctypes.c_ssize_t] * (2 * kind.ndim)
    else:
        yield _PLAIN.get(kind, ctypes.c_void_p)  # a record or another address


_ARRAY = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ssize_t, ctypes.c_ssize_t, ctypes.c_void_p)


def _reader(kind: Any) -> Callable[[Any], Iterable[Any]]:
    """Return how a value is passed."""
    if isinstance(kind, _TUPLE):
        readers = [_reader(item) for item in kind.types]
        return lambda value: [
            number for read, item in zip(readers, value, strict=True) for number in read(item)
        ]
    if isinstance(kind, types.Array):
        return functools.partial(_array, as_dtype(kind.dtype), kind.ndim)
    if kind in _PLAIN:
        return lambda value: (value,)
    if kind == types.none:
        return lambda value: (None,)
    return lambda value: (value if isinstance(value, int) else data_address(value.table),)


def _array(dtype: Any, ndim: int, array: np.ndarray) -> list[Any]:
    """Return as what an array is passed."""
    if array.dtype != dtype or array.ndim != ndim or not array.flags.c_contiguous:
        raise TypeError(
            f"machine code needs a C-contiguous array of {ndim} dimensions of {dtype}, got "
            f"{array.ndim} of {array.dtype}"
        )
    begin, sizes = data_address(array), (*array.shape, *array.strides)
    return [None, None, array.size, array.itemsize, begin, *sizes]


@functools.cache
def _structure(kind: Any) -> Any:
    """Return as what a result is written, as a field of a structure."""
    if kind == types.none:
        return ctypes.c_void_p
    if isinstance(kind, types.Array):
        lengths = ctypes.c_ssize_t * kind.ndim
        fields = [*(("memory", "parent", "size", "itemsize", "data")), "shape", "strides"]
        pairs = list(zip(fields, (*_ARRAY, lengths, lengths), strict=True))
    elif isinstance(kind, _TUPLE):
        pairs = [(f"item{i}", _structure(item)) for i, item in enumerate(kind.types)]
    else:
        return _PLAIN[kind]
    return type("Written", (ctypes.Structure,), {"_fields_": pairs})


def _result(kind: Any) -> Any:
    """Return the type of what a result is written to."""
    return type("Result", (ctypes.Structure,), {"_fields_": [("value", _structure(kind))]})


def _value(kind: Any, written: Any, release: Any) -> Any:
    """Return a result as Python has it; its memory is given back."""
    if isinstance(kind, types.Array):
        return _copied(kind, written, release)
    if isinstance(kind, _TUPLE):
        return tuple(
            _value(item, getattr(written, f"item{i}"), release) for i, item in enumerate(kind.types)
        )
    return None if kind == types.none else written


def _copied(kind: Any, written: Any, release: Any) -> np.ndarray:
    dtype, shape = as_dtype(kind.dtype), tuple(written.shape)
    array = np.empty(shape, dtype)
    if array.size:
        memory: Any = (ctypes.c_char * array.nbytes).from_address(written.data)
        array[:] = np.frombuffer(memory, dtype).reshape(shape)
    if written.memory:
        count = ctypes.c_ssize_t.from_address(written.memory)
        count.value -= 1
        if count.value == 0:
            release(written.memory)
    return array
