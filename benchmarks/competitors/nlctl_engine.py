"""nlctl's native engine, from unmodified block functions: its default method, and Taylor's."""

import numpy as np

import nlctl

from .problem import Problem, Solver


def solvers(problem: Problem) -> list[Solver]:
    """Return nlctl's solvers."""
    methods = {"nlctl": "auto", "nlctl, Taylor": "taylor"}
    return [solver(problem, name, method) for name, method in methods.items()]


def solver(problem: Problem, name: str, method: str) -> Solver:
    """Return nlctl's solver with one of its methods."""
    compiled, n = problem.compiled, problem.order
    names = [f"x{i}" for i in range(1, n + 1)]

    def run(rtol):
        return nlctl.input_output_response(
            compiled, problem.times, rtol=rtol, atol=rtol * 1e-2, method=method
        ).states

    def ensemble(rtol, x1, threads):
        runs = nlctl.ensemble_response(
            compiled,
            problem.coarse,
            initial_state={"plant.x1": x1},
            keep=names,
            threads=threads,
            rtol=rtol,
            atol=rtol * 1e-2,
            method=method,
        )
        return np.stack([runs.signals[name] for name in names], axis=1)

    return Solver(
        name=name, rhs=compiled.dynamics, run=run, ensemble=ensemble,
        tolerances=tuple(10 ** -(k / 2) for k in range(8, 24)),
    )  # fmt: skip
