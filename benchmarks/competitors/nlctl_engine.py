"""nlctl's native engine, from unmodified block functions."""

import numpy as np

import nlctl

from .problem import Problem, Solver


def solvers(problem: Problem) -> list[Solver]:
    """Return nlctl's solver with its default method."""
    compiled, n = problem.compiled, problem.order
    names = [f"x{i}" for i in range(1, n + 1)]

    def run(rtol):
        return nlctl.input_output_response(
            compiled, problem.times, rtol=rtol, atol=rtol * 1e-2
        ).states

    def ensemble(rtol, x1, threads):
        made = nlctl.ensemble_response(
            compiled,
            problem.coarse,
            initial_state={"plant.x1": x1},
            keep=names,
            threads=threads,
            rtol=rtol,
            atol=rtol * 1e-2,
        )
        return np.stack([made.signals[name] for name in names], axis=1)

    return [Solver(name="nlctl", rhs=compiled.dynamics, run=run, ensemble=ensemble)]
