"""numbalsoda: LSODA and DOP853 in compiled code, with the loop fused by hand as a C function."""

import ctypes

import numba
import numpy as np
from numba.np.numpy_support import carray

from .fused import in_place
from .problem import Problem, Solver, UnavailableError
from .threads import in_threads


def solvers(problem: Problem) -> list[Solver]:
    """Return one solver for LSODA and one for DOP853."""
    try:
        import numbalsoda
    except ImportError:
        raise UnavailableError("numbalsoda is not installed (pip install numbalsoda)") from None
    f, size, centres = in_place(problem.example), problem.x0.size, problem.centres

    @numba.cfunc(numbalsoda.lsoda_sig)
    def rhs(t, x, dx, data):
        f(t, carray(x, (size,)), carray(dx, (size,)), centres)

    def called(t, x):
        dx = np.empty(size)
        rhs.ctypes(t, *(v.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for v in (x, dx)), None)
        return dx

    return [
        _solver(problem, name, getattr(numbalsoda, name), rhs.address, called)
        for name in ("lsoda", "dop853")
    ]


def _solver(problem: Problem, name: str, method, address: int | None, called) -> Solver:
    many, data, n = _looped(method), np.zeros(1), problem.order

    def run(rtol):
        states, _ = method(address, problem.x0, problem.times, data, rtol, rtol * 1e-2, 10**7)
        return states.T

    def ensemble(rtol, x1, threads):
        x = np.empty((x1.size, n, problem.coarse.size))
        arguments = (address, problem.x0, problem.coarse, data, rtol)
        in_threads(lambda part: many(*arguments, x1[part], x[part]), x1.size, threads)
        return x

    return Solver(name=f"numbalsoda {name}", rhs=called, run=run, ensemble=ensemble)


def _looped(method):
    """Return machine code that runs members one after the other, without the GIL."""

    @numba.njit(nogil=True)
    def many(address, x0, times, data, rtol, x1, x):
        for member in range(x1.size):
            start = x0.copy()
            start[0] = x1[member]
            states, _ = method(address, start, times, data, rtol, rtol * 1e-2, 10**7)
            x[member] = states[:, : x.shape[1]].T

    return many
