"""Boost.odeint on the loop fused by hand in C++."""

from .problem import Problem, Solver
from .shared_library import built, solver


def solvers(problem: Problem) -> list[Solver]:
    """Return one solver per controlled Runge-Kutta method."""
    flags = ("-O3", "-march=native", f"-DNODE_COUNT={problem.nodes}")
    library = built("boost_odeint", flags)
    return [
        solver(problem, library, f"C++ Boost.odeint {name}", method)
        for method, name in enumerate(("dopri5", "fehlberg78"))
    ]
