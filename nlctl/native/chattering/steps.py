"""Steps that a run has tried, as they are looked at: where they went, and a jump on their way."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...accumulation import Crowd


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A jump at which a run chatters."""

    times: tuple[float, float]  # on both sides of the jump (s); the same, or neighbouring ones
    # (nstates,): neighbouring states on both sides
    before: np.ndarray
    after: np.ndarray
    inputs: np.ndarray  # inputs of the program there
    crowd: Crowd | None = None  # how the switches accumulate, if they do
    accumulates: bool = False  # whether that is all: the run does not stay at this jump
    goes_on: bool = False  # whether each is at another place, see `progress`
    is_rough: bool = False  # whether it jumps with any rounding of the state, see `reference.rough`

    @property
    def time(self) -> float:
        """Time of the jump (s)."""
        return self.times[1]

    def first(self, states: int, inputs: int) -> "Jump":
        """Return the jump in the first so many states and inputs."""
        return replace(
            self, before=self.before[:states], after=self.after[:states],
            inputs=self.inputs[:inputs], crowd=None,
        )  # fmt: skip

    def sides(self, wider: float = 0.0) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Return times, states and inputs on both sides, further apart by so many distances."""
        (t, t_2), (x, x_2) = self.times, (self.before, self.after)
        apart, later = wider * (x_2 - x), wider * (t_2 - t)
        return [(t - later, x - apart, self.inputs), (t_2 + later, x_2 + apart, self.inputs)]


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """One step tried in every lane, as it was before and after; arrays as in `workspace`."""

    t: np.ndarray
    x: np.ndarray
    first: np.ndarray
    x_new: np.ndarray
    h: np.ndarray
    k: np.ndarray
    u: np.ndarray
    stiff: bool
    free: np.ndarray  # whether it did not get to a stop that was known before the run


@dataclass(frozen=True, kw_only=True)
class Way:
    """Where a lane has been at the beginnings of the steps that it has made."""

    points: list[tuple[float, np.ndarray, np.ndarray]]  # times, states and inputs
    rates: np.ndarray  # (points, nstates)
    g: np.ndarray  # (points, rows): switching functions and conditions

    def switches(self, row: int) -> np.ndarray:
        """Return the points before which a condition has changed its sign."""
        sides = np.sign(self.g[:, row])
        beside = np.flatnonzero(sides)  # a step may end where it is exactly 0
        return beside[1:][sides[beside[1:]] * sides[beside[:-1]] < 0]


def parameters_of(run: Any, j: int) -> np.ndarray:
    """Return the parameters of lane `j`, in every lane."""
    return np.ascontiguousarray(np.repeat(run.task.p[:, j : j + 1], run.machine.width, axis=1))


@dataclass(frozen=True, kw_only=True)
class LaneEquations:
    """The right-hand side of one lane, with what its memories would become behind it."""

    run: Any
    j: int
    c: np.ndarray  # its parameters, in every lane

    def __call__(self, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        dx, _, m = self._at(t, x, u)
        return np.concatenate([dx, m])

    def switching(self, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the switching functions and conditions, also those that another method finds."""
        return self._at(t, x, u)[1][: self.run.task.rows.guarded]

    def way(self, attempts: list[Attempt]) -> Way:
        """Return where the steps begin that the lane has tried."""
        # Rejected ones begin where others do.
        times = np.array([a.t[self.j] for a in attempts])
        made = [attempts[i] for i in np.flatnonzero(np.diff(times, prepend=-np.inf) > 0)]
        points = [(float(a.t[self.j]), a.x[:, self.j], a.u[:, self.j]) for a in made]
        g = np.array([self.switching(*point) for point in points])
        return Way(points=points, rates=np.array([a.first[:, self.j] for a in made]), g=g)

    @cached_property
    def _values(self) -> Any:
        machine = self.run.machine
        return machine.at_points(machine.rhs, "dx g m", self.c)

    def _at(self, t: float, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, ...]:
        dx, g, m = self._values(t, x, u)
        dx[self.run.task.rows.memory] = 0.0
        return dx, g, m

    def points(self, attempt: Attempt) -> Iterator[tuple[float, np.ndarray]]:
        """Yield where a step has been: at its ends and, of an explicit pair, at its stages."""
        j, h = self.j, attempt.h[self.j]
        t, x, A, C = attempt.t[j], attempt.x[:, j], self.run.task.pair.A, self.run.task.pair.C
        yield t, x
        if attempt.stiff or attempt.k.shape[0] != C.size:  # or of Taylor's method
            yield t + h, attempt.x_new[:, j]
            return
        slopes = np.vstack([attempt.first[None, :, j], attempt.k[1:, :, j]])
        for s in range(1, C.size):
            yield t + C[s] * h, x + h * (A[s, :s] @ slopes[:s])
