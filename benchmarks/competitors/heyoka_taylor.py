"""heyoka: Taylor's method compiled by LLVM, corners as events; four members batched.

The branch of the dead zone is a parameter that terminal events switch, so every step is smooth.
Example 2 is left out: heyoka is not given where its backlash reverses, u' = 0.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from .problem import Problem, Solver, UnavailableError

BATCH = 4  # doubles in a register of AVX2; more where there is more
LARGEST = 125
RIGHT, LEFT = 0, 1  # parameters: 1 where u is beyond this corner
CORNERS = (0.5, -0.3)


def solvers(problem: Problem) -> list[Solver]:
    """Return heyoka's solver; its ensembles run in batches, on one core."""
    try:
        import heyoka
    except ImportError:
        raise UnavailableError("heyoka is not installed (pip install heyoka)") from None
    if problem.example != 1:
        raise UnavailableError("heyoka is not given where a backlash reverses")
    if problem.nodes > LARGEST:
        raise UnavailableError(f"more than {LARGEST} nodes take it minutes to compile")
    variables, rates, u = _loop(heyoka, problem.centres)
    system = list(zip(variables, rates, strict=True))
    evaluate = heyoka.cfunc([*rates, u], vars=variables)

    def values(t: float, x: np.ndarray, branch: Any) -> np.ndarray:
        return np.asarray(evaluate(np.array(x, dtype=float), pars=np.array(branch), time=float(t)))

    def branch(t: float, x: np.ndarray) -> list[float]:
        command = values(t, x, [0.0, 0.0])[-1]
        return [float(command > CORNERS[RIGHT]), float(command < CORNERS[LEFT])]

    @functools.cache
    def integrator(rtol: float) -> Any:
        events = [
            heyoka.t_event(u - corner, callback=_switch(side))
            for side, corner in enumerate(CORNERS)
        ]
        return heyoka.taylor_adaptive(
            system, problem.x0.copy(), tol=rtol, t_events=events, pars=[0.0, 0.0]
        )

    @functools.cache
    def batch(rtol: float) -> Any:
        events = [
            heyoka.t_event_batch(u - corner, callback=_switch_batch(side))
            for side, corner in enumerate(CORNERS)
        ]
        state = np.repeat(problem.x0[:, None], BATCH, axis=1)
        return heyoka.taylor_adaptive_batch(
            system, state, tol=rtol, t_events=events, pars=np.zeros((2, BATCH))
        )

    def run(rtol: float) -> np.ndarray:
        ta = integrator(rtol)
        ta.time, ta.state[:], ta.pars[:] = 0.0, problem.x0, branch(0.0, problem.x0)
        ta.reset_cooldowns()
        return ta.propagate_grid(problem.times)[-1].T

    def ensemble(rtol: float, x1: np.ndarray, threads: int) -> np.ndarray:
        ta, n, trajectories = batch(rtol), problem.order, []
        grid = np.repeat(problem.coarse[:, None], BATCH, axis=1)
        for first in range(0, x1.size, BATCH):
            members = np.minimum(np.arange(first, first + BATCH), x1.size - 1)
            starts = np.stack([problem.start(x1[k]) for k in members], axis=1)
            ta.set_time(0.0)
            ta.state[:] = starts
            ta.pars[:] = np.stack([branch(0.0, x) for x in starts.T], axis=1)
            ta.reset_cooldowns()
            states = ta.propagate_grid(grid)
            states = states[-1] if isinstance(states, tuple) else states
            trajectories.append(np.moveaxis(states[:, :n], 2, 0))  # (members, times, n)
        return np.moveaxis(np.concatenate(trajectories)[: x1.size], 1, 2)

    return [
        Solver(
            name="heyoka", rhs=lambda t, x: values(t, x, branch(t, x))[:-1], run=run,
            ensemble=ensemble, tolerances=tuple(10 ** -(k / 2) for k in range(6, 20)), cores=1,
            prepare=integrator,
        )
    ]  # fmt: skip


def _switch(side: int) -> Any:
    beyond = 1 if side == RIGHT else -1

    def switched(ta: Any, direction: int) -> bool:
        ta.pars[side] = float(direction == beyond)
        return True

    return switched


def _switch_batch(side: int) -> Any:
    beyond = 1 if side == RIGHT else -1

    def switched(ta: Any, direction: int, member: int) -> bool:
        ta.pars[side, member] = float(direction == beyond)
        return True

    return switched


def _loop(hy: Any, centres: np.ndarray) -> tuple[list[Any], list[Any], Any]:
    """Return Example 1 as heyoka's expressions: states, their derivatives, and u."""
    nodes, t = len(centres), hy.time
    x1, x2, *rest = hy.make_vars(*(f"x{i}" for i in range(2 + nodes + 2)))
    W, (delta_hat, zeta) = rest[:nodes], rest[nodes:]
    s, c, s2, c2 = hy.sin(t), hy.cos(t), hy.sin(0.5 * t), hy.cos(0.5 * t)
    e1, e2 = x1 - 0.5 * (s + s2), x2 - (0.5 * c + 0.25 * c2)
    r, Y_d = 1.5 * e1 + e2, 0.5 * s + 0.125 * s2 + 1.5 * e2
    psi = [hy.exp(-0.25 * ((x1 - a) ** 2 + (x2 - b) ** 2)) for a, b in centres]
    robust = hy.tanh(r / 0.2)
    network = hy.sum([w * p for w, p in zip(W, psi, strict=True)])
    eta = 2.5 * r + network + delta_hat * robust + Y_d
    u = hy.exp(zeta * zeta) * hy.cos(0.5 * np.pi * zeta) * eta
    right = (1.0 + 0.3 * hy.sin(u)) * (u - 0.5)
    left = (0.8 + 0.2 * hy.cos(u)) * (u + 0.3)
    v = hy.par[RIGHT] * right + hy.par[LEFT] * left
    h = (1.0 + 0.1 * hy.cos(x1)) * (1.0 + 0.2 * hy.cos(v)) * v
    forcing = (5.0 + 0.1 * c) * hy.cos((0.5 + 0.1 * s) * t)
    damping = (0.2 + 0.2 * hy.cos(5.0 * x1)) * x2
    x2_rate = 0.2 * x1 - damping - x1**3.0 + forcing + h + 0.1 * (x1**2.0 + x2**2.0) * s
    rates = [x2, x2_rate, *(0.5 * (r * p - 0.5 * w) for w, p in zip(W, psi, strict=True))]
    rates += [1.5 * (r * robust - 0.5 * delta_hat), r * eta]
    return [x1, x2, *rest], rates, u
