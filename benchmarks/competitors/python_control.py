"""python-control itself, which interprets the diagram."""

from typing import Any

import control as ct

from .problem import Problem, Solver


def solvers(problem: Problem) -> list[Solver]:
    """Return python-control with SciPy's LSODA, at the one tolerance that its slowness allows."""
    loop = problem.loop
    x0: Any = problem.x0  # python-control declares a number

    def run(rtol):
        settings = {"rtol": rtol, "atol": rtol * 1e-2}
        return ct.input_output_response(
            loop, problem.times, 0, x0, method="LSODA", solve_ivp_kwargs=settings
        ).states

    return [
        Solver(
            name="python-control, LSODA",
            rhs=lambda t, x: loop.dynamics(t, x, ()),
            run=run,
            ensemble=None,
            tolerances=(1e-7 if problem.example == 1 else 5e-8,),
        )
    ]
