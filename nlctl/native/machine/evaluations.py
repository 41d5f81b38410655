"""A program's machine code for batched members, whichever way it can be had."""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...sampling.system import Happening
from ..collected import collected_rarely
from ..equations.blocks import equations
from ..lower import Lowered, lower
from ..reading import Reading
from .routine import Routine, entry, lowered_code

_LOG = logging.getLogger("nlctl")
ENSEMBLE_WIDTH = 8  # members of a batch in ensembles: one AVX-512 register


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Functions over `width` members, with the member as the last index of every array."""

    width: int
    lowered: Lowered  # the plan that they are made from
    # ``prepare(p, c)`` fills these from the program's parameter vectors
    prepare: Callable[[np.ndarray, np.ndarray], None]
    # ``rhs(t, x, u, c, dx, g, m)`` and ``out(t, x, u, c, y)``
    rhs: Any
    out: Any
    # ``sample(t, x, u, c, s)`` for each meeting: the next states of sampled blocks
    samples: tuple[Any, ...] = ()
    # ``reset(t, x, u, c, s)``, if there are guards: the states of their blocks behind a jump
    resets: tuple[Any, ...] = ()
    # ``sharp(t, x, u, c, s)``, if there are sharp functions: by what these are measured
    sharp: tuple[Any, ...] = ()
    meetings: tuple[Happening, ...] = ()  # what happens to them there

    @property
    def rows(self) -> int:
        """Rows of the parameters that `rhs` and `out` take."""
        return self.lowered.size

    @property
    def called_back(self) -> tuple[str, ...]:
        """Names of functions that call back into Python."""
        calls = [call for function in self._routines for call in function.opaque]
        names = [call.call.name for call in calls if call.call.name in call.native.called_back]
        return tuple(dict.fromkeys(names))

    @cached_property
    def _routines(self) -> list[Routine]:
        every = (self.rhs, self.out, *self.samples, *self.resets, *self.sharp)
        return [function for function in every if isinstance(function, Routine)]

    @property
    def entries(self) -> tuple[Any, Any]:
        """What integrators take of `rhs` and `out`."""
        return entry(self.rhs), entry(self.out)

    def at_points(
        self, function: Callable[..., Any], names: str, c: np.ndarray
    ) -> Callable[[Any, Any, Any], list[np.ndarray]]:
        """Return what makes a function's arrays of these names of t, x and u, `c` in every lane."""
        points = [np.zeros(self.lowered.shape(name)) for name in "txu"]
        results = [np.zeros((self.lowered.rows[name], self.width)) for name in names.split()]
        arrays = (*points, c, *results)
        call = function.bound(*arrays) if isinstance(function, Routine) else None

        def values(t: Any, x: Any, u: Any) -> list[np.ndarray]:
            for array, value in zip(points, (t, x, u), strict=True):
                array[:] = np.reshape(value, (*array.shape[:-1], 1))
            call() if call else function(*arrays)
            return [array[:, -1].copy() for array in results]

        return values

    def values(
        self, function: Callable[..., Any], names: str, point: Any, c: np.ndarray
    ) -> list[np.ndarray]:
        """Return what a function makes of one point (t, x, u), see `at_points`."""
        return self.at_points(function, names, c)(*point)

    def check(self, c: np.ndarray) -> None:
        """Raise what an opaque function has raised, with `c` as the parameters."""
        for function in self._routines:
            function.check(c)


def machine(
    reading: Reading, p: np.ndarray, width: int = 1, happening: Iterable[Happening] = ()
) -> Machine:
    """Return machine code that holds for parameter vectors `p` of shape (parameters, members)."""
    # It has functions for all that happens to sampled blocks; where clocks with other parameters
    # meet as they do not in the unchanged diagram, these are made.
    # Where an integer that steers an equation has another value, the blocks' functions are read
    # once more. The first member's values decide: `fitting` says for which members they hold.
    known = reading.cache.of(Machine)
    asked = tuple(dict.fromkeys(happening))
    for code in known:
        if code.width == width and set(asked) <= set(code.meetings) and code.lowered.holds_for(p):
            return code
    known.append(_made(reading, p, width, asked))
    if len(known) == 1:
        _hint(reading, known[0])
    return known[-1]


@collected_rarely()
def _made(reading: Reading, p: np.ndarray, width: int, asked: Iterable[Happening]) -> Machine:
    """Return machine code that also has functions for all of these happenings."""
    schedule, program = reading.schedule, reading.program
    extra = [what for what in asked if what not in program.meetings]
    meetings = (*program.meetings, *extra)
    traced = (
        equations(schedule, program.layout, p[:, 0], meetings)
        if extra
        else reading.equations_with(p[:, 0])
    )
    lowered = lower(schedule, program, width, traced)
    if not lowered.holds_for(p):
        raise ValueError("members whose integers differ have no machine code in common")
    prepare, rhs, out, *samples = lowered_code(lowered)
    sharp = (samples.pop(),) if "sharp" in lowered.functions else ()
    resets = (samples.pop(),) if program.guards else ()
    return Machine(
        width=width, lowered=lowered, prepare=prepare, rhs=rhs, out=out, samples=tuple(samples),
        resets=resets, sharp=sharp, meetings=meetings,
    )  # fmt: skip


def _hint(reading: Reading, code: Machine) -> None:
    """Say which functions take the time of Python, and at which line that is decided."""
    for name in code.called_back:
        call = code.lowered.calls[name]
        _LOG.warning(
            "hint: the %s function of block '%s' is called back in Python, so runs are no faster "
            "than python-control's: %s",
            call.kind, call.block, call.why,
        )  # fmt: skip


def fitting(reading: Reading, p: np.ndarray, width: int) -> np.ndarray:
    """Return for which members the machine code of the first one holds."""
    code = machine(reading, np.repeat(p[:, :1], width, axis=1), width)
    return np.array([code.lowered.holds_for(column) for column in p.T], dtype=bool)


def evaluations(reading: Reading) -> tuple[Callable[..., None], Callable[..., None]]:
    """Return ``rhs(t, x, u, p, dx, g, m)`` and ``out(t, x, u, p, y)`` of flat vectors."""
    machine(reading, reading.parameter_vector()[:, None])

    def rhs(
        t: float, x: object, u: object, p: np.ndarray, dx: np.ndarray, g: np.ndarray, m: np.ndarray
    ) -> None:
        code, c = prepared_parameters(reading, p)
        dx[:], events, m[:] = code.values(code.rhs, "dx g m", (t, x, u), c)
        g[:] = events if events.size == g.size else np.nan  # integers steer what switches

    def out(t: float, x: object, u: object, p: np.ndarray, y: np.ndarray) -> None:
        code, c = prepared_parameters(reading, p)
        (y[:],) = code.values(code.out, "y", (t, x, u), c)

    return rhs, out


def prepared_parameters(
    reading: Reading, p: np.ndarray, width: int = 1, happening: Iterable[Happening] = ()
) -> tuple[Machine, np.ndarray]:
    """Return machine code for a parameter vector, and what its functions take of that."""
    members = np.repeat(p[:, None], width, axis=1)
    code = machine(reading, members, width, happening)
    c = np.zeros((code.rows, width))
    code.prepare(members, c)
    return code, c
