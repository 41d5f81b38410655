"""Discrete time: a compiled program applied to itself, sample by sample."""

import functools
from typing import Any

import control as ct
import numba
import numpy as np

from ..errors import ParameterError
from ..upstream.systems import System
from .compiled import Compiled
from .machine.address import call_out, call_rhs
from .machine.evaluations import prepared_parameters
from .machine.fingerprint import function_key
from .machine.machine_code import Wanted, machine_code

MATRIX, COLUMNS = numba.float64[:, ::1], numba.float64[:, :, ::1]
LOOP = numba.int64(
    numba.intp, numba.intp, MATRIX, COLUMNS, MATRIX, COLUMNS, COLUMNS, MATRIX, MATRIX
)  # fmt: skip


def simulate_discrete(
    compiled: Compiled, times: np.ndarray, inputs: np.ndarray, x0: np.ndarray, p: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Compute x[k+1] = f(t[k], x[k], u[k]) and y[k] = h(t[k], x[k], u[k])."""
    # Shapes: `times` (m,), `inputs` (ninputs, m), `x0` (nstates,); returns (noutputs, n).
    system, count = compiled.system, times.size
    _check_times(system, times)
    code, c = prepared_parameters(compiled, p)
    outputs = np.empty((count, system.noutputs or 0, 1))
    states = np.empty((count, system.nstates or 0, 1))
    g, m = (np.empty((code.lowered.rows[name], 1)) for name in "gm")
    columns = np.array(inputs.T, dtype=float, order="C")[:, :, None]  # may be written to
    states[:1, :, 0] = x0
    each = np.array(times, dtype=float)[:, None]
    with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the result says
        n = discrete_loop()(*code.entries, each, columns, c, states, outputs, g, m)
    code.check(c)
    return outputs[:n, :, 0].T.copy(), states[:n, :, 0].T.copy()


def _check_times(system: System, times: np.ndarray) -> None:
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
def discrete_loop() -> Any:
    """Return the loop that all diagrams share as machine code; without JIT unchanged."""
    options = {"error_model": "numpy", "nogil": True}
    wanted = Wanted(function=_iterate, signature=LOOP, options=options)
    return machine_code(function_key(_iterate), wanted)


def _iterate(rhs, out, times, inputs, c, states, outputs, g, m):
    """Fill states (from the first on) and outputs; return how many samples are finite."""
    last = len(times) - 1
    for k in range(len(times)):
        if not np.isfinite(states[k]).all():
            return k
        call_out(out, times[k], states[k], inputs[k], c, outputs[k])
        if not np.isfinite(outputs[k]).all():
            return k
        if k < last:
            call_rhs(rhs, times[k], states[k], inputs[k], c, states[k + 1], g, m)
    return len(times)
