"""States of actuators: memories, their names and where they start; states that are the output."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arguments import vector
from ..equations import equation
from ..errors import ParameterError

# rate (1/s) at which memories relax onto what they become, in plain `control` alone.
# `control.input_output_response` has no hook for accepted steps. Both engines of
# `nlctl.input_output_response` update memories between steps instead, and integrate no such rate
RELAXATION = 1e3


def relaxation(commit: Any) -> Any:
    """Return the `update` of memories that relax onto what `commit` says that they become."""
    become: Callable[..., Any] = getattr(commit, "__func__", commit)

    @equation
    def update(t, x, u, p):
        """Relaxation of the memories."""
        after = become(t, x, u, p)
        return tuple([RELAXATION * (after[i] - x[i]) for i in range(len(x))])

    return staticmethod(update)


@equation
def output_of_state(t, x, u, p):
    """The output of a block whose first state it is."""
    return (x[0],)


def memory_names(name: str, count: int) -> tuple[str, ...]:
    """Return the names of states, ``memory[0]``, ``memory[1]``, ..."""
    return tuple(f"{name}[{i}]" for i in range(count))


def started(name: str, v0: Any, count: int) -> dict[str, float]:
    """Return the initial values of `count` memories from one number for all, or one each."""
    values = np.broadcast_to(np.asarray(v0, dtype=float), (count,))
    return {f"{name}[{i}]": float(values[i]) for i in range(count)}


def checked_start(spec: Any, count: int) -> np.ndarray:
    """Return a record's v0 as an array."""
    who = type(spec).__name__
    given = vector(who, "v0", np.atleast_1d(spec.v0))
    if given.size not in (1, count):
        raise ParameterError(f"{who} needs v0 to be one number or {count}, got {given.size}")
    return given
