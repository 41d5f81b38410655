"""The times of a run with held inputs that is not over: a window of steps, laid out like a run.

A run with held inputs has each value until the float before the next time.  A step ends there,
before anything that is due at the next time; with the next inputs it continues, as the run does.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...upstream.numba_internals import is_jit_disabled
from ..compiled import Compiled
from ..driver import Course, prepared
from ..integrate.memory import named_arrays, type_of, with_fields
from ..integrate.workspace import Task
from ..machine.address import data_address
from ..run import Run
from ..settings import Settings

HELD_STEPS = 500  # of a window
TIMES_ROW = list(type_of(Task).formats).index("times")  # of the task's table


@dataclass(frozen=True, kw_only=True)
class Window:
    """Steps that are laid out, and the run that makes them."""

    run: Run
    memory: np.ndarray  # all that the run knows but for its inputs
    ending: tuple[Any, Any]  # for the outputs at the end of a step
    first: int  # number of the first of these steps
    times: np.ndarray  # what the task's times are in full (s)
    # shape (cells,); what the task has of the cells of these times: until when a step may lead (s)
    reach: np.ndarray

    def place(self, k: int) -> int:
        """Return which of the times step `k` begins at."""
        return 2 * (k - self.first) + (self.first > 0)


def held_grid(start: float, dt: float, first: int) -> np.ndarray:
    """Return the times of a window: each step's begin, and the float before its end."""
    steps = start + dt * np.arange(first, first + HELD_STEPS + 1)
    times = np.empty(2 * HELD_STEPS + 1)
    times[::2], times[1::2] = steps, np.nextafter(steps[1:], -np.inf)
    times = times[:-1]  # where a step begins there is no end
    return times if first == 0 else np.append(np.nextafter(steps[0], -np.inf), times)


def first_window(
    compiled: Compiled, span: tuple[float, float], x0: np.ndarray, p: np.ndarray, settings: Settings
) -> Window:
    """Return the window in which a run begins at ``span[0]`` with steps of ``span[1]``."""
    times = held_grid(*span, 0)
    run = _laid(compiled, times, x0, p, settings)
    return packed_window(run, 0, times)


def _laid(
    compiled: Compiled, times: np.ndarray, x0: np.ndarray, p: np.ndarray, settings: Settings
) -> Run:
    """Lay out a run over a window, with no inputs yet."""
    inputs = np.zeros((compiled.system.ninputs or 0, times.size))
    course = Course(compiled=compiled, times=times, inputs=inputs, settings=settings)
    return prepared(course, x0[:, None], p[:, None])


def packed_window(run: Run, first: int, times: np.ndarray) -> Window:
    """Return a window whose run is in one piece of memory."""
    work, memory = in_one_piece(run.work)
    run = replace(run, work=work)
    reach = run.task.timed.reach[0].copy()
    return Window(
        run=run, memory=memory, ending=_ending(run), first=first, times=times, reach=reach
    )


def _ending(run: Run) -> tuple[Any, Any]:
    """Return task and workspace for the outputs at one time: twice, since no run is shorter."""
    task, work = run.task, run.work
    small = with_fields(
        task, times=np.array([0.0, 1.0]), inputs=np.zeros((task.inputs.shape[0], 2))
    )
    past = with_fields(work.past, shown=np.zeros((2, *work.past.shown.shape[1:])))
    return small, with_fields(
        work, past=past, samples=np.zeros((2, *work.samples.shape[1:])),
        y=np.zeros((2, *work.y.shape[1:])),
    )  # fmt: skip


def until(window: Window, k: int) -> Run:
    """Return the run of a window that ends where step `k` does."""
    run = _ending_at(window, window.place(k) + 2)
    if window.reach.size:
        reach = run.task.timed.reach[0]
        last = window.place(k) + 2
        times, count = window.times, reach.size
        part = (times[last - 1] - times[0]) / (times[-1] - times[0])
        begin = (times[last - 2] - times[0]) / (times[last - 1] - times[0])
        cells = np.arange(int(begin * count), count)
        old = ((cells + 1) * part).astype(np.int64)  # at their ends, where a step leads farthest
        reach[cells] = window.reach[np.minimum(old, count - 1)]
    return run


