"""Opaque functions of a program as C functions, called for one member at a time.

A call has its arguments in memory, in rows of `c`; its results follow.  Machine code calls a C
function: one that numba makes, or, where numba refuses, one that calls back into Python, which is
slow and right.  An exception cannot pass through machine code: it is noted in the row behind the
results, with the arguments behind it, and raised by what ends the evaluation.  Until then the
function is not called again for that member.
"""

import ctypes
import linecache
import sys
import types
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np

from ...errors import UsageError
from ...upstream.numba_internals import NumbaWarning, address_of
from ..opaque.called import Call, Source, source_of
from .fingerprint import function_key
from .machine_code import Wanted, machine_code_if_taken

_ADDRESS = numba.void(numba.types.CPointer(numba.float64), numba.int64, numba.int64)
CALLBACK = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)
OPTIONS = {"error_model": "numpy", "nogil": True, "no_cpython_wrapper": True}
CALL_FAILED = 1.0


@dataclass(frozen=True, kw_only=True)
class Native:
    """C functions of opaque functions."""

    symbols: Mapping[str, int] = field(default_factory=dict)  # addresses by name
    owners: tuple[Any, ...] = ()  # what these belong to
    called_back: tuple[str, ...] = ()  # names of those that call back into Python
    # what functions in Python have raised, by the place of their rows and the member
    raised: dict[tuple[int, int], BaseException] = field(default_factory=dict)

    def error(self, call: Call, c: np.ndarray, row: int, lane: int) -> BaseException:
        """Return what a call has raised that failed; it is forgotten here."""
        column = c[row : row + call.rows, lane]
        column[call.failed] = 0.0
        known = self.raised.pop((_place(c.ctypes.data, row, c.shape[1]), lane), None)
        if known is not None:
            return known
        try:  # machine code knows no exceptions: Python says which one it is
            call.function(column[call.failed + 1 :].copy())
        except Exception as error:
            return error
        return UsageError(
            f"the {call.kind} function of block '{call.block}' fails in machine code and does not "
            "in Python: run it with engine='python-control'"
        )


def plain_calls(calls: Mapping[str, Call]) -> dict[str, Callable[[np.ndarray, int, int], None]]:
    """Return calls as plain Python, called with c, a row and a member."""
    return {
        name: lambda c, row, lane, call=call: call.of_column(c[row : row + call.rows, lane])
        for name, call in calls.items()
    }


def native_calls(calls: Mapping[str, Call], lanes: int) -> Native:
    """Return calls as C functions."""
    symbols, owners, called_back = {}, [], []
    raised: dict[tuple[int, int], BaseException] = {}
    for name, call in calls.items():
        code = _by_numba(call, lanes)
        if code is not None:
            symbols[name] = address_of(code, _ADDRESS)
        else:
            code = CALLBACK(_back(call, lanes, raised))
            symbols[name] = ctypes.cast(code, ctypes.c_void_p).value or 0
            called_back.append(name)
        owners.append(code)
    return Native(
        symbols=symbols, owners=tuple(owners), called_back=tuple(called_back), raised=raised
    )


def _place(address: int, row: int, lanes: int) -> int:
    return address + 8 * row * lanes


def _back(call: Call, lanes: int, raised: dict[Any, BaseException]) -> Callable[..., None]:
    """Return what machine code calls: nothing may be raised in it."""
    memory, shape = ctypes.c_double * (call.rows * lanes), (call.rows, lanes)

    def at(c: int, row: int, lane: int) -> None:
        place = _place(c, row, lanes)
        column = np.ctypeslib.as_array(memory.from_address(place)).reshape(shape)[:, lane]
        results = slice(call.given, call.failed)
        try:
            if column[call.failed] == CALL_FAILED:
                column[results] = np.nan
            else:
                call.of_column(column)
        except BaseException as error:  # Ctrl-C too
            column[results] = np.nan
            column[call.failed] = CALL_FAILED
            raised[place, lane] = error

    return at


def _by_numba(call: Call, lanes: int) -> Any:
    """Return a call as compiled by numba, None if numba refuses it."""
    try:
        known = source_of(call)
    except (UsageError, TypeError, ValueError):
        return None
    if known is None:
        return None
    source = Source(
        source="\n".join(["@equation", known.source, "", *_of_member(call, lanes), ""]),
        names=known.names,
    )
    module = loaded(source)
    request = Wanted(
        function=getattr(module, f"at_{call.name}"), signature=_ADDRESS, options=OPTIONS
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaWarning)  # of what the user need not know
        return machine_code_if_taken(module.__name__, request)


def _of_member(call: Call, lanes: int) -> list[str]:
    """Return the source of the C function: it reads and fills rows of c from `at` on."""
    given, count, failed = call.given, call.lengths[-1], call.failed
    return f"""\
def at_{call.name}(c, at, lane):
    table = carray(c, (at + {call.rows}, {lanes}))
    given, y = np.empty({given}), np.empty({count})
    if table[at + {failed}, lane] == {CALL_FAILED}:
        for i in range({count}):
            table[at + {given} + i, lane] = np.nan
        return
    for i in range({given}):
        given[i] = table[at + i, lane]
    try:
        {call.name}(given, y)
    except Exception:
        y[:] = np.nan
        table[at + {failed}, lane] = {CALL_FAILED}
        for i in range({given}):
            table[at + {failed + 1} + i, lane] = given[i]
    for i in range({count}):
        table[at + {given} + i, lane] = y[i]""".splitlines()


def loaded(program: Source) -> types.ModuleType:
    """Return the program as a module, made of its own source."""
    # It is registered under the program's key, by which machine code that was kept finds it, and
    # its lines are known to tracebacks.
    name = f"nlctl_program_{function_key(program.source, program.names)}"
    file = f"<{name}>"
    lines = program.source.splitlines(keepends=True)
    linecache.cache[file] = (len(program.source), None, lines, file)
    module = types.ModuleType(name)
    module.__file__ = file
    module.__dict__.update(program.names)
    exec(compile(program.source, file, "exec"), module.__dict__)
    sys.modules[name] = module  # machine code looks its globals up there
    return module
