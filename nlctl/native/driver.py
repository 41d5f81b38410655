"""Runs of a compiled program, from arrays alone: nothing here touches a diagram."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import control as ct
import numpy as np

from ..delays.variation import Variation
from ..errors import ParameterError
from .along import derivatives
from .chattering.detection import asked, jump_of, new_paces, probe_of, snapshot
from .compiled import Compiled
from .describe import described_functions
from .diagram.program import instants_of
from .discrete import simulate_discrete
from .happened import happened, with_log
from .histories import lines_of, variations, with_past, with_room
from .integrate.log import log_room
from .integrate.memory import with_fields, with_table
from .integrate.methods.lu import WHOLE
from .integrate.methods.stiff import DIFFERENCES, EXACT, stiff_method
from .integrate.methods.tableau import Tableau, pair_of
from .integrate.methods.taylor import OTHER_METHOD, SLOPES
from .integrate.samples import Timed
from .integrate.state import DERIVATIVES, EXPLICIT, METHOD, RUNNING, Status
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

_NOTED = 1000  # events of a run for which there is room from the beginning
_PLACES = 1024  # of a run: as many the reference looks at where a loop is at rest
ROUNDS = 2000  # steps between looks at Ctrl-C and the progress


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
    return sliding(run, course.compiled, reached, (x0, p), float(np.ptp(course.times)))


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
                run = differentiated(compiled, watched(run, paces), p)
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


def go_on(run: Run, rounds: int = ROUNDS) -> Run:
    """Try up to `rounds` steps in every lane that is still running."""
    rhs, _ = run.machine.entries
    point, along = (0, 0) if run.along is None else run.along.entries
    while rounds:  # what has no room waits until there is: lanes do not shorten others' windows
        work = with_log(run.task, with_room(run.task, run.work))
        run = run if work is run.work else replace(run, work=work)
        run.lanes["untried"] = 0
        integrators()["advance"](rhs, point, along, run.task, run.work, rounds)
        run.machine.check(run.task.p)
        rounds = int(run.lanes["untried"][0])
    return run


def watched(run: Run, paces: np.ndarray) -> Run:
    """Try a window of steps in every lane; one that chatters at its end gets that status."""
    # It is the same number of steps whatever lanes are looked at, so that what becomes of one does
    # not depend on the others.
    probe = probe_of(run.task)
    run = go_on(run, ROUNDS - probe)
    if (run.lanes["status"] >= 0).all():  # all are over
        return run
    lanes = asked(run.lanes, paces).nonzero()[0]
    if not len(lanes):
        return go_on(run, probe) if RUNNING in run.lanes["status"] else run
    return _examined(run, [int(j) for j in lanes], probe)


def _examined(run: Run, lanes: list[int], probe: int) -> Run:
    """Try steps one by one, by one method; lanes that chatter there get that status."""
    task, status, attempts = run.task, run.lanes["status"], []
    turns = status == METHOD
    status[turns] = RUNNING
    run = replace(run, task=with_fields(task, taylor=with_fields(task.taylor, compared=0)))
    for _ in range(probe):
        run, attempt = snapshot(run.work, partial(go_on, run, 1))
        attempts.append(attempt)
    found = {j: jump_of(run, attempts, j) for j in lanes if status[j] == RUNNING}
    jumps = {j: jump for j, jump in found.items() if jump is not None}
    status[turns & (status == RUNNING)] = METHOD
    status[list(jumps)] = Status.CHATTERING
    return replace(run, task=task, jumps={**run.jumps, **jumps})


def differentiated(compiled: Compiled, run: Run, p: np.ndarray) -> Run:
    """Return a run with the derivatives that its stiff method has asked for, if it has."""
    if run.lanes["status"][0] != DERIVATIVES:
        return run
    along, stiff = derivatives(compiled, p), run.task.stiff
    stiff = stiff_method(
        run.work.x.shape[0],
        EXACT if along else DIFFERENCES,
        along.c if along else stiff.c,
        along.elimination if along else WHOLE,
    )
    run.lanes["status"] = RUNNING
    return replace(run, task=with_fields(run.task, stiff=stiff), along=along)


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
