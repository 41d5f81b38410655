"""Time and accuracy of competitors, measured in one run."""

from __future__ import annotations

import importlib
import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from competitors.problem import (
    Accuracy,
    Problem,
    Solver,
    UnavailableError,
    accuracy,
    wrong_equations,
)

COMPETITORS = {
    "python-control": "python_control",
    "nlctl": "nlctl_engine",
    "scipy": "scipy_ivp",
    "numbalsoda": "numbalsoda_cfunc",
    "diffrax": "diffrax_tsit5",
    "heyoka": "heyoka_taylor",
    "boost": "boost_odeint",
    "tuned": "tuned_cpp",
}
SAME = 1e-9 / 27  # of right-hand sides, a node: a few roundings, amplified by exp(zeta^2)
PATIENCE = 1.5  # s: what takes longer is timed once


@dataclass(frozen=True, kw_only=True)
class Row:
    """One competitor's figures."""

    name: str
    rtol: float  # the tolerance that was chosen
    seconds: float  # shortest time of a run, or per member of an ensemble; NaN if it was not timed
    accuracy: Accuracy
    members: int = 1
    threads: int = 1


def available(problem: Problem, names: Iterable[str], say: Callable[[str], object]) -> list[Solver]:
    """Return the solvers that can run here and integrate the right equations.

    What is left out is reported with the reason.
    """
    usable = []
    for name in names:
        module = importlib.import_module(f"competitors.{COMPETITORS[name]}")
        try:
            solvers = module.solvers(problem)
        except UnavailableError as reason:
            say(f"skipped {name}: {reason}")
            continue
        for solver in solvers:
            difference = wrong_equations(problem, solver)
            if difference < SAME * problem.nodes:  # false for NaN
                usable.append(solver)
            else:
                say(f"refused {solver.name}: its equations differ from nlctl's by {difference:.1e}")
    return usable


def single_runs(problem: Problem, solvers: Iterable[Solver], rounds: int) -> list[Row]:
    """Choose each solver's tolerance, then time all of them in turn, `rounds` times."""
    chosen = [(solver, *_tolerance(problem, solver)) for solver in solvers]
    best = [seconds for *_, seconds in chosen]
    for _ in range(rounds):
        for i, (solver, rtol, _, seconds) in enumerate(chosen):
            if seconds < PATIENCE:
                best[i] = min(best[i], _timed(solver.run, rtol)[0])
    return [
        Row(name=solver.name, rtol=rtol, seconds=seconds, accuracy=reached)
        for (solver, rtol, reached, _), seconds in zip(chosen, best, strict=True)
    ]


def _timed(function: Callable, *arguments, threads: int = 1) -> tuple[float, np.ndarray]:
    """Return the seconds that a call takes, and its result.

    One core is timed by what it computes, so that other processes do not count; several by the
    clock on the wall.
    """
    clock = time.process_time if threads == 1 else time.perf_counter
    start = clock()
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a trial step may overflow
        result = function(*arguments)
    return clock() - start, result


def _tolerance(problem: Problem, solver: Solver) -> tuple[float, Accuracy, float]:
    """Return the loosest tolerance from which on the error is at most the target, the error, and s.

    One good result may be luck, so the next tolerance must confirm it.  If none does, the most
    accurate one is returned.
    """
    tried = []
    for rtol in solver.tolerances:
        solver.prepare(rtol)
        seconds, states = _timed(solver.run, rtol)
        tried.append((rtol, accuracy(problem, states, problem.answers), seconds))
        if len(tried) > 1 and all(t[1].plant <= problem.target for t in tried[-2:]):
            return tried[-2]
    return min(tried, key=lambda t: np.nan_to_num(t[1].plant, nan=np.inf))


def ensembles(
    problem: Problem, solvers: Iterable[Solver], singles: Iterable[Row], limit: int, cores: int
) -> list[Row]:
    """Time members that differ in x_1(0), on one core and on `cores`.

    As many members are run as fit into PATIENCE, at most `limit`; the first and the last are
    compared with reference solutions.  A solver without an ensemble, or that missed the target,
    keeps the row of its single run.
    """
    answers = [problem.solve(problem.start(x1), problem.coarse, 1e-11) for x1 in problem.spread(2)]
    rows = []
    for solver, single in zip(solvers, singles, strict=True):
        members = int(np.clip(PATIENCE / single.seconds, 16, limit))
        if solver.ensemble is None or not single.accuracy.plant <= problem.target:
            rows.append(single)
            continue
        solver.ensemble(single.rtol, problem.spread(members), 1)  # JAX compiles for a shape
        for threads in sorted({1, min(cores, solver.cores)}):
            arguments = single.rtol, problem.spread(members), threads
            runs = [_timed(solver.ensemble, *arguments, threads=threads) for _ in range(2)]
            seconds = min(seconds for seconds, _ in runs) / members
            ends = runs[0][1][[0, -1]]
            reached = [accuracy(problem, x, a) for x, a in zip(ends, answers, strict=True)]
            rows.append(
                Row(
                    name=solver.name,
                    rtol=single.rtol,
                    seconds=seconds,
                    accuracy=max(reached, key=lambda a: a.plant),
                    members=members,
                    threads=threads,
                )
            )
    return rows
