"""Loops whose signals are searched for: one step of the search, repeated until it is done.

Like a call of an opaque function a search has its arguments in rows of `c`, its results follow,
and it goes member by member: what one member needs has no influence on another one.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...expressions.graph import Expr
from .interpret import interpreted_function
from .plan import Function

PASS = ("w", "s", "n", "c")  # arguments of a step: given from outside, state, next state, memory
GUESS = 4  # where the guess begins in the state; the first entry is the phase
DONE = 2.0


@dataclass(frozen=True, kw_only=True)
class Solver:
    """A search."""

    name: str
    given: int  # how many numbers it is given
    count: int  # how many it results in
    function: Function  # one step, for one member
    exact: frozenset[Expr]  # operations of it that are rounded one by one
    initial: tuple[float, ...]  # the state that it begins with


def searched(solver: Solver) -> Callable[[np.ndarray], np.ndarray]:
    """Return a search as a function of what it is given, a column per point."""
    find = plain_solver(solver)

    def search(given: np.ndarray) -> np.ndarray:
        c = np.concatenate([given, np.empty((solver.count, given.shape[1]))])
        for point in range(given.shape[1]):
            find(c, 0, point)
        return c[solver.given :]

    return search


def plain_solver(solver: Solver) -> Callable[[np.ndarray, int, int], None]:
    """Return a search as plain Python, called with c, a row and a member."""
    step = interpreted_function(solver.function, 1, {})

    def at(c: np.ndarray, row: int, lane: int) -> None:
        given = c[row : row + solver.given, [lane]]
        state, memory = np.array(solver.initial)[:, None], np.empty((solver.function.plan.rows, 1))
        while state[0, 0] != DONE:
            following = np.empty_like(state)
            step(given, state, following, memory)
            state = following
        first = row + solver.given
        c[first : first + solver.count, lane] = state[GUESS : GUESS + solver.count, 0]

    return at
