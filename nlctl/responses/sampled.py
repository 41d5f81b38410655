"""Diagrams with sampled blocks in python-control: from sample to sample, the reference."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..diagrams import leaves
from ..sampling.clock import Instants, instants
from ..sampling.system import Happening, Sampled, clocks_of, happening
from ..upstream.control_internals import set_parameters
from .arguments import interpolated
from .time_response import response_of


def sampled_states(system: Any) -> dict[int, Any]:
    """Return the block that each state of a sampled block is of, by place in the state vector."""
    return {
        i: leaf.system
        for leaf in leaves(system)
        if isinstance(leaf.system, Sampled)
        for i in range(leaf.state_offset, leaf.state_offset + (leaf.system.nstates or 0))
    }


def from_sample_to_sample(
    simulate: Callable[..., Any],
    system: Any,
    times: np.ndarray,
    inputs: np.ndarray,
    x0: np.ndarray,
    *,
    params: Any,
    evaluation_times: np.ndarray | None,
    **settings: Any,
) -> Any:
    """Simulate a diagram with sampled blocks.

    Parameters
    ----------
    simulate : callable
        `control.input_output_response`.
    system : control.InputOutputSystem
    times : ndarray of shape (m,)
    inputs : ndarray of shape (ninputs, m)
    x0 : ndarray of shape (nstates,)
    params : dict
    evaluation_times : ndarray of shape (k,)
        Times of the response; those of `times` if None.
    **settings
        Further arguments of `simulate`.

    Returns
    -------
    control.TimeResponseData
        Signals at an instant of a sample are those after it; at the last one those before.
    """
    wanted = times if evaluation_times is None else evaluation_times
    found = sampled_states(system)
    set_parameters(system, params)
    due = instants(clocks_of(found.values()), float(times[0]), float(times[-1]))
    x = np.array(x0, dtype=float)
    y = np.full((system.noutputs or 0, wanted.size), np.nan)
    states = np.full((system.nstates or 0, wanted.size), np.nan)
    form = {name: settings.pop(name, None) for name in ("squeeze", "transpose", "return_states")}
    for begin, end, what in _segments(due, times):
        u = interpolated(inputs, times, np.array([begin]))[:, 0]
        rows = [i for i, block in found.items() if block.acts(what)]
        x[rows] = _after(system, (begin, x, u), what, params)[rows]
        inner = np.union1d(times, wanted)
        grid = np.concatenate(([begin], inner[(inner > begin) & (inner < end)], [end]))
        with happening():
            part = simulate(
                system, grid, interpolated(inputs, times, grid), x, params=params,
                squeeze=False, transpose=False, return_states=False, **settings,
            )  # fmt: skip
        taken = (wanted >= begin) & ((wanted < end) | (end == times[-1]))
        columns = np.searchsorted(grid, wanted[taken])
        y[:, taken] = np.reshape(part.y, (y.shape[0], grid.size))[:, columns]
        path = np.reshape(part.x, (states.shape[0], grid.size))
        states[:, taken], x = path[:, columns], path[:, -1].copy()
    signals = (wanted, y, states, interpolated(inputs, times, wanted))
    return response_of(system, signals, params, form)


def _segments(due: Instants, times: np.ndarray) -> Iterator[tuple[float, float, Happening]]:
    """Yield from when to when nothing happens, and what happens at the beginning."""
    begins, what = due.times.tolist(), [due.patterns[i] for i in due.which]
    if not begins or begins[0] > times[0]:
        begins, what = [float(times[0]), *begins], [frozenset(), *what]
    for k, begin in enumerate(begins):
        yield begin, begins[k + 1] if k + 1 < len(begins) else float(times[-1]), what[k]


def _after(system: Any, point: Any, what: Happening, params: Any) -> Any:
    """Return the states after what happens at an instant, for those of sampled blocks."""
    if not what:
        return point[1]
    with happening(what):
        return np.asarray(system.dynamics(*point, params=params)).reshape(-1)
