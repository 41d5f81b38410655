"""The functions of a program, as Python and the integrators call them."""

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...upstream.numba_internals import is_jit_disabled
from ..codegen.interpret import interpreted_function
from ..codegen.solver import plain_solver
from ..lower import Lowered
from ..opaque.called import Call
from .address import data_address
from .calls import CALL_FAILED, Native, native_calls, plain_calls
from .finish import Loaded, finished


@dataclass(frozen=True, kw_only=True)
class Opaque:
    """A call of an opaque function within a program."""

    call: Call
    row: int  # where it begins in `c`
    native: Native

    def check(self, c: np.ndarray) -> None:
        """Raise what the function has raised for one of the members, if it has."""
        at = self.row + self.call.failed
        for lane in np.flatnonzero(c[at] == CALL_FAILED)[:1]:
            raise self.native.error(self.call, c, self.row, int(lane))


@dataclass(frozen=True, kw_only=True)
class Routine:
    """A C function of arrays of floats."""

    address: int
    shapes: tuple[tuple[int, ...], ...]  # shapes of its arrays: nothing else may be given to it
    loaded: Loaded  # what the address belongs to
    opaque: tuple[Opaque, ...]  # what it calls

    def __call__(self, *arrays: np.ndarray) -> None:
        self.bound(*arrays)()

    def bound(self, *arrays: np.ndarray) -> Callable[[], None]:
        """Return a call with these arrays, which are checked once; their values may change."""
        for array, shape in zip(arrays, self.shapes, strict=True):
            fits = array.shape == shape and array.dtype == float and array.flags.c_contiguous
            if not fits:
                raise ValueError(f"an array of shape {shape} is needed, got {array.shape}")
        function, places = self._function, [data_address(array) for array in arrays]

        def call() -> None:
            function(*places)
            if self.opaque:
                self.check(arrays[3])

        return call

    @cached_property
    def _function(self) -> Any:
        return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(self.shapes))(self.address)

    def check(self, c: np.ndarray) -> None:
        """Raise what a function that it has called has raised."""
        for call in self.opaque:
            call.check(c)


Runnable = Callable[..., None]


def plain_functions(lowered: Lowered) -> tuple[Runnable, ...]:
    """Return the functions of a program as plain Python, in their order."""
    calls = plain_calls(lowered.calls)
    calls |= {name: plain_solver(solver) for name, solver in lowered.solvers.items()}
    return tuple(interpreted_function(f, lowered.lanes, calls) for f in lowered.functions.values())


def lowered_code(lowered: Lowered) -> tuple[Runnable, ...]:
    """Return the functions of a program as machine code, from the cache if it is there."""
    # With NUMBA_DISABLE_JIT=1 the same plan is carried out in plain Python.
    if is_jit_disabled():
        return plain_functions(lowered)
    native = native_calls(lowered.calls, lowered.lanes)
    loaded = finished(lowered.text, lowered.functions, native.symbols, native.owners)
    return tuple(_routine(lowered, name, loaded, native) for name in lowered.functions)


def _routine(lowered: Lowered, name: str, loaded: Loaded, native: Native) -> Routine:
    function = lowered.functions[name]
    opaque = [
        Opaque(call=lowered.calls[node.data[0]], row=row, native=native)
        for node, (_, row) in function.plan.stored.items()
        if node.op == "call" and node not in function.plan.known
    ]
    return Routine(
        address=loaded.addresses[name],
        shapes=tuple(lowered.shape(array) for array in function.arguments),
        loaded=loaded,
        opaque=tuple(opaque),
    )


def entry(function: object) -> Any:
    """Return what integrators take: the address of machine code, or a plain function."""
    return function.address if isinstance(function, Routine) else function


def entries_of(functions: Sequence[Any]) -> np.ndarray:
    """Return what integrators take of several functions."""
    entries = [entry(function) for function in functions]
    plain = any(callable(address) for address in entries)
    return np.array(entries, dtype=object if plain else np.int64)
