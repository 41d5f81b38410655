"""The routine that fills the Taylor coefficients of a diagram's solution, as machine code."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...blocks import supplied_of
from ...errors import ParameterError
from ...expressions.dependence import reads
from ...sliding.relay import SLIDING
from ...upstream.numba_internals import is_jit_disabled
from ..codegen.plan import Store
from ..codegen.rewrite import rewritten
from ..diagram.parameters import length
from ..integrate.memory import zeros
from ..lower import Lowered, planned, stores_of
from ..machine.finish import finished
from ..machine.routine import Routine
from ..reading import Reading
from .folds import WIDE, SeriesLayout, taylor_text
from .plain import plain_series
from .recurrences import NoSeriesError, Recurrences, recurrences
from .steps import steps_text

_FIRST = ("t", "x", "u", "c", "o", "k")
_FOLLOWING = ("t", "x", "u", "c", "v", "w", "o", "b", "a", "q", "k")
_LAST = ("w", "b", "k")
_STEP_FUNCTIONS = ("taylor", "growth", "step", "judge", "values")
_SETTINGS = ("order", "rtol", "atol")


@dataclass(frozen=True, kw_only=True)
class Series:
    """Machine code of the coefficients of some members."""

    lowered: Lowered
    prepare: Any  # ``prepare(p, c)``
    # those of `_STEP_FUNCTIONS`. The first one fills coefficients `k` of shape (orders, rows,
    # members): the states' are in the first rows, then those of the switching functions.
    functions: tuple[Any, ...]
    layout: SeriesLayout
    # (comparisons, 3): see `Recurrences.sides`, and whether memories have a part in it
    sides: np.ndarray

    def parameters(self, p: np.ndarray, **settings: float) -> np.ndarray:
        """Return the `c` of parameter vectors, shape (parameters, members), and of `_SETTINGS`."""
        c = zeros((self.layout.size, p.shape[1]))
        self.prepare(np.ascontiguousarray(p), c)
        for name in _SETTINGS:
            c[self.layout.at[name]] = settings[name]
        return c


def series(reading: Reading, p: np.ndarray, width: int) -> Series:
    """Return the coefficients of `width` members' solutions, made when they are first needed."""
    return reading.cache.found(
        Series,
        lambda kept: kept.lowered.lanes == width and kept.lowered.holds_for(p),
        lambda: _made(reading, p, width),
    )


def _check(reading: Reading) -> None:
    """Refuse what has no coefficients, whatever its equations are."""
    name, schedule = reading.system.name, reading.schedule
    if not reading.system.nstates:
        raise ParameterError(
            f"'{name}' has no states, which method='taylor' needs: use method='tsit5'"
        )
    relays = [node.path for node in schedule.nodes if supplied_of(node.system) is SLIDING]
    if relays:
        raise ParameterError(
            f"'{name}' has an ideal relay ('{relays[0]}'), which method='taylor' does not "
            "integrate: use method='tsit5'"
        )


def _made(reading: Reading, p: np.ndarray, width: int) -> Series:
    _check(reading)
    read = reading.equations_with(p[:, 0])
    lowered, recurrence = _lowered(reading, read, width)
    layout = _layout(lowered)
    switching, n = reading.program.events + read.conditions.rows, lowered.rows["x"]
    count = len(reading.program.memory)
    changing = range(n + switching + count, n + switching + 2 * count)
    compared = [*range(n, n + switching), *changing, *(row for row, *_ in recurrence.sides)]
    if is_jit_disabled():
        prepare, *functions = plain_series(lowered, recurrence, compared, layout)
    else:
        steps = steps_text(lowered.rows["x"], switching, compared, layout)
        text = "\n".join([lowered.text, taylor_text(recurrence.folds, layout), steps])
        loaded = finished(text, ("prepare", *_STEP_FUNCTIONS))
        prepared = ((lowered.rows["p"], width), (layout.size, width))
        prepare, *functions = (
            Routine(
                address=address, loaded=loaded, opaque=(),
                shapes=prepared if name == "prepare" else (),  # others are integrators' alone
            )
            for name, address in loaded.addresses.items()
        )  # fmt: skip
    memory = reading.program.memory
    sides = [(a, b, int(reads([expr], "x", memory))) for a, b, expr in recurrence.sides]
    return Series(
        lowered=lowered, prepare=prepare, functions=tuple(functions), layout=layout,
        sides=np.array(sides, dtype=np.int64).reshape(-1, 3),
    )  # fmt: skip


def _layout(lowered: Lowered) -> SeriesLayout:
    """Give what a step needs its rows behind the parameters in `c`."""
    at, row = {}, lowered.size
    for name in ("w", "o", "a", "q", *_SETTINGS):
        at[name], row = row, row + (1 if name in _SETTINGS else lowered.rows[name] + WIDE)
    return SeriesLayout(rows=lowered.rows["k"], at=at, lanes=lowered.lanes, size=row)


def _asked(reading: Reading, read: Any) -> dict[str, list[Store]]:
    """Return what has coefficients: rates, switching functions, what memories would become.

    Memories stand still within a step.  Behind what they would become there is room for its
    derivative, which follows from it.
    """
    asked, zero = stores_of(read, ("dx", "g", "m")), read.graph.const(0.0)
    memory, dx = set(reading.program.memory), list[Store]()
    for store in asked["dx"]:
        rows = range(store.row, store.row + store.size)
        if memory.isdisjoint(rows):
            dx.append(store)
        else:
            dx += [
                replace(
                    store, row=row, size=1,
                    expr=zero if row in memory else read.graph.item(store.expr, k),
                )
                for k, row in enumerate(rows)
            ]  # fmt: skip
    first = reading.program.events + read.conditions.rows
    become = [replace(store, array="g", row=first + store.row) for store in asked["m"]]
    count = len(memory)
    derivatives = [Store(array="g", row=first + count + i, expr=zero, size=1) for i in range(count)]
    return {"dx": dx, "g": asked["g"] + become + derivatives}


def _lowered(reading: Reading, read: Any, width: int) -> tuple[Lowered, Recurrences]:
    program, n, m = reading.program, reading.system.nstates or 0, reading.schedule.ninputs
    stores, exact, graph = rewritten(read.graph, _asked(reading, read))
    try:
        recurrence = recurrences(
            graph,
            stores,
            {"x": n, "g": program.events + read.conditions.rows + 2 * len(program.memory)},
            packed=width == 1,
        )
    except NoSeriesError as error:
        raise ParameterError(
            f"'{reading.system.name}' cannot be integrated with method='taylor': {error}; use "
            "method='tsit5'"
        ) from error
    parameters = length(program.layout)
    functions, size = planned(
        {"first": recurrence.first, "following": recurrence.following, "last": recurrence.last},
        {"first": _FIRST, "following": _FOLLOWING, "last": _LAST},
        parameters,
    )
    recurrence.rows["k"] = (recurrence.rows["k"] + WIDE) // WIDE * WIDE + WIDE
    rows = {"p": parameters, "t": 1, "x": n, "u": m, "v": m, "c": max(size, 1), **recurrence.rows}
    lowered = Lowered(
        functions=functions, exact=exact, calls={}, solvers={}, rows=rows | {"b": rows["k"]},
        lanes=width, assumed=read.graph.assumptions,
    )  # fmt: skip
    return lowered, recurrence
