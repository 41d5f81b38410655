"""States of actuators: memories, their names and where they start; states that are the output."""

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from ..arguments import number, vector
from ..equations import equation
from ..errors import ParameterError
from ..params import record

# rate (1/s) at which memories relax onto what they become, in plain `control` alone.
# `control.input_output_response` has no hook for accepted steps. Both engines of
# `nlctl.input_output_response` update memories between steps instead, and integrate no such rate
RELAXATION = 1e3


def relaxation(commit: Callable[..., Any]) -> Callable[..., Any]:
    """Return the `update` of memories that relax onto what `commit` says that they become."""

    @equation
    def update(t, x, u, p):
        """Relaxation of the memories."""
        after = commit(t, x, u, p)
        return tuple([RELAXATION * (after[i] - x[i]) for i in range(len(x))])

    return update


@equation
def output_of_state(t, x, u, p):
    """The output of a block whose first state it is."""
    return (x[0],)


def memory_names(name: str, count: int) -> tuple[str, ...]:
    """Return the names of states, ``memory[0]``, ``memory[1]``, ..."""
    return tuple(f"{name}[{i}]" for i in range(count))


def checked_start(spec: Any, count: int) -> np.ndarray:
    """Return a record's v0 as an array."""
    who = type(spec).__name__
    if count == 1:
        return np.array([number(who, "v0", spec.v0)])
    given = vector(who, "v0", np.atleast_1d(spec.v0))
    if given.size not in (1, count):
        raise ParameterError(f"{who} needs v0 to be one number or {count}, got {given.size}")
    return given


class FromUToV:
    """What actuators share: the names of their signals."""

    inputs = ("u",)
    outputs = ("v",)


@record
class Remembering(FromUToV):
    """What blocks share whose states are memories: where these start."""

    v0: float | tuple[float, ...] = 0.0
    states: ClassVar[Any]

    memory = property(lambda self: self.states)

    @property
    def initial(self) -> dict[str, float]:
        """The memories start from v0."""
        values = np.broadcast_to(np.asarray(self.v0, dtype=float), (len(self.states),))
        return dict(zip(self.states, values.tolist(), strict=True))

    def check(self) -> None:
        """One finite start for all memories, or one each."""
        checked_start(self, len(self.states))
