"""Discrete time: a compiled program applied to itself, sample by sample."""

from __future__ import annotations

import functools
from typing import Any

import control as ct
import numba
import numpy as np

from .._errors import ParameterError
from ._compile import OUT, RHS, VECTOR, Compiled
from .codegen.fingerprint import function_key
from .codegen.machine_code import Wanted, machine_code

MATRIX = numba.float64[:, ::1]
LOOP = numba.int64(
    *(numba.types.FunctionType(signature) for signature in (RHS, OUT)),
    *(VECTOR, MATRIX, VECTOR, MATRIX, MATRIX, VECTOR),
)


def simulate_discrete(
    compiled: Compiled, times: np.ndarray, inputs: np.ndarray, x0: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Compute x[k+1] = f(t[k], x[k], u[k]) and y[k] = h(t[k], x[k], u[k]).

    Parameters
    ----------
    compiled : Compiled
        A discrete-time system.
    times : ndarray of shape (m,)
        Sampling times, ``dt`` apart (s); any equal distance where ``dt`` is True.
    inputs : ndarray of shape (ninputs, m)
    x0 : ndarray of shape (nstates,)
    p : ndarray
        The program's parameter vector.

    Returns
    -------
    outputs : ndarray of shape (noutputs, n)
    states : ndarray of shape (nstates, n)
        n = m, or fewer where the run diverged: sample n has a state or output that is not finite.

    Raises
    ------
    ParameterError
        If `times` are not one sampling time apart.
    """
    system = compiled.system
    _check_times(system, times)
    outputs = np.empty((times.size, system.noutputs or 0))
    states = np.empty((times.size, system.nstates or 0))
    g = np.empty(compiled.program.events)
    columns = np.array(inputs.T, dtype=float, order="C")  # one that may be written to
    p = np.ascontiguousarray(p)
    states[:1] = x0
    with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the result says
        n = _loop()(*compiled.native, times, columns, p, states, outputs, g)
    return outputs[:n].T, states[:n].T


def compile_discrete(compiled: Compiled) -> None:
    """Make the machine code that `simulate_discrete` needs."""
    _ = compiled.native, _loop()


def _check_times(system: Any, times: np.ndarray) -> None:
    steps = np.diff(times)
    if not ct.isdtime(system, strict=True):
        raise ParameterError(f"'{system.name}' has dt = {system.dt} and is no discrete-time system")
    wanted = steps[:1].sum() if system.dt is True else system.dt  # a single time fits any
    for k in np.flatnonzero(~np.isclose(steps, wanted))[:1]:
        raise ParameterError(
            f"'{system.name}' is sampled every {wanted:g} s, but timepts {times[k]:g} and "
            f"{times[k + 1]:g} are {steps[k]:g} s apart: use np.arange(n) * {wanted:g}"
        )


@functools.cache
def _loop() -> Any:
    """Return the loop as machine code; without JIT as it stands."""
    options = {"error_model": "numpy", "nogil": True}
    wanted = Wanted(function=_iterate, signature=LOOP, options=options)
    (loop,) = machine_code(function_key(_iterate), [wanted])
    return loop


def _iterate(rhs, out, times, inputs, p, states, outputs, g):
    """Fill states (from the first on) and outputs; return how many samples are finite."""
    last = times.size - 1
    for k in range(times.size):
        if not np.isfinite(states[k]).all():
            return k
        out(times[k], states[k], inputs[k], p, outputs[k])
        if not np.isfinite(outputs[k]).all():
            return k
        if k < last:
            rhs(times[k], states[k], inputs[k], p, states[k + 1], g)
    return times.size
