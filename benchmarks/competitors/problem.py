"""What all competitors are given and give back, and how their answers are judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

import nlctl

from . import reference
from .fused import in_place

LAYOUTS = {27: "diagonal", 125: "5x25", 1000: "25x40"}  # of Example 1
Array = NDArray[np.float64]


class UnavailableError(Exception):
    """A competitor cannot run here; the message says why."""


@dataclass(frozen=True)
class Problem:
    """One of the paper's closed loops over 20 s.

    Attributes
    ----------
    example : int
        1 or 2.
    nodes : int
        Of the network: 27, in Example 1 also 125 or 1000.
    times, coarse : ndarray
        Times (s) at which a run, and each member of an ensemble, is sampled.
    target : float
        Largest error in the plant's states that a solver may have.
    """

    example: int
    nodes: int = 27
    target: float = 1e-6
    times = np.linspace(0, 20, 201)
    coarse = np.linspace(0, 20, 21)

    @cached_property
    def loop(self):
        """The python-control diagram."""
        if self.example == 2:
            return nlctl.paper.example_2()
        return nlctl.paper.example_1(centres=LAYOUTS[self.nodes])

    @cached_property
    def compiled(self):
        """The same diagram, compiled by nlctl."""
        return nlctl.compile(self.loop)

    @property
    def order(self) -> int:
        """Order n of the plant."""
        return self.example + 1

    @cached_property
    def centres(self) -> Array:
        """The centres of the network, shape (nodes, n)."""
        layout = LAYOUTS[self.nodes] if self.example == 1 else "3x3x3"
        return np.array(nlctl.paper.paper_centres(layout, self.order), dtype=float)

    @cached_property
    def x0(self) -> Array:
        """Initial state: x_1..x_n, W_hat, delta_hat, zeta, in Example 2 the memory."""
        return np.array(nlctl.initial_state(self.loop), dtype=float)

    def spread(self, members: int) -> Array:
        """Return the values of x_1(0) that an ensemble takes."""
        return self.x0[0] + np.linspace(-0.1, 0.1, members)

    def start(self, x1: float) -> Array:
        """Return the initial state of one member."""
        x0 = self.x0.copy()
        x0[0] = x1
        return x0

    def fused(self) -> Callable[[float, Array], Array]:
        """Return the right-hand side fused by hand as ``f(t, x) -> dx``."""
        f, centres = in_place(self.example), self.centres

        def rhs(t, x):
            dx = np.empty(x.size)
            f(t, x, dx, centres)
            return dx

        return rhs

    def states(self) -> int:
        """Return the number of states that can be compared: all but the backlash's memory."""
        return self.order + len(self.centres) + 2

    @cached_property
    def answers(self) -> dict[str, Array]:
        """Reference solutions, shape (states, 201), by the model of the actuator."""
        return self.solve(self.x0, self.times, 1e-13)

    def solve(self, x0: Array, times: Array, rtol: float) -> dict[str, Array]:
        """Solve each model of the actuator from x0 far more accurately than any competitor."""
        solved = reference.smooth(self.fused(), x0, times, rtol)[: self.states()]
        if self.example == 1:
            return {"dead zone": solved}
        exact = reference.play(self.centres, x0[:-1], times, rtol)
        return {"play": exact, "relaxed": solved}


@dataclass(frozen=True, kw_only=True)
class Solver:
    """One way to solve a problem."""

    name: str
    # ``rhs(t, x) -> dx``: what is integrated, to be compared with nlctl's before any timing
    rhs: Callable[[float, Array], Array]
    # ``run(rtol) -> states``, shape (states, 201); the absolute tolerance is rtol / 100
    run: Callable[[float], Array]
    # ``ensemble(rtol, x1, threads) -> x``: plant states of each member, shape (members, n,
    # 21).  None: members one after the other, each as slow as one run.
    ensemble: Callable[[float, Array, int], Array] | None
    # relative tolerances to choose from, falling
    tolerances: Sequence[float] = tuple(10 ** -(k / 2) for k in range(10, 24))
    cores: int = 2  # number of cores that an ensemble can use
    # ``prepare(rtol)``: what is done once for a tolerance, such as compiling; it is not timed
    prepare: Callable[[float], object] = bool


def wrong_equations(problem: Problem, solver: Solver, points: int = 50) -> float:
    """Return the largest difference of a solver's right-hand side from nlctl's.

    It is taken at random states around those that the loops visit, relative to the size of the
    derivatives, and is a few rounding errors if the equations are the same.
    """
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(points):
        t = rng.uniform(0, 20)
        x = rng.normal(0, 1, problem.x0.size)
        expected = problem.compiled.dynamics(t, x)
        rates = np.asarray(solver.rhs(t, x))
        worst = max(worst, float(np.max(np.abs(rates - expected) / (1 + np.abs(expected)))))
    return worst


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """Largest absolute errors over the 201 times."""

    model: str  # the model of the actuator that was solved: the reference that lies nearest
    # error in x_1..x_n, and in all states but the memory of a backlash
    plant: float
    states: float
    # error in x_1..x_n against the exact play; equal to `plant` where there is no other model
    truth: float


def accuracy(problem: Problem, states: Array, answers: dict[str, Array]) -> Accuracy:
    """Compare states (or plant states alone) with the reference solutions."""

    def error(model: str, rows: int) -> float:
        return float(np.max(np.abs(states[:rows] - answers[model][:rows])))

    n, rows = problem.order, min(len(states), problem.states())
    model = min(answers, key=lambda name: error(name, n))
    truth = error(next(iter(answers)), n)
    return Accuracy(model=model, plant=error(model, n), states=error(model, rows), truth=truth)
