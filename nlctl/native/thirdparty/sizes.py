"""Blocks that do not say how many signals they have: the arguments of a run say it."""

from __future__ import annotations

from typing import Any

import control as ct
import numpy as np

from ...params import as_numbers
from .checks import check_functions

__all__ = ["sized"]


def sized(system: Any, inputs: Any, initial_state: Any) -> Any:
    """Return a block with the numbers of states, inputs and outputs that a run gives it.

    python-control takes them from the run's arguments where a block does not declare them.

    Parameters
    ----------
    system : control.InputOutputSystem
        Returned as it is unless it is a block that lacks a number.
    inputs, initial_state : object
        The run's: as many inputs as rows (1 for a number), as many states as values.

    Returns
    -------
    control.InputOutputSystem
    """
    counts = (system.nstates, system.ninputs, system.noutputs)
    diagram = isinstance(system, ct.InterconnectedSystem)
    if diagram or not isinstance(system, ct.NonlinearIOSystem) or None not in counts:
        return system
    u, x = (as_numbers(value) for value in (inputs, initial_state))
    if u is None or (x is None and initial_state is not None):
        return system  # lists and names: what is missing is named when it is compiled
    states = counts[0] if counts[0] is not None else 0 if x is None else x.size
    rows = counts[1] if counts[1] is not None else u.shape[0] if u.ndim == 2 else 1
    outputs = counts[2]
    if outputs is None:
        outputs = states if system.outfcn is None else _output_size(system, states, rows)
    return _with(system, states, rows, outputs)


def _with(system: Any, states: int, inputs: int, outputs: int | None) -> Any:
    made = ct.NonlinearIOSystem(
        system.updfcn, system.outfcn, states=states, inputs=inputs, outputs=outputs,
        dt=system.dt, params=system.params, name=system.name,
    )  # fmt: skip
    made._update_params(None)
    return made


def _output_size(system: Any, states: int, inputs: int) -> int:
    """Return how many outputs there are, of a function that is known to remember nothing."""
    asked = _with(system, states, inputs, None)
    check_functions(system.name, asked)
    return int(np.size(asked._out(0.0, np.zeros(states), np.zeros(inputs))))
