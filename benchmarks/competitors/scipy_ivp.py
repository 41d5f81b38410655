"""SciPy's solve_ivp with the loop fused by hand and compiled by numba."""

import numpy as np
from scipy.integrate import solve_ivp

from .problem import Problem, Solver


def solvers(problem: Problem) -> list[Solver]:
    """Return one solver for LSODA and one for DOP853."""
    return [_solver(problem, method) for method in ("LSODA", "DOP853")]


def _solver(problem: Problem, method: str) -> Solver:
    rhs = problem.fused()

    def solve(rtol, x0, times):
        return solve_ivp(rhs, (0, 20), x0, method, times, rtol=rtol, atol=rtol * 1e-2).y

    def ensemble(rtol, x1, threads):
        states = [solve(rtol, problem.start(value), problem.coarse) for value in x1]
        return np.array([x[: problem.order] for x in states])

    return Solver(
        name=f"SciPy {method}, fused by hand",
        rhs=rhs,
        run=lambda rtol: solve(rtol, problem.x0, problem.times),
        ensemble=ensemble,
        cores=1,
    )