def in_full(window: Window) -> Run:
    """Return the run of a window that ends where the window does."""
    if window.reach.size:
        window.run.task.timed.reach[0] = window.reach
    return _ending_at(window, window.times.size)


def _ending_at(window: Window, last: int) -> Run:
    """Return the run of a window with so many times: in place, all else of the task stays."""
    task = window.run.task
    task.table[TIMES_ROW, 1] = last
    if not is_jit_disabled():
        return window.run
    return replace(window.run, task=task._replace(times=window.times[:last]))


def following(
    compiled: Compiled, window: Window, span: tuple[float, float], p: np.ndarray, settings: Settings
) -> Window:
    """Return the window of the steps that follow, with what is known then of functions of t."""
    first = window.first + HELD_STEPS
    times, work, end = held_grid(*span, first), window.run.work, window.place(first - 1) + 1
    fresh = _laid(compiled, times, work.x[:, 0], p, settings)
    old, new = window.run.task, fresh.task
    task = with_fields(new, stiff=old.stiff, taylor=old.taylor, pair=old.pair)
    task.inputs[:, 0] = old.inputs[:, end]
    shown = np.zeros((times.size, *work.past.shown.shape[1:]))
    shown[0] = work.past.shown[end]
    work = with_fields(
        work, past=with_fields(work.past, shown=shown),
        samples=np.full((times.size, *work.samples.shape[1:]), np.nan),
        y=np.full((times.size, *work.y.shape[1:]), np.nan),
    )  # fmt: skip
    run = replace(window.run, machine=fresh.machine, task=task, work=work)
    moved = packed_window(run, first, times)
    _begin(moved.run)
    return moved


def _begin(run: Run) -> None:
    """Have the only lane of a run stand at the first time of its window."""
    lane, timed, clocks = run.lanes[0], run.task.timed, run.task.clocks
    lane["segment"] = 0
    run.work.past.shown_to[:] = 0
    lane["tick"] = np.searchsorted(clocks.ticks[0], lane["t"], "right")
    if timed.jumps.shape[1]:
        rounding = 1e-14 * np.abs(run.task.times[[0, -1]]).max()
        lane["jump"] = np.searchsorted(timed.jumps[0], lane["t"] + rounding, "right")
        lane["left"] = np.append(timed.until[0], np.inf)[lane["jump"]]


_LINE = 64  # bytes of a line of the cache
_SHOWN = {  # what a step fills and nothing reads later
    ("samples",),
    ("y",),
    ("log", "t"),
    ("log", "row"),
}


def in_one_piece(work: object, memory: np.ndarray | None = None) -> tuple[Any, np.ndarray]:
    """Return a workspace with its arrays in one piece of memory, this or a new one, and that."""
    places, size = _places(work)
    if memory is None:
        whole = np.zeros(size + _LINE, np.uint8)
        first = -whole.ctypes.data % _LINE
        memory = whole[first : first + size]
    views = {}
    for path, array in _kept_arrays(work).items():
        begin = places[data_address(array)]
        views[path] = memory[begin : begin + array.nbytes].view(array.dtype).reshape(array.shape)
        views[path][:] = array
    return _with_arrays(work, views), memory


def memory_size(work: object) -> int:
    """Return how many bytes a workspace takes in one piece."""
    return _places(work)[1]


def _places(work: object) -> tuple[dict[int, int], int]:
    """Return where arrays begin in one piece of memory, by their addresses now, and its size."""
    places: dict[int, int] = {}  # arrays that are the same memory stay so
    size = 0
    for array in _kept_arrays(work).values():
        if data_address(array) not in places:
            places[data_address(array)] = size
            size += -(-array.nbytes // _LINE) * _LINE
    return places, size


def _kept_arrays(work: object) -> dict[tuple[str, ...], np.ndarray]:
    """Return the arrays of a workspace that a run reads again, by their names."""
    return {path: a for path, a in named_arrays(work) if a.size and path not in _SHOWN}


def _with_arrays(record: object, views: dict[tuple[str, ...], np.ndarray]) -> Any:
    """Return a record with other arrays."""
    whole = {path[0]: view for path, view in views.items() if len(path) == 1}
    for name in {path[0] for path in views if len(path) > 1}:
        inside = {path[1:]: view for path, view in views.items() if path[0] == name}
        whole[name] = _with_arrays(getattr(record, name), inside)
    return with_fields(record, **whole)
