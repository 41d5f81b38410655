"""The integrators as machine code, from the bitcode that is shipped beside their sources.

``python -m nlctl.native.ship`` makes it, after every change of the integrators.  Where it is not
that of the sources beside it, or is of a newer LLVM than there is here, what numba makes of the
sources is used instead, and kept in the cache.
"""

import ctypes
import functools
import hashlib
import json
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba

from ..upstream.numba_internals import checks_indices, is_jit_disabled
from .integrate import advance, evaluate, start
from .integrate.memory import data_address
from .integrate.workspace import TASK, WORK
from .machine import store
from .machine.fingerprint import function_key
from .machine.finish import finished
from .machine.machine_code import Wanted, store_key

HERE = Path(__file__).parent
SHIPPED = HERE / "integrators.bitcode"
_RETURNED = (0, -2)  # what numba's functions return, unless they raise an exception
_ADDRESS = numba.intp
WANTED = [
    Wanted(
        function=function,
        signature=numba.void(*arguments),
        options={"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True},
    )
    for function, *arguments in (
        (start.start, _ADDRESS, TASK, WORK),
        (advance.advance, _ADDRESS, _ADDRESS, _ADDRESS, TASK, WORK, numba.intp),
        (evaluate.outputs, _ADDRESS, _ADDRESS, TASK, WORK),
    )
]
_ONCE = threading.Lock()  # of several threads that begin at the same time one compiles


def integrators() -> dict[str, Callable[..., None]]:
    """Return `start`, `advance` and `outputs`, ready to be called; without JIT as they stand."""
    with _ONCE:
        return _integrators()


@functools.cache
def _integrators() -> dict[str, Callable[..., None]]:
    functions = {each.function.__name__: each for each in WANTED}
    if is_jit_disabled():
        return {name: each.function for name, each in functions.items()}
    loaded = finished(shipped_bitcode() or _made_anew(), functions)
    return {
        name: _callable(loaded.addresses[name], each.signature.args, loaded)
        for name, each in functions.items()
    }


def _callable(address: int, arguments: Any, owner: object) -> Callable[..., None]:
    """Return a function of addresses, records and integers."""
    kinds = [ctypes.c_void_p if isinstance(a, type(TASK)) else ctypes.c_ssize_t for a in arguments]
    call = ctypes.CFUNCTYPE(ctypes.c_int32, *[ctypes.c_void_p] * 2, *kinds)(address)
    nothing = (ctypes.c_void_p * 2)()  # places for a result and an exception, never read

    exception = ctypes.byref(nothing, 8)

    def each(every: Iterable[tuple[int, ...]]) -> None:
        for values in every:
            status = call(nothing, exception, *values)
            if status not in _RETURNED:
                raise MemoryError(f"the integrators have failed for want of memory ({status})")

    def function(*given: Any) -> None:
        each([tuple(g if isinstance(g, int) else data_address(g.table) for g in given)])

    function.each = each  # type: ignore[attr-defined]
    function.owner = owner  # type: ignore[attr-defined]
    return function


def handle(record: Any) -> Any:
    """Return what the integrators take for a record, for many calls: it must outlive them."""
    return record if is_jit_disabled() else data_address(record.table)


def shipped_bitcode() -> bytes | None:
    """Return the bitcode that is shipped, if it is that of the sources and can be read here."""
    try:
        first, _, code = SHIPPED.read_bytes().partition(b"\n")
        header = json.loads(first)
        fits = header["sources"] == sources_key(header["files"])
    except (OSError, ValueError, KeyError, TypeError):  # none, or damaged
        return None
    fits = fits and header["code"] == hashlib.sha256(code).hexdigest()
    readable = list(llvm.llvm_version_info) >= header["llvm"]  # old LLVM does not read new code
    # where indices are to be checked: they are not in this code
    return code if fits and readable and not checks_indices() else None


def sources_key(files: list[str]) -> str:
    """Return a key of source files, wherever they lie; ends of lines may be any system's."""
    digest = hashlib.sha256()
    for name in files:
        text = (HERE / name).read_text(encoding="utf-8")
        digest.update(f"{name}\0{text}\0".encode())
    return digest.hexdigest()


def integrator_key() -> str:
    """Return a key that changes with whatever the integrators' machine code is made of."""
    return function_key(*((each.function, each.signature.args) for each in WANTED))


def _made_anew() -> bytes:
    """Return what numba makes of the sources, from the cache if it is there."""
    from .machine.export import exported

    key = store_key(integrator_key(), function_key(exported), "bitcode")
    code = store.read(key)
    if code is None:
        code = exported(WANTED)
        store.write(key, code)
    return code
