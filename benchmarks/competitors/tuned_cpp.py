"""C++ tuned for these two loops, the yardstick: corners located, exact play, SIMD exponentials."""

from .problem import Problem, Solver
from .shared_library import built, solver

FLAGS = ("-O3", "-march=native", "-ffast-math", "-fopenmp-simd")


def solvers(problem: Problem) -> list[Solver]:
    """Return the tuned program; its ensembles run eight members side by side."""
    return [solver(problem, built("tuned", FLAGS), "C++ tuned", 8)]
