"""Speed of the native engine against python-control, with the accuracy reached beside every time.

    python benchmarks/closed_loops.py [members]

One run and an ensemble of both examples over 20 s.  Compare rows of equal error, and ratios
within one output only: the times depend on the machine and on what else it does.
"""

from __future__ import annotations

import sys
import time

import control as ct
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

import nlctl

T = np.linspace(0, 20, 201)


def timed(function, repeat=3):
    """Return the shortest time of several calls (s) and the result."""
    best, result = np.inf, None
    for _ in range(repeat):
        start = time.perf_counter()
        result = function()
        best = min(best, time.perf_counter() - start)
    return best, result


def scipy_run(compiled, x0, rtol):
    """solve_ivp with the compiled right-hand side: what fusing by hand buys."""
    rhs, p, empty = compiled.native[0], compiled.parameter_vector(), np.zeros(0)
    g = np.empty(compiled.program.events)

    def f(t, x):
        dx = np.empty(x.size)
        rhs(t, np.ascontiguousarray(x), empty, p, dx, g)
        return dx

    return solve_ivp(f, (0, 20), x0, "LSODA", t_eval=T, rtol=rtol, atol=rtol * 1e-2).y


def rows(loop, members):
    """Yield engine, tolerance, time per run, error in the states."""
    x0, compiled = nlctl.initial_state(loop), nlctl.compile(loop)
    start = time.perf_counter()
    compiled.native  # noqa: B018
    yield "compiling, or loading from the cache", "", time.perf_counter() - start, np.nan

    def native(rtol):
        return nlctl.input_output_response(compiled, T, rtol=rtol, atol=rtol * 1e-2).states

    reference = native(1e-12)

    def error(states):
        return float(np.abs(states - reference).max())

    def python_control():
        solver = {"rtol": 1e-7, "atol": 1e-9}
        return ct.input_output_response(
            loop, T, 0, x0, method="LSODA", solve_ivp_kwargs=solver
        ).states

    seconds, states = timed(python_control, repeat=1)
    yield "python-control, LSODA", "1e-7", seconds, error(states)
    seconds, states = timed(lambda: scipy_run(compiled, x0, 1e-7))
    yield "SciPy LSODA, compiled right-hand side", "1e-7", seconds, error(states)
    for rtol in (1e-5, 1e-6, 1e-8):
        seconds, states = timed(lambda rtol=rtol: native(rtol))
        yield "nlctl, one run", f"{rtol:.0e}", seconds, error(states)
    varied = {"plant.x1": x0[0] + np.linspace(-0.1, 0.1, members)}
    for threads in (1, 2):
        seconds, _ = timed(
            lambda n=threads: nlctl.ensemble_response(compiled, T, 0, varied, threads=n, rtol=1e-6),
            repeat=1,
        )
        yield (
            f"nlctl, {members} members, {threads} thread(s), per member",
            "1e-06",
            (seconds / members),
            np.nan,
        )


def main():
    """Print one table per example."""
    members = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    for loop in (nlctl.paper.example_1(), nlctl.paper.example_2()):
        table = Table("engine", "rtol", "ms", "max error in the states", "times python-control")
        base = None
        for engine, rtol, seconds, error in rows(loop, members):
            base = seconds if engine.startswith("python-control") else base
            ratio = f"{base / seconds:.0f}" if base else ""
            shown = "" if np.isnan(error) else f"{error:.1e}"
            table.add_row(engine, rtol, f"{1e3 * seconds:.1f}", shown, ratio)
        Console(width=110).print(f"[bold]{loop.name}[/bold], 20 s", table)


if __name__ == "__main__":
    main()
