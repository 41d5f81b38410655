"""Runs in steps of one length, and one in discrete time, from sample to sample."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...responses.event_log import NO_EVENTS, EventLog
from ..audit import Audit, Trial
from ..audit import audit as compare
from ..compiled import Compiled
from ..integrate.state import Status
from ..machine.evaluations import prepared_parameters
from ..results import Statistics, Trajectory


class SteppedRun:
    """A run of a diagram in steps of one length, and where it stands."""

    def __init__(self, compiled: Compiled, dt: float) -> None:
        self.compiled, self.dt = compiled, dt
        self.k, self.start = 0, 0.0
        self.states, self.inputs = np.zeros(0), np.zeros(0)
        self.p = np.zeros(0)

    @property
    def time(self) -> float:
        """Time that is reached (s)."""
        return float(self.start + self.dt * self.k)

    def begin(self, x0: np.ndarray, p: np.ndarray, start: float) -> None:
        """Stand at the initial state."""
        self.p, self.k, self.start, self.states = p, 0, start, x0.copy()
        self.inputs = np.zeros(self.compiled.system.ninputs or 0)


class SampledRun(SteppedRun):
    """x[k+1] = f(t[k], x[k], u[k]), and y = h(t[k+1], x[k+1], u[k]) while u[k] still holds."""

    def begin(self, x0: np.ndarray, p: np.ndarray, start: float) -> None:
        """Stand at the initial state."""
        super().begin(x0, p, start)
        self.code, self.c = prepared_parameters(self.compiled, p)
        rows = self.code.lowered.rows
        self._given = np.zeros(1), np.zeros((x0.size, 1)), np.zeros((self.inputs.size, 1))
        self._made = np.zeros((x0.size, 1)), *(np.zeros((rows[name], 1)) for name in "gm")
        self._y = np.zeros((self.compiled.system.noutputs or 0, 1))

    def shown(self, u: np.ndarray) -> np.ndarray:
        """Return the outputs where the run stands, with inputs `u`."""
        self._give(u)
        self.code.out(*self._given, self.c, self._y)
        self.code.check(self.c)
        return self._y[:, 0].copy()

    def advance(self, u: np.ndarray) -> np.ndarray | None:
        """Go on for a step; return the outputs at its end, None if they are not finite."""
        self._give(u)
        with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the result says
            self.code.rhs(*self._given, self.c, *self._made)
            self.code.check(self.c)
            states = self._made[0][:, 0].copy()
            if not np.isfinite(states).all():
                return None
            self.states, self.inputs, self.k = states, u, self.k + 1
            outputs = self.shown(u)
        return outputs if np.isfinite(outputs).all() else None

    def _give(self, u: np.ndarray) -> None:
        t, x, given = self._given
        t[0], x[:, 0], given[:, 0] = self.time, self.states, u

    def keep(self) -> tuple[int, np.ndarray]:
        """Return all that the run knows."""
        return self.k, self.states

    def go_back(self, kept: tuple[int, np.ndarray]) -> None:
        """Stand where the run once stood."""
        self.k, self.states = kept

    def compared(self, x0: np.ndarray, params: Mapping[str, Any] | None, audit: Audit) -> None:
        """Compare the program with python-control at both ends of the step that was made."""
        u = np.repeat(self.inputs[:, None], 2, axis=1)
        trial = Trial(
            time=np.array([self.time - self.dt, self.time]), p=self.p, params=params, width=1,
            states=np.column_stack([x0, self.states]), inputs=u,
        )  # fmt: skip
        compare(self.compiled, trial, audit)

    def ended(self) -> Trajectory:
        """Return the step in which the run has ended, as a run."""
        statistics = Statistics(status=Status.DIVERGED, time=self.time, accepted=0, rejected=0)
        return Trajectory(
            time=np.array([self.time]), outputs=np.zeros((0, 1)), states=self.states[:, None],
            statistics=statistics, inputs=self.inputs[:, None],
        ).cut_short(self.code.lowered.cut)  # fmt: skip

    def events(self) -> EventLog:
        """Return what has happened in the last step: nothing is between two samples."""
        return NO_EVENTS
