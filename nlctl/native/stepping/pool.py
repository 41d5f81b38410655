"""Runs in shared arrays, so that a step of all of them is a few operations on arrays.

Each is a `HeldRun` with a window of its own, and makes the steps that it makes alone, by the same
machine code.  What is written before a step and read after it lies in one array for all of them.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...upstream.numba_internals import is_jit_disabled
from ..integrate.memory import with_fields
from ..integrate.state import LANE, OK, RUNNING
from ..integrators import handle, integrators
from ..machine.address import data_address
from .held import HeldRun
from .window import HELD_STEPS, TIMES_ROW, Window, in_one_piece, memory_size


class Pool:
    """Arrays for so many runs, and which of them are in them."""

    def __init__(self, runs: Sequence[HeldRun]) -> None:
        self.runs, self.size = runs, len(runs)
        self.windows: list[Window | None] = [None] * self.size
        self._steps: list[tuple[Any, ...]] = [()] * self.size
        self._ends: list[tuple[Any, ...]] = [()] * self.size
        self.first = np.zeros(self.size, np.int64)
        functions = integrators()
        # without JIT there is none, and no run is adopted
        self._advance: Any = getattr(functions["advance"], "each", None)
        self._show: Any = getattr(functions["outputs"], "each", None)

    def _allocate(self, window: Window) -> None:
        """Make the arrays, for windows such as this one."""
        task, work, (small, ending) = window.run.task, window.run.work, window.ending
        n, size = self.size, memory_size(work)
        whole = np.zeros(n * size + 64, np.uint8)
        begin = -whole.ctypes.data % 64
        self.memory = whole[begin : begin + n * size].reshape(n, size)
        self.tables = np.zeros((n, *task.table.shape), np.int64)
        count = 2 * HELD_STEPS + 1  # the first window has one time less
        self.times = np.zeros((n, count))
        self.inputs = np.zeros((n, len(task.inputs), count))
        self.samples = np.zeros((n, count, *work.samples.shape[1:]))
        self.end_times = np.zeros((n, 2))
        self.end_inputs = np.zeros((n, *small.inputs.shape))
        self.end_samples = np.zeros((n, *ending.samples.shape))
        self.y = np.zeros((n, *ending.y.shape))
        laid, memory = in_one_piece(work, self.memory[0])
        self.lanes = self._rows(laid.lanes, memory, LANE)
        self.expanded = self._rows(laid.taylor.expanded, memory, laid.taylor.expanded.dtype)
        self._outputs = task.outputs

    def _rows(self, array: np.ndarray, memory: np.ndarray, dtype: Any) -> np.ndarray:
        """Return the first entry of an array of every run."""
        offset = data_address(array) - data_address(memory)
        strides = (self.memory.shape[1],)
        return np.ndarray((self.size,), dtype, self.memory.data, offset, strides)

    def adopt(self, i: int) -> bool:
        """Have a run in these arrays, if it is one that they are for."""
        run = self.runs[i]
        window = run.window
        if window is self.windows[i]:
            return True
        self.windows[i] = None
        if not _is_plain(window):
            return False
        if not any(self.windows):  # the method may have changed, and with it what it remembers
            self._allocate(window)
        if memory_size(window.run.work) != self.memory.shape[1]:
            return False
        pooled = self._pooled(window, i)
        run.window = self.windows[i] = pooled
        self.first[i] = pooled.first
        task, work = pooled.ending
        self._steps[i] = run.arguments(pooled.run)
        self._ends[i] = *pooled.run.machine.entries, handle(task), handle(work)
        return True

    def _pooled(self, window: Window, i: int) -> Window:
        """Return a window whose arrays are those of a place here, with what they held."""
        run, (small, ending) = window.run, window.ending
        count = window.times.size
        self.times[i, :count], self.inputs[i, :, :count] = window.times, run.task.inputs
        self.times[i, count:] = np.inf
        work, memory = in_one_piece(
            with_fields(run.work, samples=self.samples[i]), self.memory[i]
        )  # with what it held
        small = with_fields(small, times=self.end_times[i], inputs=self.end_inputs[i])
        ending = with_fields(work, past=ending.past, samples=self.end_samples[i], y=self.y[i])
        task = with_fields(run.task, times=self.times[i], inputs=self.inputs[i])
        self.tables[i] = task.table
        run = replace(run, task=task._replace(table=self.tables[i]), work=work)
        return replace(window, run=run, memory=memory, ending=(small, ending), times=self.times[i])

    def advance(self, chosen: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Make the next step of some runs; return the outputs, NaN where a run has failed."""
        # shapes (members,), (members, ninputs); the outputs are of shape (members, noutputs)
        k = np.array([self.runs[i].k for i in chosen])
        place = 2 * (k - self.first[chosen]) + (self.first[chosen] > 0)
        self.tables[chosen, TIMES_ROW, 1] = place + 2
        self.inputs[chosen, :, place] = self.inputs[chosen, :, place + 1] = u
        self.lanes["status"][chosen] = RUNNING
        self.lanes["noted"][chosen] = self.lanes["resumes"][chosen] = 0
        self.expanded[chosen] = 0
        self._advance(self._steps[i] for i in chosen)
        end = self.times[chosen, place + 1]
        self.end_times[chosen, 0], self.end_times[chosen, 1] = end, end + 1.0
        self.end_inputs[chosen] = u[:, :, None]
        self.end_samples[chosen] = self.samples[chosen, place + 1][:, None]
        self._show(self._ends[i] for i in chosen)
        y = self.y[chosen, 0, : self._outputs, 0]
        x = self.end_samples[chosen, 0, :, 0]
        fine = self.lanes["status"][chosen] == OK
        for j, i in enumerate(chosen.tolist()):
            run = self.runs[i]
            if fine[j]:
                run.states, run.inputs, run.k = x[j], u[j], run.k + 1
            else:  # more than one round, another method, the end of the run
                outputs = run.concluded(run.followed(run.window.run), u[j])
                y[j] = np.nan if outputs is None else outputs
        y[~np.isfinite(y).all(axis=1)] = np.nan
        return y


def _is_plain(window: Window) -> bool:
    """Whether nothing has to be done for a run before or after a step but what is done here."""
    past, called = window.run.work.past, window.run.machine.lowered.calls
    return not (window.reach.size or past.fresh.size or past.shown.size or called) and (
        not is_jit_disabled()
    )
