"""Reference solutions by SciPy's eighth-order method, independent of nlctl."""

from __future__ import annotations

import warnings

import numpy as np
from scipy.integrate import solve_ivp

from .fused import example_2_play


def smooth(rhs, x0, times, rtol):
    """Solve x' = rhs(t, x) at `times`; corners are left to the step control."""
    span = (times[0], times[-1])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a trial step may overflow
        return solve_ivp(rhs, span, x0, "DOP853", times, rtol=rtol, atol=rtol * 1e-2).y


def play(centres, x0, times, rtol):
    """Solve Example 2 with the exact play operator, branch by branch.

    A branch ends where the held output meets a side of the gap, or where u reverses on a side.
    """
    t, x, side, held = times[0], x0, 0, 0.0
    solution = np.full((x0.size, times.size), np.nan)
    while t < times[-1]:
        ends = _ends(centres, side, held)
        ahead = np.flatnonzero(times >= t)
        branch = solve_ivp(
            _branch(centres, side, held),
            (t, times[-1]),
            x,
            "DOP853",
            events=ends,
            dense_output=True,
            rtol=rtol,
            atol=rtol * 1e-2,
        )
        reached = ahead[times[ahead] <= branch.t[-1]]
        if reached.size:
            solution[:, reached] = branch.sol(times[reached])
        t, x = branch.t[-1], branch.y[:, -1]
        if branch.status == 1 and side == 0:
            side = 1 if branch.t_events[0].size else -1
        elif branch.status == 1:
            u = _command(centres, t, x, side, held)
            side, held = 0, 1.2 * (u - 0.5) if side > 0 else 1.2 * (u + 0.6)
    return solution


def _branch(centres, side, held):
    def rhs(t, x):
        dx = np.empty(x.size)
        example_2_play(t, x, dx, centres, side, held)
        return dx

    return rhs


def _command(centres, t, x, side, held):
    return example_2_play(t, x, np.empty(x.size), centres, side, held)


def _ends(centres, side, held):
    """Return the functions whose zeros end a branch."""

    def rate(t, x):  # u' by a central difference along the flow: a wrong turn by d costs d^2
        dx, step = np.empty(x.size), 1e-5
        example_2_play(t, x, dx, centres, side, held)
        ahead = _command(centres, t + step, x + step * dx, side, held)
        return (ahead - _command(centres, t - step, x - step * dx, side, held)) / (2 * step)

    def right(t, x):
        return _command(centres, t, x, side, held) - 0.5 - held / 1.2

    def left(t, x):
        return _command(centres, t, x, side, held) + 0.6 - held / 1.2

    for function, direction in ((rate, -side), (right, 1), (left, -1)):
        function.terminal, function.direction = True, direction
    return [rate] if side else [right, left]
