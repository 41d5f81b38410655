"""Taylor's method for a run: what it cannot do is refused by name, what it needs is laid out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...errors import ParameterError
from ..equations.relays import relay_places
from ..integrate.memory import with_fields
from ..machine.routine import entry
from ..reading import Reading
from ..settings import Settings
from .routine import series

LEAST, MOST = 4, 30  # orders
_COST = 0.35  # of a step of order 1, in explicit ones: measured, 1.4 to 2.4 at 8, 4 to 5 at 15


def order_for(rtol: float) -> int:
    """Return the order of Taylor's method for a tolerance: 1 - ln(rtol) / 2, rounded up.

    With it the work per unit of time is least for long steps of a given part of the radius of
    convergence: A. Jorba, M. Zou, Experimental Mathematics 14:99 (2005).

    Examples
    --------
    >>> order_for(1e-6), order_for(1e-12)
    (8, 15)
    """
    return min(max(math.ceil(1.0 - 0.5 * math.log(rtol)), LEAST), MOST)


def with_taylor(
    task: Any, reading: Reading, p: np.ndarray, settings: Settings
) -> tuple[Any, tuple[int, int]]:
    """Return the task with Taylor's method, and the shape of the coefficients."""
    _check(reading)
    order, coefficients = order_for(settings.rtol), series(reading, p, p.shape[1])
    entries = [entry(function) for function in coefficients.functions]
    plain = any(callable(one) for one in entries)
    taylor = with_fields(
        task.taylor,
        highest=order,
        functions=np.array(entries, dtype=object if plain else np.int64),
        sides=coefficients.sides,
        c=coefficients.parameters(p, order=order, rtol=settings.rtol, atol=settings.atol),
        cost=_COST * order,
    )
    # the power of the step size in its error; there are no stages at parts of a step
    inside = task.pair.inside * [[0.0], [1.0], [1.0]]
    pair = with_fields(task.pair, order=order + 1.0, stable=np.inf, inside=inside)
    return with_fields(task, taylor=taylor, pair=pair), (order + 1, coefficients.layout.rows)


def _check(reading: Reading) -> None:
    """Refuse what has no coefficients, whatever its equations are."""
    name, schedule = reading.system.name, reading.schedule
    if not reading.system.nstates:
        raise ParameterError(
            f"'{name}' has no states, which method='taylor' needs: use method='tsit5'"
        )
    memories = [reading.system.state_labels[i] for i in reading.program.memory]
    relays = [schedule.nodes[i].path for i in relay_places(schedule.nodes)]
    for what, places in (("memory", memories), ("an ideal relay", relays)):
        if places:
            raise ParameterError(
                f"'{name}' has {what} ('{places[0]}'), which method='taylor' does not integrate: "
                "use method='tsit5'"
            )
