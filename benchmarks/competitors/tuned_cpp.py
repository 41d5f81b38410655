"""C++ tuned for these two loops, the yardstick: corners located, exact play, SIMD exponentials."""

from .problem import Problem, Solver
from .shared_library import built, solver

FLAGS = ("-O3", "-march=native", "-ffast-math", "-fopenmp-simd")


def solvers(problem: Problem) -> list[Solver]:
    """Return the tuned program; its ensembles run eight members batched."""
    flags = (*FLAGS, f"-DNODE_COUNT={problem.nodes}")
    return [solver(problem, built("tuned", flags), "C++ tuned", 8)]
