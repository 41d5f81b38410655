"""Stiff problems: nlctl against SciPy's Radau and LSODA, in one run.

    python benchmarks/stiff.py

Every solver runs at the loosest tolerance that reaches a relative error of 1e-6 in each state at
the end.  SciPy gets right-hand sides compiled by numba and takes its Jacobian by differences.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import control as ct
import numba
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp
from tables import machine

import nlctl

sys.path.append(str(Path(__file__).parents[1] / "tests" / "support"))
from stiff_problems import PROBLEMS

TARGET = 1e-6
TOLERANCES = 10.0 ** -np.arange(4, 13)
ATOL = 1e-6  # times the relative tolerance: Robertson's second state is 1e-6
ROUNDS = 5
Solve = Callable[[float], np.ndarray]  # of a tolerance, returns the state at the end


def solvers(update: Callable, end: float, x0: tuple[float, ...]) -> dict[str, Solve]:
    """Return what solves a problem, by name."""
    n = len(x0)
    block = ct.nlsys(
        update, lambda t, x, u, params: x, inputs=0, outputs=n, states=n, name="problem"
    )
    compiled, fused = nlctl.compile(block), numba.njit(update)
    grid, nothing = np.array([0.0, end]), np.zeros(0)

    def engine(method: str) -> Solve:
        def solve(rtol: float) -> np.ndarray:
            response = nlctl.input_output_response(
                compiled, grid, 0, x0, method=method, rtol=rtol, atol=ATOL * rtol, audit=False
            )
            return response.states[:, -1]

        return solve

    def scipy(method: str) -> Solve:
        def solve(rtol: float) -> np.ndarray:
            solution = solve_ivp(
                lambda t, x: fused(t, x, nothing, nothing), (0.0, end), x0, method,
                rtol=max(rtol, 1e-13), atol=ATOL * rtol, t_eval=[end],
            )  # fmt: skip
            return solution.y[:, -1] if solution.success else np.full(n, np.nan)

        return solve

    of_nlctl = {f"nlctl, {method}": engine(method) for method in ("auto", "rodas5p")}
    return of_nlctl | {f"SciPy {method}": scipy(method) for method in ("Radau", "LSODA")}


def measured(solve: Solve, expected: np.ndarray) -> tuple[float, float, float]:
    """Return the tolerance at which a solver reaches TARGET, its error there, and its time in s."""
    for rtol in TOLERANCES:
        error = float(np.max(np.abs(solve(rtol) - expected) / np.abs(expected)))
        if error <= TARGET:
            return rtol, error, min(_seconds(solve, rtol) for _ in range(ROUNDS))
    return np.nan, np.nan, np.nan


def _seconds(solve: Solve, rtol: float) -> float:
    start = time.perf_counter()
    solve(rtol)
    return time.perf_counter() - start


def main() -> None:
    """Print a table of each problem."""
    console = Console()
    console.print(machine())
    for name, problem in PROBLEMS.items():
        every = solvers(*problem)
        expected = every["SciPy Radau"](1e-12)
        table = Table("solver", "rtol", "error", "ms", "x SciPy Radau", title=name)
        rows = {key: measured(solve, expected) for key, solve in every.items()}
        for key, (rtol, error, seconds) in rows.items():
            times = rows["SciPy Radau"][2] / seconds
            table.add_row(
                key, f"{rtol:.0e}", f"{error:.1e}", f"{1e3 * seconds:.2f}", f"{times:.1f}"
            )
        console.print(table)


if __name__ == "__main__":
    main()
