"""Runs of a compiled program, from arrays alone: nothing here touches a diagram."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import control as ct
import numpy as np

from ..delays.variation import Variation
from ..errors import ParameterError
from .chattering.detection import new_paces
from .compiled import Compiled
from .describe import described_functions
from .diagram.program import instants_of
from .discrete import simulate_discrete
from .happened import happened
from .histories import lines_of, variations, with_past
from .integrate.log import log_room
from .integrate.memory import with_table
from .integrate.methods.tableau import Tableau, pair_of
from .integrate.methods.taylor import OTHER_METHOD, SLOPES
from .integrate.samples import Timed
from .integrate.state import EXPLICIT, RUNNING, Status
from .integrate.workspace import Task
from .integrators import integrators
from .laid import laid_out, ticks_of
from .machine.evaluations import machine
from .machine.routine import entries_of
from .results import Statistics, Trajectory, at_its_end, made
from .run import Run
from .settings import METHODS, Settings
from .slid import SlidRun, sliding
from .spare import give_back, workspace
from .taylor.method import with_taylor
from .taylor.turns import turned, with_turns
from .timed.ahead import ahead
from .windows import next_window

_NOTED = 1000  # events of a run for which there is room from the beginning
_PLACES = 1024  # of a run: as many the reference looks at where a loop is at rest


@dataclass(frozen=True, kw_only=True)
class Course:
    """What runs of a diagram have in common: all but their initial states and parameters."""

    compiled: Compiled
    times: np.ndarray  # shape (m,)
    inputs: np.ndarray  # shape (ninputs, m)
    settings: Settings

    @cached_property
    def varied(self) -> list[Variation | None]:
        """How the delay of each line varies."""
        return variations(self.compiled, self.times)


def trajectory(
    course: Course, x0: np.ndarray, p: np.ndarray, progress: Callable[[float], object] | None = None
) -> Trajectory:
    """Run one member; see `followed_up`."""
    return followed_up(course, run_once(course, x0, p, progress), x0, p, progress)


def followed_up(
    course: Course,
    reached: Trajectory,
    x0: np.ndarray,
    p: np.ndarray,
    progress: Callable[[float], object] | None = None,
) -> Trajectory:
    """Return a run; again, with functions called that have cut it short, or where it slides."""
    if not reached.cut:
        return slid_from(course, reached, x0, p, progress).of_diagram(course.compiled)
    compiled, cut = course.compiled, reached.cut
    again = run_once(replace(course, compiled=compiled.calling(cut)), x0, p, progress)
    called = described_functions(compiled.schedule, cut)
    return replace(again, cut=cut, statistics=replace(again.statistics, called=called))


def slid_from(
    course: Course,
    reached: Trajectory,
    x0: np.ndarray,
    p: np.ndarray,
    progress: Callable[[float], object] | None = None,
) -> SlidRun:
    """Return a run that chatters again, along the conditions at which it does, if it may slide."""
    settings = course.settings
    if settings.method == "taylor":  # it has no ideal relays
        settings = replace(settings, method="auto")

    def run(compiled: Compiled, x0: np.ndarray, p: np.ndarray) -> Trajectory:
        return run_once(replace(course, compiled=compiled, settings=settings), x0, p, progress)

    if not settings.slide:
        return SlidRun(compiled=course.compiled, p=p, reached=reached)
    return sliding(run, course.compiled, reached, (x0, p), course.times)


def run_once(
    course: Course, x0: np.ndarray, p: np.ndarray, progress: Callable[[float], object] | None = None
) -> Trajectory:
    """Run one member of one program.  Ctrl-C ends it with the status STOPPED."""
    compiled, settings = course.compiled, course.settings
    if not ct.isctime(compiled.system):
        return _sampled(course, x0, p)
    run = with_turns(compiled, prepared(course, x0[:, None], p[:, None]), settings)
    with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the status says
        try:
            begin(run)
            paces = new_paces(run.lanes)
            while run.lanes["status"][0] == RUNNING:
                windows = paces["windows"][0]
                run = next_window(compiled, run, paces, p)
                run = turned(compiled, run, p, settings)
                is_over = run.lanes["status"][0] != RUNNING
                if progress is not None and (is_over or paces["windows"][0] > windows):
                    progress(float(run.lanes["t"][0]))  # not after each turn to another method
        except KeyboardInterrupt:
            run.lanes["status"] = Status.STOPPED
        u = run.work.u.copy()  # where it has ended
        outputs = finish(run)
    reached = with_events(compiled, run, made(run, outputs, 0))
    reached = at_its_end(run, reached, u)
    if run.spare is not None:
        give_back(compiled.cache, run.spare)
    return reached


def with_events(compiled: Compiled, run: Any, reached: Trajectory, j: int = 0) -> Trajectory:
    """Return what became of lane `j` of a run with what has happened in it."""
    log = happened(compiled, run, j)
    return replace(
        reached, happened=log, statistics=replace(reached.statistics, events=log.time.size)
    )


def _sampled(course: Course, x0: np.ndarray, p: np.ndarray) -> Trajectory:
    """Run a discrete-time diagram; there is nothing to be set."""
    times, inputs = course.times, course.inputs
    outputs, states = simulate_discrete(course.compiled, times, inputs, x0, p)
    done = outputs.shape[1]
    run = Statistics(
        status=Status.OK if done == times.size else Status.DIVERGED,
        time=float(times[max(done - 1, 0)]),
        accepted=done,
        rejected=0,
    )
    return Trajectory(
        time=times[:done],
        outputs=outputs,
        states=states,
        statistics=run,
        inputs=inputs[:, :done],
    ).cut_short(machine(course.compiled, p[:, None]).lowered.cut)


def begin(run: Run) -> None:
    """Commit the memories and propose first steps."""
    rhs, _ = run.machine.entries
    integrators()["start"](rhs, run.task, run.work)
    run.machine.check(run.task.p)
    run.work.samples[0] = run.work.x


def finish(run: Run) -> np.ndarray:
    """Return the outputs, shape (m, outputs, members); memories get their values in the samples."""
    integrators()["outputs"](*run.machine.entries, run.task, run.work)
    run.machine.check(run.task.p)
    return np.ascontiguousarray(run.work.y[:, : run.task.outputs])


def prepared(course: Course, x0: np.ndarray, p: np.ndarray) -> Run:
    """Lay out a run of as many members as `x0` (states, members) and `p` have columns."""
    compiled, times, settings = course.compiled, course.times, course.settings
    program, count, read = compiled.program, x0.shape[1], compiled.schedule
    method, terms = _method(compiled, settings), ()
    due = instants_of(read, program, times, p) if program.clocks else []
    code = machine(compiled, p, count, [what for one in due for what in one.patterns])
    of_program, c = laid_out(compiled, code), np.zeros((code.rows, count))
    code.prepare(np.ascontiguousarray(p), c)
    task = with_table(
        Task,
        times=times,
        inputs=course.inputs,
        outputs=compiled.system.noutputs or 0,
        p=c,
        alone=int(count == 1),
        **_bounds(settings),
        method=EXPLICIT if isinstance(method, Tableau) else METHODS[method],
        pair=pair_of(settings.pair),
        stiff=of_program.stiff,
        taylor=OTHER_METHOD,
        rows=of_program.rows,
        timed=with_table(
            Timed,
            **ahead(code.lowered.timed, p, times, settings.max_step),
            opaque=float(np.ptp(times)) / _PLACES if code.lowered.calls else 0.0,
        ),
        clocks=of_program.clocks or ticks_of(compiled.program, code, due),
        resets=of_program.resets,
        sharp=of_program.sharp,
        lines=of_program.lines or lines_of(compiled, p, course.varied, entries_of((code.out,))),
    )
    if method == "taylor":
        task, terms = with_taylor(task, compiled, p, settings)
    spare = workspace(
        compiled.cache, x0, times, read.ninputs, code.lowered.rows["g"], code.lowered.rows["m"],
        len(read.outputs), code.lowered.rows["s"], len(program.guards), len(read.lines),
        SLOPES if terms else settings.pair.stages, terms or (1, 0), len(code.lowered.sharp),
        log_room(task, code.lowered.rows["g"], _NOTED + 2 * task.timed.jumps.shape[1]),
    )  # fmt: skip
    spare.work.lanes["stiff"] = method == "rodas5p"
    return with_past(compiled, Run(machine=code, task=task, work=spare.work, spare=spare), p)


def _bounds(settings: Settings) -> dict[str, Any]:
    """Return what errors and numbers of steps are bounded by."""
    return {
        "rtol": float(settings.rtol), "atol": float(settings.atol),
        "fixed": float(settings.step), "max_steps": int(settings.max_steps),
    }  # fmt: skip


def _method(compiled: Compiled, settings: Settings) -> str | Tableau:
    """Return the method of a run; what has delays is for the explicit one."""
    if not compiled.schedule.lines:
        return settings.method
    if settings.method not in ("auto", "tsit5"):
        raise ParameterError(
            f"'{compiled.system.name}' has transport delays, which method='tsit5' integrates, got "
            f"method={settings.method!r}"
        )
    return "tsit5"
