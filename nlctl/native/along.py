"""The derivative of a right-hand side along directions, as machine code for the stiff method.

The members of a batch are directions here: all have the same time, state, inputs and parameters.
So a Jacobian matrix of n states takes n / `DIRECTIONS` evaluations, and the generator of right-hand
sides serves for it as it is.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..expressions.dependence import structure
from .equations.blocks import Equations
from .integrate.methods.lu import Elimination, elimination
from .integrate.state import DIRECTIONS
from .jacobians import along
from .lower import Lowered, lower_along
from .machine.routine import entry, lowered_code
from .reading import Reading


@dataclass(frozen=True, kw_only=True)
class Along:
    """Machine code of derivatives, for all parameters that it holds for, and some of these."""

    equations: Equations  # of what they are the derivatives
    lowered: Lowered
    prepare: Any
    point: object  # ``point(t, x, u, c)``, once for each point
    # ``function(t, x, u, c, v, dx)``, every array with a direction in each column.  A direction
    # `v` has the rows of the states, the inputs, and time
    function: Callable[..., Any]
    # how linear equations with the Jacobian matrix of the states are solved
    elimination: Elimination
    c: np.ndarray = field(default_factory=lambda: np.zeros((0, DIRECTIONS)))  # (rows, DIRECTIONS)

    @property
    def entries(self) -> tuple[Any, Any]:
        """What integrators take of the functions."""
        return entry(self.point), entry(self.function)


def derivatives(reading: Reading, p: np.ndarray) -> Along | None:
    """Return the derivatives for a parameter vector, made when they are first needed."""
    # Equations, and cuts of loops, are those of its integers. None if there are none: a program of
    # derivatives was itself differentiated for an integer that has another value now. Opaque
    # functions have differences in them.
    made = _made_with(reading, p)
    if not made.lowered.holds_for(p) and reading.apart is not None:
        made = _made_with(reading, p)  # what steers derivatives alone is known now
    if not made.lowered.holds_for(p):
        return None
    c = np.zeros((made.lowered.size, DIRECTIONS))
    made.prepare(np.repeat(p[:, None], DIRECTIONS, axis=1), c)
    return replace(made, c=c)


def _made_with(reading: Reading, p: np.ndarray) -> Along:
    read = reading.equations_with(p)
    return reading.cache.found(
        Along, lambda each: each.equations is read, lambda: _made(reading, read)
    )


def _made(reading: Reading, equations: Equations) -> Along:
    n, m = reading.system.nstates or 0, reading.schedule.ninputs
    rows = along(equations, "dx", {"x": 0, "u": n, "t": n + m})
    lowered = lower_along(reading.schedule, reading.program, equations, rows, DIRECTIONS)
    prepare, point, function = lowered_code(lowered)
    order = elimination(structure(equations.pieces("dx"), "x", n))
    return Along(
        equations=equations, lowered=lowered, prepare=prepare, point=point, function=function,
        elimination=order,
    )  # fmt: skip
