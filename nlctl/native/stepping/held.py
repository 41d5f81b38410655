"""A run in continuous time, step by step, with inputs that are held over each step."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...responses.event_log import EventLog
from ..audit import Audit, Trial
from ..audit import audit as compare
from ..chattering.detection import new_paces
from ..compiled import Compiled
from ..driver import begin
from ..happened import happened
from ..histories import arriving_first
from ..integrate.state import OK, RUNNING
from ..integrators import handle, integrators
from ..results import Trajectory, made
from ..run import Run
from ..settings import Settings
from ..taylor.turns import turned, with_turns
from ..windows import ROUNDS, differentiated, go_on, next_window
from .sampled_run import SteppedRun
from .window import HELD_STEPS, Window, first_window, following, in_full, packed_window, until


class HeldRun(SteppedRun):
    """A run that continues whenever it is given inputs for another step."""

    def __init__(self, compiled: Compiled, dt: float, settings: Settings) -> None:
        super().__init__(compiled, dt)
        self.settings = settings
        self._functions = integrators()
        self._called: tuple[Any, tuple[Any, ...]] = None, ()
        self._shown: tuple[Any, tuple[Any, ...]] = None, ()
        self._laid: tuple[bytes, Window, np.ndarray] | None = None

    def begin(self, x0: np.ndarray, p: np.ndarray, start: float) -> None:
        """Stand at the initial state; what happens there waits for the first inputs."""
        super().begin(x0, p, start)
        key = p.tobytes() + np.float64(start).tobytes()
        if self._laid is None or self._laid[0] != key:
            window = first_window(self.compiled, (start, self.dt), x0, p, self.settings)
            run = with_turns(self.compiled, window.run, self.settings)
            window = replace(window, run=run)
            self._laid = key, window, window.memory.copy()
        _, self.window, memory = self._laid
        self.window.memory[:] = memory
        work = self.window.run.work
        work.x[:, 0] = x0
        if work.past.shown.size:
            work.past.shown[0, :, 0] = arriving_first(self.compiled, self.window.run.task)
        self.paces = new_paces(self.window.run.lanes)

    def shown(self, u: np.ndarray) -> np.ndarray:
        """Return the outputs where the run stands, with inputs `u`."""
        place = self.window.place(self.k) - (self.k > 0)
        return self._outputs(float(self.window.times[place]), self.states, u, place)[0]

    def advance(self, u: np.ndarray) -> np.ndarray | None:
        """Go on for a step; return the outputs at its end, None if the run has ended before."""
        if self.k >= self.window.first + HELD_STEPS:
            span = self.start, self.dt
            self.window = following(self.compiled, self.window, span, self.p, self.settings)
        i = self.window.place(self.k)
        task, past = self.window.run.task, self.window.run.work.past
        task.inputs[:, i] = task.inputs[:, i + 1] = u
        if self.k and past.fresh.size and np.any(u != self.inputs):
            np.minimum(past.fresh, 1, out=past.fresh)  # a kink: where the last step ended
        with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the status says
            return self.concluded(self._moved(), u)

    def concluded(self, run: Run, u: np.ndarray) -> np.ndarray | None:
        """Stand at the end of a step; return the outputs there, None if the run has ended."""
        self._keep(run)
        if run.lanes["status"][0] != OK:
            return None
        end = self.window.place(self.k) + 1
        outputs, states = self._outputs(
            float(self.window.times[end]), run.work.samples[end, :, 0], u, end
        )
        self.states, self.inputs, self.k = states, u, self.k + 1
        return outputs if np.isfinite(outputs).all() else None

    def _moved(self) -> Run:
        """Return the run at the end of its next step, made as the steps of any run are."""
        lanes = self.window.run.lanes
        if self.k == 0:
            begin(in_full(self.window))
        run = until(self.window, self.k)
        lanes["status"], lanes["noted"], lanes["resumes"] = RUNNING, 0, 0
        run.work.taylor.expanded[:] = 0  # that was without the inputs that follow
        self._functions["advance"](*self.arguments(run))
        return self.followed(run)

    def followed(self, run: Run) -> Run:
        """Return a run at the end of a step whose first rounds have been made."""
        if run.lanes["status"][0] == OK:  # as nearly all steps end
            run.machine.check(run.task.p)
            return run
        run = self._turned(go_on(run, ROUNDS))
        while run.lanes["status"][0] == RUNNING:
            run = self._turned(next_window(self.compiled, run, self.paces, self.p))
        return run

    def arguments(self, run: Run) -> tuple[Any, ...]:
        """Return what integrators take of a run; it is kept, for most steps are of the same one."""
        if self._called[0] is not run:
            rhs, _ = run.machine.entries
            point, along = (0, 0) if run.along is None else run.along.entries
            self._called = run, (rhs, point, along, handle(run.task), handle(run.work), ROUNDS)
        return self._called[1]

    def _turned(self, run: Run) -> Run:
        """Return a run by the method, and with the derivatives, that it asks for."""
        run = differentiated(self.compiled, run, self.p)
        return turned(self.compiled, run, self.p, self.settings)

    def _keep(self, run: Run) -> None:
        """Make a run that has gone on that of the window, also where it has got new arrays."""
        window = self.window
        if run is window.run:
            return
        run = replace(run, task=run.task._replace(times=window.times))
        if run.work is window.run.work:
            self.window = replace(window, run=run)
            return
        packed = packed_window(run, window.first, window.times)
        self.window = replace(packed, reach=window.reach)

    def _outputs(
        self, t: float, x: np.ndarray, u: np.ndarray, place: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the outputs and the states, whose memories are what they have become."""
        run, (task, work) = self.window.run, self.window.ending
        task.times[:] = t, t + 1.0
        task.inputs.T[:] = u
        work.samples[:, :, 0] = x
        if work.past.shown.size:
            work.past.shown[:] = run.work.past.shown[place]
        if self._shown[0] is not self.window:
            taken = *run.machine.entries, handle(task), handle(work)
            self._shown = self.window, taken
        self._functions["outputs"](*self._shown[1])
        run.machine.check(task.p)
        return work.y[0, : task.outputs, 0].copy(), work.samples[0, :, 0].copy()

    def keep(self) -> tuple[Any, ...]:
        """Return all that the run knows: the window and a copy of its memory, and the last step."""
        return self.window, self.window.memory.copy(), self.k, self.inputs, self.states

    def go_back(self, kept: tuple[Any, ...]) -> None:
        """Stand where the run once stood."""
        self.window, memory, self.k, self.inputs, self.states = kept
        self.window.memory[:] = memory
        if self.k:
            end = self.window.place(self.k) - 1
            first = max(end - 1, 0)
            self.window.run.task.inputs[:, first : end + 1] = self.inputs[:, None]

    def compared(self, _: np.ndarray, params: Mapping[str, Any] | None, audit: Audit) -> None:
        """Compare the program with python-control at both ends of the step that was made."""
        i = self.window.place(self.k - 1)
        task, work = self.window.run.task, self.window.run.work
        shown = work.past.shown[i : i + 2, :, 0].T
        given = task.inputs[:, i : i + 2]
        rates = np.zeros((self.compiled.schedule.rates, 2))
        _, first = self._outputs(float(self.window.times[i]), work.samples[i, :, 0], self.inputs, i)
        trial = Trial(
            time=self.window.times[i : i + 2], states=np.column_stack([first, self.states]),
            inputs=np.concatenate([given, shown, rates]), p=self.p, params=params, width=1,
        )  # fmt: skip
        compare(self.compiled, trial, audit)

    def events(self) -> EventLog:
        """Return what has happened in the last step."""
        return happened(self.compiled, self.window.run)

    def ended(self) -> Trajectory:
        """Return the step in which the run has ended, as a run."""
        run, begin = self.window.run, self.time
        outputs = np.full((run.task.times.size, run.task.outputs, 1), np.nan)
        result = replace(made(run, outputs, 0), happened=self.events())
        return replace(
            result, time=np.array([begin, begin + self.dt]),
            states=np.column_stack([self.states, run.work.x[:, 0]]),
            inputs=np.repeat(result.inputs[:, -1:], 2, axis=1),
        )  # fmt: skip
