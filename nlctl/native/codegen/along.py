"""The derivative of a right-hand side along directions, as machine code for the stiff method.

The members of a batch are directions here: all have the same time, state, inputs and parameters.
So a Jacobian matrix of n states takes n / `DIRECTIONS` evaluations, and the generator of right-hand
sides serves for it as it is.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...expressions.dependence import structure
from ..integrate.methods.lu import Elimination, elimination
from ..integrate.state import DIRECTIONS
from ..jacobians import along
from ..machine.routine import entry, lowered_code
from .lower import lower_along

if TYPE_CHECKING:
    from ..compiled import Compiled

_ONCE = threading.Lock()  # of several threads that need it one compiles


@dataclass(frozen=True, kw_only=True)
class Along:
    """Machine code of derivatives, and what it takes as parameters.

    Attributes
    ----------
    point : callable
        ``point(t, x, u, c)``, once for each point.
    function : callable
        ``function(t, x, u, c, v, dx)``, every array with a direction in each column.  A direction
        `v` has the rows of the states, the inputs, and time.
    c : ndarray of shape (rows, DIRECTIONS)
    elimination : Elimination
        How linear equations with the Jacobian matrix of the states are solved.
    """

    point: Any
    function: Any
    c: np.ndarray
    elimination: Elimination

    @property
    def entries(self) -> tuple[Any, Any]:
        """What integrators take of the functions."""
        return entry(self.point), entry(self.function)


def derivatives(compiled: Compiled, p: np.ndarray) -> Along | None:
    """Return the derivatives for a parameter vector, made when they are first needed.

    None if there are none: an equation was differentiated for an integer parameter that has
    another value now.  Opaque functions have differences in them.
    """
    with _ONCE:
        if "_along" not in compiled.__dict__:
            compiled.__dict__["_along"] = _made(compiled)
    made = compiled.__dict__["_along"]
    if made is None or not made[0].holds_for(p):
        return None
    lowered, prepare, point, function, order = made
    c = np.zeros((lowered.size, DIRECTIONS))
    prepare(np.repeat(p[:, None], DIRECTIONS, axis=1), c)
    return Along(point=point, function=function, c=c, elimination=order)


def _made(compiled: Compiled) -> Any:
    equations = compiled.equations
    n, m = compiled.system.nstates or 0, compiled.schedule.ninputs
    rows = along(equations, "dx", {"x": 0, "u": n, "t": n + m})
    lowered = lower_along(compiled.schedule, compiled.program, equations, rows, DIRECTIONS)
    order = elimination(structure(equations.pieces("dx"), "x", n))
    return lowered, *lowered_code(lowered), order
