"""Functions that a run watches, as conditions that are located like those of the equations."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from ...errors import CompileError
from ...expressions.arrays import leaf_vector
from ...expressions.graph import Ambiguous, Untraceable
from ...expressions.trace import trace
from ...wording import counted
from ..diagram.schedule import Schedule
from ..diagram.trace import time
from .located import Located

if TYPE_CHECKING:
    from .reader import Reader


def watched_conditions(reader: Reader, schedule: Schedule) -> list[Located]:
    """Return the functions of a run as conditions."""
    graph, system = reader.graph, schedule.system
    sizes = (system.nstates or 0, system.ninputs or 0)
    rows = []
    for watch in schedule.watched:

        def arguments() -> tuple:
            x, u = (leaf_vector(graph, k, 0, (n,)) for k, n in zip("xu", sizes, strict=True))
            return time(graph), x, u, dict(schedule.overrides)

        try:
            value = trace(graph, partial(watch.function), arguments)
            if value.size != 1:
                raise Untraceable(f"it returns {counted(value.size, 'number')}, not one")
        except (Untraceable, Ambiguous) as error:
            raise CompileError(
                f"event function '{watch.name}' cannot be compiled: {error}; "
                "engine='python-control' calls it unchanged"
            ) from None
        function = graph.number(value.reshape(-1)[0].only)
        rows.append(Located(function=function, block="", what=watch.name, bends=False))
    return rows
