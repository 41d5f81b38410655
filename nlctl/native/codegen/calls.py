"""Opaque functions of a program: called as they stand, for one member at a time.

A call has its arguments in memory, in rows of `c`; its results follow.  Machine code calls a C
function that numba makes.  An exception cannot pass through that: it is noted in the row behind
the results, with the arguments behind it, and raised anew by whoever ends the evaluation.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]
from numba.core.errors import NumbaWarning

from ..._equation import equation
from .fingerprint import module_key
from .machine_code import Wanted, address_of, machine_code
from .module import loaded

ADDRESS = numba.void(numba.types.CPointer(numba.float64), numba.int64, numba.int64)
FAILED = 1.0


@dataclass(frozen=True, kw_only=True)
class Call:
    """A function that is called for one member at a time.

    Attributes
    ----------
    name : str
    lines : tuple of str
        Its source in terms of t, x, u and p of its block alone, which fills y.
    lengths : tuple of int
        Sizes of t, x, u, p and y.
    reason : str
        Why it could not be traced.
    """

    name: str
    lines: tuple[str, ...]
    lengths: tuple[int, ...]
    reason: str

    @property
    def given(self) -> int:
        """Number of arguments."""
        return sum(self.lengths[:-1])

    @property
    def failed(self) -> int:
        """Row in which it says that it has failed, counted from its first."""
        return sum(self.lengths)


@dataclass(frozen=True, kw_only=True)
class Calls:
    """All opaque functions of a program, as source, and what that refers to.

    Attributes
    ----------
    calls : mapping
        By name.
    lanes : int
        Number of members.
    before : str
        Source that they need.
    functions, constants, records : mapping
        As in `Program`.
    """

    calls: Mapping[str, Call] = field(default_factory=dict)
    lanes: int = 1
    before: str = ""
    functions: Mapping[str, Any] = field(default_factory=dict)
    constants: Mapping[str, Any] = field(default_factory=dict)
    records: Mapping[str, Any] = field(default_factory=dict)

    @property
    def source(self) -> str:
        """Source of ``name(given, y)``, and of ``at_name(c, at, lane)`` for machine code."""
        lines = [*self.before.splitlines()]
        for call in self.calls.values():
            lines += ["", "", "@equation", f"def {call.name}(given, y):  # {call.reason}"]
            lines += [f"    {line}" for line in (*_unpacked(call), *call.lines)]
            lines += ["", "", *_of_member(call, self.lanes)]
        return "\n".join([*lines, ""])

    def namespace(self, *, native: bool) -> dict[str, Any]:
        """Return everything that the source refers to, by name."""
        records = {name: pair[native] for name, pair in self.records.items()}
        own = {"np": np, "carray": carray, "equation": equation}
        return {**own, **self.constants, **self.functions, **records}

    def plain(self) -> dict[str, Callable[[np.ndarray, int, int], None]]:
        """Return them as plain Python, called with c, a row and a member."""
        namespace = self.namespace(native=False)
        exec(self.source, namespace)
        return {name: _plain(call, namespace[name]) for name, call in self.calls.items()}

    def native(self, taught: tuple[Any, ...], jitted: Callable[[Any], Any]) -> Native:
        """Return them as machine code.

        Parameters
        ----------
        taught : tuple of modules
            What numba was taught, and these may use.
        jitted : callable
            What makes a block's function callable from machine code.

        Raises
        ------
        numba.core.errors.NumbaError
            If one cannot be compiled.
        """
        if not self.calls:
            return Native(symbols={}, owners=(), module=None)
        module = loaded(self, {name: jitted(f) for name, f in self.functions.items()})
        options = {"error_model": "numpy", "nogil": True, "no_cpython_wrapper": True}
        wanted = [
            Wanted(function=getattr(module, f"at_{name}"), signature=ADDRESS, options=options)
            for name in self.calls
        ]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NumbaWarning)  # of what the user need not know
            made = machine_code(f"{module.__name__} {module_key(*taught)}", wanted)
        symbols = {
            name: address_of(code, ADDRESS) for name, code in zip(self.calls, made, strict=True)
        }
        return Native(symbols=symbols, owners=tuple(made), module=module)


@dataclass(frozen=True, kw_only=True)
class Native:
    """Addresses of opaque functions, what they belong to, and the module of their source."""

    symbols: Mapping[str, int]
    owners: tuple[Any, ...]
    module: Any

    def raise_again(self, name: str, given: np.ndarray, count: int) -> None:
        """Call a function with the arguments with which it has failed."""
        function = numba.njit(error_model="numpy", nogil=True)(getattr(self.module, name))
        function(given, np.empty(count))


def _unpacked(call: Call) -> list[str]:
    _, x, u, p, _ = np.cumsum(call.lengths)
    return [
        "t = given[0]",
        f"x, u, p = given[1:{x}], given[{x}:{u}], given[{u}:{p}]",
    ]


def _of_member(call: Call, lanes: int) -> list[str]:
    """Return the source of the C function: it reads and fills rows of c from `at` on."""
    given, count, failed = call.given, call.lengths[-1], call.failed
    return f"""\
def at_{call.name}(c, at, lane):
    table = carray(c, (at + {failed + 1 + given}, {lanes}))
    given, y = np.empty({given}), np.empty({count})
    for i in range({given}):
        given[i] = table[at + i, lane]
    try:
        {call.name}(given, y)
    except Exception:
        y[:] = np.nan
        table[at + {failed}, lane] = {FAILED}
        for i in range({given}):
            table[at + {failed + 1} + i, lane] = given[i]
    for i in range({count}):
        table[at + {given} + i, lane] = y[i]""".splitlines()


def _plain(call: Call, function: Callable[[np.ndarray, np.ndarray], None]) -> Any:
    def at(c: np.ndarray, row: int, lane: int) -> None:
        y = np.full(call.lengths[-1], np.nan)
        function(c[row : row + call.given, lane].copy(), y)
        c[row + call.given : row + call.failed, lane] = y

    return at
