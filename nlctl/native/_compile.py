"""Machine code from a diagram."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import FunctionType
from typing import Any

import control as ct
import numba
import numpy as np
from numba.core import config
from numba.core.registry import CPUDispatcher

from .._diagram import state_names
from ._cache import loaded
from ._code import CompileError
from ._emit import Program, emit
from ._foreign import make_callable
from ._parameters import packed
from ._schedule import Schedule, schedule

Rhs = Callable[..., None]
VECTOR = numba.float64[::1]
RHS = numba.void(numba.float64, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR)
OUT = numba.void(numba.float64, VECTOR, VECTOR, VECTOR, VECTOR)


@dataclass(frozen=True, kw_only=True)
class Compiled:
    """A diagram as machine code; made by `compile`.

    Attributes
    ----------
    schedule : Schedule
        What was read from the diagram.
    program : Program
        What was written for it.
    """

    schedule: Schedule
    program: Program

    @property
    def system(self) -> Any:
        """The diagram that was compiled."""
        return self.schedule.system

    @property
    def source(self) -> str:
        """The emitted source of the right-hand side."""
        return self.program.source

    @cached_property
    def interpreted(self) -> tuple[Rhs, Rhs]:
        """``(rhs, out)`` of the emitted source as plain Python."""
        namespace = self.program.namespace(native=False)
        exec(self.source, namespace)
        return namespace["rhs"], namespace["out"]

    @cached_property
    def native(self) -> tuple[Rhs, Rhs]:
        """``(rhs, out)`` as machine code; compiled when first used, or found in the cache.

        With NUMBA_DISABLE_JIT=1 the same source runs as plain Python.
        """
        if getattr(config, "DISABLE_JIT", False):
            return self.interpreted
        ready = {name: _jitted(f) for name, f in self.program.functions.items()}
        module = loaded(self.program, ready)
        options = {"cache": True, "error_model": "numpy", "nogil": True}
        try:
            rhs = numba.njit(RHS, **options)(module.rhs)
            return rhs, numba.njit(OUT, **options)(module.out)
        except Exception as error:  # numba passes on whatever typing raises
            raise self._explained(error) from error

    def parameter_vector(self, params: Mapping[str, Any] | None = None) -> np.ndarray:
        """Return the flat vector `p` that the program takes.

        Overrides are resolved by python-control itself.

        Raises
        ------
        UnknownNameError, ParameterError
            If a name or a value is refused.
        """
        self.system._update_params(params)
        return packed(self.schedule.nodes, self.program.layout)

    def dynamics(self, t: float, x: Any, u: Any = (), params: Any = None) -> np.ndarray:
        """Return the right-hand side, as ``system.dynamics`` does."""
        g = np.empty(self.program.events)
        return self._call(self.native[0], self.system.nstates, t, x, u, params, g)

    def output(self, t: float, x: Any, u: Any = (), params: Any = None) -> np.ndarray:
        """Return the outputs, as ``system.output`` does."""
        return self._call(self.native[1], self.system.noutputs, t, x, u, params)

    def _call(
        self, function: Rhs, size: int | None, t: float, x: Any, u: Any, params: Any, *more: Any
    ):
        x, u = (np.array(v, dtype=float).reshape(-1) for v in (x, u))
        result = np.empty(size or 0)
        function(float(t), x, u, self.parameter_vector(params), result, *more)
        return result

    def _explained(self, error: Exception) -> CompileError:
        """Name the block whose function numba refuses, and numba's reason."""
        text = str(error)
        culprit = "the program"
        for name, function in self.program.functions.items():
            if f"{name}(" in text or _place(function) in text:
                culprit = f"{name} ({_place(function)})"
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        marks = ("No implementation", "Unknown attribute", "Untyped global", "Cannot determine")
        reason = next((line for line in lines if any(m in line for m in marks)), lines[-1])
        return CompileError(
            f"numba cannot compile {culprit}: {reason}; the diagram still runs in python-control"
        )

    def __repr__(self) -> str:
        names = [self.schedule.nodes[i].path for i in self.schedule.order]
        direct = [n.path for n in self.schedule.nodes if n.direct.any()]
        return "\n".join(
            [
                f"Compiled '{self.system.name}': {len(names)} blocks, "
                f"{self.system.nstates or 0} states, {self.system.noutputs or 0} outputs",
                f"  order:       {' -> '.join(names)}",
                f"  feedthrough: {', '.join(direct) or 'none'}",
                f"  states:      {_shortened(state_names(self.system))}",
            ]
        )


def compile(  # noqa: A001 (what it does)
    system: Any, *, params: Mapping[str, Any] | None = None
) -> Compiled:
    """Turn a python-control system into machine code.

    Parameters
    ----------
    system : control.InputOutputSystem
        nlctl's blocks, ``ct.nlsys``, ``ct.ss``, ``ct.tf``, and diagrams of them.
    params : mapping, optional
        Parameters that will be overridden although no block declares them, such as those that a
        foreign function reads with ``params.get``; the values given here are not kept.

    Returns
    -------
    Compiled

    Raises
    ------
    AlgebraicLoopError
        If signals depend on each other without a state in between.
    CompileError
        If a block cannot be compiled.
    """
    if isinstance(system, ct.TransferFunction):
        system = ct.ss(system)
    system._update_params(params)
    read = schedule(system)
    return Compiled(schedule=read, program=emit(read))


def _jitted(function: Any) -> Any:
    """Make a block's function callable from machine code; equations already are."""
    if isinstance(function, CPUDispatcher):
        return function
    if not isinstance(function, FunctionType):
        raise CompileError(
            f"{function!r} is no plain function: give the block a function made with def"
        )
    make_callable(function)
    return numba.njit(function, error_model="numpy", nogil=True)


def _place(function: Any) -> str:
    """File and line of a function, as numba prints them."""
    code = function.__code__
    return f'File "{code.co_filename}", line {code.co_firstlineno}'


def _shortened(names: list[str]) -> str:
    shown = names if len(names) <= 8 else [*names[:4], "...", *names[-3:]]
    return ", ".join(shown) or "none"
