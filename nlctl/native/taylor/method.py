"""Taylor's method for a run: what it cannot do is refused by name, what it needs is laid out."""

import math
from typing import Any

import numpy as np

from ..integrate.memory import with_fields, with_table
from ..integrate.methods.taylor import TaylorMethod
from ..integrate.workspace import Task
from ..machine.routine import entries_of
from ..reading import Reading
from ..settings import Settings
from .routine import series

LEAST, MOST = 6, 30  # orders; of 4 and 5 steps are not followed to where fast conditions lie
_COST = 0.2  # of a step of order 1, in explicit ones: measured, 1.1 to 1.9 at 8, 1.5 to 2.7 at 13


def order_for(rtol: float) -> int:
    """Return the order of Taylor's method for a tolerance: 1 - ln(rtol) / 2, rounded up; 6 or more.

    With it the work per unit of time is least for long steps of a given part of the radius of
    convergence: A. Jorba, M. Zou, Experimental Mathematics 14:99 (2005).

    Examples
    --------
    >>> order_for(1e-6), order_for(1e-12)
    (8, 15)
    """
    return min(max(math.ceil(1.0 - 0.5 * math.log(rtol)), LEAST), MOST)


def with_taylor(
    task: Task, reading: Reading, p: np.ndarray, settings: Settings
) -> tuple[Any, tuple[int, int]]:
    """Return the task with Taylor's method, and the shape of the coefficients."""
    order, coefficients = order_for(settings.rtol), series(reading, p, p.shape[1])
    taylor = with_table(
        TaylorMethod,
        highest=order,
        functions=entries_of(coefficients.functions),
        sides=coefficients.sides,
        c=coefficients.parameters(p, order=order, rtol=settings.rtol, atol=settings.atol),
        compared=int(settings.method != "taylor"),
        cost=_COST * order,
    )
    # the power of the step size in its error; there are no stages at parts of a step
    inside = task.pair.inside * [[0.0], [1.0], [1.0]]
    pair = with_fields(task.pair, order=order + 1.0, stable=np.inf, inside=inside)
    return with_fields(task, taylor=taylor, pair=pair), (order + 1, coefficients.layout.rows)
