"""A program's machine code for batched members, whichever way it can be had."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...sampling.system import Happening
from ..equations.blocks import equations
from ..lower import Lowered, lower
from ..reading import Reading
from .routine import called_back, entries_of, entry, lowered_code, raise_failures

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
    # ``resets(t, x, u, c, s)``: the states of all blocks with guards, behind a jump
    resets: Any = None
    meetings: tuple[Happening, ...] = ()  # what happens to them there

    @property
    def rows(self) -> int:
        """Rows of the parameters that `rhs` and `out` take."""
        return self.lowered.size

    @property
    def called_back(self) -> tuple[str, ...]:
        """Names of functions that call back into Python."""
        return called_back(self._functions)

    @property
    def _functions(self) -> tuple[Any, ...]:
        resets = () if self.resets is None else (self.resets,)
        return (self.rhs, self.out, *self.samples, *resets)

    @property
    def entries(self) -> tuple[Any, Any]:
        """What integrators take of `rhs` and `out`."""
        return entry(self.rhs), entry(self.out)

    @property
    def sample_entries(self) -> np.ndarray:
        """What integrators take of `samples`."""
        return entries_of(self.samples)

    @property
    def reset_entries(self) -> np.ndarray:
        """What integrators take of `resets`: one function, or none."""
        return entries_of(() if self.resets is None else (self.resets,))

    @property
    def signal_entry(self) -> np.ndarray:
        """What integrators take of `out` to look at delayed signals."""
        return entries_of((self.out,))

    def check(self, c: np.ndarray) -> None:
        """Raise what an opaque function has raised, with `c` as the parameters."""
        raise_failures(self._functions, c)


def machine(
    reading: Reading, p: np.ndarray, width: int = 1, happening: Iterable[Happening] = ()
) -> Machine:
    """Return machine code that holds for parameter vectors `p` of shape (parameters, members)."""
    # It has functions for all that happens to sampled blocks; where clocks with other parameters
    # meet as they do not in the unchanged diagram, these are made.
    # Where an integer that steers an equation has another value, the blocks' functions are read
    # once more. The first member's values decide: `fitting` says for which members they hold.
    known = reading.cache.of(Machine)
    asked = set(happening)
    for code in known:
        if code.width == width and asked <= set(code.meetings) and code.lowered.holds_for(p):
            return code
    traced, schedule, program = reading.equations, reading.schedule, reading.program
    extra = [what for what in happening if what not in program.meetings]
    meetings = (*program.meetings, *dict.fromkeys(extra))
    if extra or not all(p[i, 0] == value for i, value in traced.graph.assumptions.items()):
        traced = equations(schedule, program.layout, p[:, 0], meetings)
    lowered = lower(schedule, program, width, traced)
    if not lowered.holds_for(p):
        raise ValueError("members whose integers differ have no machine code in common")
    prepare, rhs, out, *samples = lowered_code(lowered)
    resets = samples.pop() if program.guards else None
    known.append(
        Machine(
            width=width,
            lowered=lowered,
            prepare=prepare,
            rhs=rhs,
            out=out,
            samples=tuple(samples),
            resets=resets,
            meetings=meetings,
        )
    )
    if len(known) == 1:
        _hint(reading, known[0])
    return known[-1]


def _hint(reading: Reading, code: Machine) -> None:
    """Say which functions take the time of Python, and at which line that is decided."""
    for name in code.called_back:
        call = reading.equations.calls[name]
        _LOG.warning(
            "hint: the %s function of block '%s' is called back in Python, so runs are no faster "
            "than python-control's: %s",
            call.kind, call.block, call.reason,
        )  # fmt: skip


def fitting(reading: Reading, p: np.ndarray, width: int) -> np.ndarray:
    """Return for which members the machine code of the first one holds."""
    code = machine(reading, np.repeat(p[:, :1], width, axis=1), width)
    return np.array([code.lowered.holds_for(column) for column in p.T], dtype=bool)


def evaluations(reading: Reading) -> tuple[Callable[..., None], Callable[..., None]]:
    """Return ``rhs(t, x, u, p, dx, g, m)`` and ``out(t, x, u, p, y)`` of flat vectors."""
    machine(reading, reading.parameter_vector()[:, None])

    def rhs(t: float, x: Any, u: Any, p: np.ndarray, dx: Any, g: Any, m: Any) -> None:
        code, c = prepared_parameters(reading, p)
        events = np.empty((code.lowered.rows["g"], 1))  # others where integers steer what switches
        code.rhs(np.array([t]), _column(x), _column(u), c, dx[:, None], events, m[:, None])
        g[:] = events[:, 0] if events.shape[0] == g.size else np.nan

    def out(t: float, x: Any, u: Any, p: np.ndarray, y: np.ndarray) -> None:
        code, c = prepared_parameters(reading, p)
        code.out(np.array([t]), _column(x), _column(u), c, y[:, None])

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


def _column(values: Any) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=float).reshape(-1, 1)
